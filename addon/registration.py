"""Registration of all classes, properties and commands of the add-on."""

from __future__ import annotations

from typing import Any

import bpy

from . import command_line, preferences, properties
from .field_fit.panel import FieldPanel
from .operators import fit, fit_as_field, gradient, kept, parameters, render, targets
from .panel import derived, icons, look
from .panel import fit as fit_panel
from .panel import parameters as parameters_panel
from .panel import targets as targets_panel
from .render_engine import engine, panels, settings, view
from .running import current
from .write_back import image_undo

CLASSES: tuple[Any, ...] = (preferences.Preferences, *properties.CLASSES, *targets.CLASSES, *parameters.CLASSES,
                            render.Render, *gradient.CLASSES, *fit.CLASSES, fit_as_field.FitAsField, *kept.CLASSES,
                            *targets_panel.CLASSES, *parameters_panel.CLASSES, *fit_panel.CLASSES, FieldPanel,
                            *look.CLASSES, *settings.CLASSES, *engine.CLASSES)  # fmt: skip
_commands: list[Any] = []


def register() -> None:
    """Register classes, the scene's settings and the command ``blender --command edgegrad``."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.edgegrad = bpy.props.PointerProperty(type=properties.Settings)
    bpy.types.Scene.edgegrad_render = bpy.props.PointerProperty(type=settings.RenderEngineSettings)
    panels.show()
    bpy.types.UI_MT_button_context_menu.append(parameters.draw_in_button_menu)
    icons.register()
    derived.register()
    image_undo.register()
    _commands.append(bpy.utils.register_cli_command("edgegrad", command_line.main))


def unregister() -> None:
    """Undo `register`; a running job is ended."""
    current.shut_down("the add-on was disabled")
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    image_undo.unregister()
    derived.unregister()
    icons.unregister()
    bpy.types.UI_MT_button_context_menu.remove(parameters.draw_in_button_menu)
    view.stop_all()
    panels.hide()
    del bpy.types.Scene.edgegrad_render, bpy.types.Scene.edgegrad
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)

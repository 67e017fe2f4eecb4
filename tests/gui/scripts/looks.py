"""Derivatives in the panels Look and Plan."""

from __future__ import annotations

from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, status
from tests.gui.window import Script, area, call, open_tab, redraw, shot

FOUND: dict[str, Any] = {}


def unfold() -> None:
    """Fold the upper panels, and unfold Look and Plan, before they are drawn for the first time."""
    from bl_ext.user_default.edgegrad.panel import look, parameters, targets  # type: ignore[import-not-found]

    details = (targets.TargetDetailsPanel, parameters.ParameterDetailsPanel)  # panels within those that are made anew
    for panel in details:
        bpy.utils.unregister_class(panel)
    for panel, options in ((targets.TargetsPanel, {"DEFAULT_CLOSED"}), (parameters.ParametersPanel, {"DEFAULT_CLOSED"}),
                           (look.LookPanel, set()), (look.PlanPanel, set())):  # fmt: skip
        bpy.utils.unregister_class(panel)
        panel.bl_options = options
        bpy.utils.register_class(panel)
    for panel in details:
        bpy.utils.register_class(panel)


def main() -> Script:
    """Gradient, check, plan and vertex gradient of the cube's vertices."""
    yield from redraw(1.0)
    settings = bpy.context.scene.edgegrad
    unfold()
    stage.write_target()
    call(bpy.ops.edgegrad.target_open, "EXEC_DEFAULT", filepath=stage.TARGET)
    stage.cube()
    call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="SCULPT")
    settings.look_samples = 16
    yield from open_tab("Edgegrad")
    for name in ("gradient", "check", "gradient_colors", "plan"):
        assert call(getattr(bpy.ops.edgegrad, name)) == {"RUNNING_MODAL"}
        FOUND[f"{name} refuses"] = not bpy.ops.edgegrad.render.poll()
        yield from ended()
        FOUND[name] = status().said
        yield from redraw(0.7)
        shot(name)
    FOUND["plan lines"], FOUND["check lines"] = len(status().plan), list(status().checks)
    FOUND["shown"] = area().spaces.active.shading.color_type
    attribute = bpy.data.meshes["Cube"].color_attributes["Edgegrad Gradient"]
    FOUND["colors"] = [[round(x, 3) for x in one.color] for one in attribute.data]

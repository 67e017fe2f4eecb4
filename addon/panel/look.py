"""The panels below Fit: pictures and derivatives, the plan, what is rarely touched, and notes."""

from __future__ import annotations

from typing import Any

import bpy

from .. import rows
from ..look.vertex_gradient import ATTRIBUTE
from ..status import STATUS
from .tab import Tab, editable, others
from .words import wrapped

# Settings that other panels show.
DRAWN = ("targets", "active_target", "parameters", "active_parameter", "quality", "iterations", "look_samples",
         "direction", "term", "smoothness", "write_to", "show_shapes", "field_resolution", "field_start",
         "field_values", "restarts", "uncertainty", "use_frames", "first_frame", "last_frame",
         "frame_smoothness")  # fmt: skip


class LookPanel(Tab, bpy.types.Panel):
    """Panel with renders and derivatives."""

    bl_idname = "EDGEGRAD_PT_look"
    bl_label = "Look"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Any) -> None:
        layout = editable(self.begin())
        settings = context.scene.edgegrad
        layout.prop(settings, "look_samples")
        layout.operator("edgegrad.render", icon="RENDER_STILL")
        if settings.active_parameter >= len(settings.parameters):
            layout.label(text="Add a parameter to see its gradient", icon="INFO")
            return
        wrapped(context, layout, f"Gradient of '{settings.parameters[settings.active_parameter].name}'")
        column = layout.column()
        column.prop(settings, "direction")
        column.prop(settings, "term")
        row = layout.row(align=True)
        row.operator("edgegrad.gradient", icon="NODE_TEXTURE")
        row.operator("edgegrad.check", icon="CHECKMARK")
        for line in STATUS.of_scene(STATUS.checks):
            wrapped(context, layout, line, "ERROR" if "DIFFERS" in line else "CHECKMARK")
        if any(row.kind == "VERTICES" for row in rows.switched_on(context.scene)):
            layout.operator("edgegrad.gradient_colors", icon="GROUP_VCOL")
            wrapped(context, layout, f"Where the targets push vertices, as color attribute '{ATTRIBUTE}'")


class PlanPanel(Tab, bpy.types.Panel):
    """Panel with the plan in words."""

    bl_idname = "EDGEGRAD_PT_plan"
    bl_label = "Plan"
    bl_order = 5
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Any) -> None:
        layout = self.layout
        editable(layout.column()).operator("edgegrad.plan", text="What Is Computed", icon="QUESTION")
        for line in STATUS.of_scene(STATUS.plan):
            wrapped(context, layout, line.strip(), "DOT" if line.startswith(" ") else "NONE")


class AdvancedPanel(Tab, bpy.types.Panel):
    """Panel with settings that are rarely touched."""

    bl_idname = "EDGEGRAD_PT_advanced"
    bl_label = "Advanced"
    bl_order = 6
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Any) -> None:
        layout = editable(self.begin())
        others(layout, context.scene.edgegrad, DRAWN)


class NotesPanel(Tab, bpy.types.Panel):
    """Panel with the warnings and notes of the last operator on this scene."""

    bl_idname = "EDGEGRAD_PT_notes"
    bl_label = "Notes"
    bl_order = 7
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bool(STATUS.warnings or STATUS.notes) and bool(STATUS.lines)

    def draw(self, context: Any) -> None:
        for icon, sentence in STATUS.lines:
            wrapped(context, self.layout, sentence, icon)


CLASSES: tuple[Any, ...] = (LookPanel, PlanPanel, AdvancedPanel, NotesPanel)

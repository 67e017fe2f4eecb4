"""The Edgegrad tab in the sidebar of the 3D view."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from .status import STATUS
from .targets.draw import draw_target

# Mean width of a character, and width of the margins and an icon of a panel; pixels at scale 1.
CHARACTER, MARGINS = 6.6, 52


class TargetList(bpy.types.UIList):
    """List of the targets; each line shows camera, picture and mask."""

    bl_idname = "EDGEGRAD_UL_targets"

    def draw_item(self, context: Any, layout: Any, data: Any, item: Any, icon: int, active_data: Any,
                  active_property: str) -> None:  # fmt: skip
        row = layout.row(align=True)
        row.prop(item, "camera", text="")
        row.prop(item, "image", text="")
        row.label(text="", icon="MOD_MASK" if item.mask else "BLANK1")


class ParameterList(bpy.types.UIList):
    """List of the properties to fit; each line shows its datablock, path and sensitivity."""

    bl_idname = "EDGEGRAD_UL_parameters"

    def draw_item(self, context: Any, layout: Any, data: Any, item: Any, icon: int, active_data: Any,
                  active_property: str) -> None:  # fmt: skip
        row = layout.row(align=True)
        row.prop(item, "enabled", text="")
        name = "(removed)" if item.owner is None else item.owner.name
        number = "" if item.index < 0 else f"[{item.index}]"
        row.label(text=f"{name}  {item.path}{number}", icon="ERROR" if item.owner is None else "NONE")
        if item.sensitivity >= 0.0:
            row.label(text=f"{item.sensitivity:.0%}")


class MainPanel(bpy.types.Panel):
    """Panel with the targets, the parameters, and the buttons Fit, Render and Gradient."""

    bl_idname = "EDGEGRAD_PT_main"
    bl_label = "Edgegrad"
    bl_category = "Edgegrad"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.edgegrad
        row = layout.row()
        row.template_list(TargetList.bl_idname, "", settings, "targets", settings, "active_target", rows=3)
        column = row.column(align=True)
        column.operator("edgegrad.target_add", text="", icon="ADD")
        column.operator("edgegrad.target_remove", text="", icon="REMOVE")
        column.operator("edgegrad.cameras_import", text="", icon="CAMERA_DATA")
        column.operator("edgegrad.cameras_from_clip", text="", icon="TRACKER")
        if settings.active_target < len(settings.targets):
            draw_target(layout, settings.targets[settings.active_target])
        row = layout.row()
        row.template_list(ParameterList.bl_idname, "", settings, "parameters", settings, "active_parameter", rows=3)
        column = row.column(align=True)
        column.operator_menu_enum("edgegrad.parameters_add", "of", text="", icon="ADD")
        column.operator("edgegrad.parameter_remove", text="", icon="REMOVE")
        if settings.active_parameter < len(settings.parameters):
            item = settings.parameters[settings.active_parameter]
            column = layout.column()
            column.prop(item, "step")
            column.prop(item, "use_limits")
            if item.use_limits:
                column.prop(item, "low")
                column.prop(item, "high")
        column = layout.column(heading="Selected")
        column.prop(settings, "vertices")
        column.prop(settings, "base_color")
        column = layout.column()
        column.prop(settings, "loss")
        column.prop(settings, "iterations")
        column.prop(settings, "samples")
        column.prop(settings, "smoothness")
        column.prop(settings, "write_to")
        if not settings.targets:
            layout.label(text="Add the active camera as a target first", icon="INFO")
        if STATUS.fraction is None:
            column = layout.column()
            column.enabled = len(settings.targets) > 0
            column.operator("edgegrad.fit", icon="PLAY")
        else:
            layout.progress(factor=STATUS.fraction, type="BAR", text=STATUS.text)
            layout.label(text="Esc: cancel, Enter: stop and keep the best")
        layout.prop(settings, "direction")
        row = layout.row(align=True)
        row.operator("edgegrad.render", icon="RENDER_STILL")
        row.operator("edgegrad.gradient", icon="NODE_TEXTURE")


class NotesPanel(bpy.types.Panel):
    """Panel with the warnings and notes of the last operator on this scene."""

    bl_idname = "EDGEGRAD_PT_notes"
    bl_parent_id = "EDGEGRAD_PT_main"
    bl_label = "Notes"
    bl_category = "Edgegrad"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bool(STATUS.lines)

    def draw(self, context: Any) -> None:
        scale = context.preferences.system.ui_scale
        width = max(16, int((context.region.width / scale - MARGINS) / CHARACTER))
        for icon, sentence in STATUS.lines:
            column = self.layout.column(align=True)
            column.scale_y = 0.8
            for k, line in enumerate(textwrap.wrap(sentence, width)):
                column.label(text=line, icon=icon if k == 0 else "BLANK1")


CLASSES: tuple[Any, ...] = (TargetList, ParameterList, MainPanel, NotesPanel)

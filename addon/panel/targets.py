"""The panel Targets: what the pictures should look like."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators.targets import FILTER, DropTargets
from ..targets.draw import draw_details, draw_target
from . import derived
from .tab import Tab, editable
from .words import wrapped


class TargetList(bpy.types.UIList):
    """List of the targets; each line shows camera, picture and mask."""

    bl_idname = "EDGEGRAD_UL_targets"

    def draw_item(self, context: Any, layout: Any, data: Any, item: Any, icon: int, active_data: Any,
                  active_property: str) -> None:  # fmt: skip
        found, weight = derived.picture(item, context.scene), item.weight
        row = layout.row(align=True)
        split = row.split(factor=0.5, align=True)
        if found.camera:
            split.label(text=found.camera)
        else:
            split.label(text="no camera", icon="ERROR")
        split.label(text=found.words, icon_value=found.thumbnail)
        if item.mask:
            row.label(text="", icon="MOD_MASK")
        if weight != 1.0:
            row.label(text=f"× {weight:.2g}")
        row.label(text="", icon=found.icon)


class TargetsPanel(Tab, bpy.types.Panel):
    """Panel with the targets."""

    bl_idname = "EDGEGRAD_PT_targets"
    bl_label = "Targets"
    bl_order = 0

    def draw(self, context: Any) -> None:
        layout = editable(self.begin())
        settings = context.scene.edgegrad
        if not settings.targets:
            wrapped(context, layout, "Drop here the picture that the active camera should see, or open it. Then choose "
                    "below what may change, and press Fit.", "INFO")  # fmt: skip
            column = layout.column()
            column.scale_y = 1.3
            column.operator("edgegrad.target_open", icon="FILE_FOLDER")
            column.operator("edgegrad.cameras_import", icon="CAMERA_DATA")
            return
        derived.see_rows(settings)
        row = layout.row()
        row.template_list(TargetList.bl_idname, "", settings, "targets", settings, "active_target", rows=3)
        column = row.column(align=True)
        column.operator("edgegrad.target_add", text="", icon="ADD")
        column.operator("edgegrad.target_remove", text="", icon="REMOVE")
        column.operator("edgegrad.cameras_import", text="", icon="CAMERA_DATA")
        column.operator("edgegrad.cameras_from_clip", text="", icon="TRACKER")
        if settings.active_target >= len(settings.targets):
            return
        target = settings.targets[settings.active_target]
        column = layout.column()
        column.prop(target, "camera")
        column.prop(target, "image")
        draw_target(column, target)
        found = derived.picture(target, context.scene)
        size, rendered, fits = found.size, found.render_size, found.fits
        if size is not None and size == rendered:
            layout.label(text=f"{size[0]} × {size[1]}, as renders", icon="CHECKMARK")
        elif size is not None:
            column = layout.column(align=True)
            wrapped(context, column, f"{size[0]} × {size[1]}, {'' if fits else 'of another aspect; '}renders are "
                    f"{rendered[0]} × {rendered[1]}", "INFO" if fits else "ERROR")  # fmt: skip
            column.operator("edgegrad.match_render", icon="OUTPUT")


class TargetDetailsPanel(Tab, bpy.types.Panel):
    """Panel with the settings of the active target that are rarely touched."""

    bl_idname = "EDGEGRAD_PT_target_details"
    bl_label = "Details"
    bl_parent_id = TargetsPanel.bl_idname
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        settings = context.scene.edgegrad
        return settings.active_target < len(settings.targets)

    def draw(self, context: Any) -> None:
        settings = context.scene.edgegrad
        draw_details(editable(self.begin()), settings.targets[settings.active_target])


class DroppedPictures(bpy.types.FileHandler):
    """Pictures that are dropped on the tab become targets."""

    bl_idname = "EDGEGRAD_FH_pictures"
    bl_label = "Target Pictures"
    bl_import_operator = DropTargets.bl_idname
    bl_file_extensions = FILTER.replace("*", "")

    @classmethod
    def poll_drop(cls, context: Any) -> bool:
        area, region = context.area, context.region
        return (area is not None and area.type == Tab.bl_space_type
                and region is not None and region.type == Tab.bl_region_type
                and getattr(region, "active_panel_category", Tab.bl_category) == Tab.bl_category)  # fmt: skip


CLASSES: tuple[Any, ...] = (TargetList, TargetsPanel, TargetDetailsPanel, DroppedPictures)

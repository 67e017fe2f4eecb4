"""The panel Targets: what the pictures should look like."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators.targets import FILTER, DropTargets
from ..targets.draw import draw_details, draw_target
from . import derived, icons
from .tab import Tab, editable
from .words import wrapped


class TargetList(bpy.types.UIList):
    """List of the targets; each line shows camera, picture and mask."""

    bl_idname = "EDGEGRAD_UL_targets"

    def draw_item(self, context: Any, layout: Any, data: Any, item: Any, icon: int, active_data: Any,
                  active_property: str) -> None:  # fmt: skip
        found, weight = derived.picture(item, context.scene, len(data.targets)), item.weight
        row = layout.row(align=True)
        split = row.split(factor=0.5, align=True)
        split.label(text=found.camera)
        split.label(text=found.words, icon_value=found.thumbnail)
        if item.mask:
            row.label(icon="MOD_MASK")
        if weight != 1.0:
            row.label(text=f"× {weight:.2g}")
        row.label(icon_value=found.icon)


class CamerasMenu(bpy.types.Menu):
    """Cameras that come with their pictures"""

    bl_idname = "EDGEGRAD_MT_cameras"
    bl_label = "Import Cameras"

    def draw(self, context: Any) -> None:
        self.layout.operator("edgegrad.cameras_import", text="Import Cameras…", icon="CAMERA_DATA")
        self.layout.operator("edgegrad.cameras_from_clip", text="Cameras from Movie Clip…", icon="TRACKER")


class TargetsPanel(Tab, bpy.types.Panel):
    """Panel with the targets."""

    bl_idname = "EDGEGRAD_PT_targets"
    bl_label = "Targets"
    bl_order = 0

    def draw(self, context: Any) -> None:
        layout, scene = editable(self.layout), context.scene
        settings = scene.edgegrad
        targets = settings.targets
        count = len(targets)
        seen = derived.see_targets(settings, count)
        if not count:
            wrapped(context, layout, "Drop here the picture that the active camera should see, or open it. Then choose "
                    "below what may change, and press Fit.", "INFO")  # fmt: skip
            column = layout.column()
            column.scale_y = 1.3
            column.operator("edgegrad.target_open", icon="FILE_FOLDER")
            column.operator("edgegrad.cameras_import", icon="CAMERA_DATA")
            return
        several = count > 1
        number = min(settings.active_target, count - 1) if several else 0
        found = derived.picture(targets[number], scene, count) if several else derived.only_target(seen, scene)
        row = layout.row(align=True)
        if several:
            row.template_list("EDGEGRAD_UL_targets", "", settings, "targets", settings, "active_target", rows=4)
            _list_buttons(row.column(align=True))
        else:
            row.label(text=found.title, icon_value=found.thumbnail or found.icon)
            _list_buttons(row)
        if not found.complete:
            draw_target(editable(self.begin()), targets[number])
        if found.difference:
            column = layout.column(align=True)
            wrapped(context, column, found.difference)
            obstacle = derived.start(context, settings).obstacle
            if obstacle is None or obstacle.operator != "edgegrad.match_render":  # else the panel Fit has the button
                column.operator("edgegrad.match_render", icon="OUTPUT")


def _list_buttons(layout: Any) -> None:
    layout.operator("edgegrad.target_add", text="", icon_value=icons.ADD)
    layout.operator("edgegrad.target_remove", text="", icon_value=icons.REMOVE)
    layout.menu("EDGEGRAD_MT_cameras", text="", icon_value=icons.MORE)


class TargetDetailsPanel(Tab, bpy.types.Panel):
    """Panel with the settings of the active target."""

    bl_idname = "EDGEGRAD_PT_target_details"
    bl_label = "Details"
    bl_parent_id = TargetsPanel.bl_idname
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        settings = context.scene.edgegrad
        return settings.active_target < len(settings.targets)

    def draw(self, context: Any) -> None:
        settings, layout = context.scene.edgegrad, editable(self.begin())
        targets = settings.targets
        target = targets[settings.active_target]
        found = derived.picture(target, context.scene, len(targets))
        if found.complete:  # else its fields are above
            draw_target(layout, target)
        if found.size:
            layout.label(text=found.size, icon_value=found.icon)
        draw_details(layout, target)


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


CLASSES: tuple[Any, ...] = (TargetList, CamerasMenu, TargetsPanel, TargetDetailsPanel, DroppedPictures)

"""The operators on the list of targets."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

from .. import target_rows
from ..problem import Problem
from . import _common

FILTER = "*.exr;*.png;*.jpg;*.jpeg;*.tif;*.tiff"


def add_target(scene: Any) -> Any:
    """Add a target for the next camera without one; return the row, which is made active."""
    settings = scene.edgegrad
    row = settings.targets.add()
    row.camera = target_rows.next_camera(scene)
    settings.active_target = len(settings.targets) - 1
    return row


class AddTarget(bpy.types.Operator):
    """Add a target for the active camera, or for the next camera without one"""

    bl_idname = "edgegrad.target_add"
    bl_label = "Add Target"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context: Any) -> set[str]:
        row = add_target(context.scene)
        if row.camera is None:
            self.report({"INFO"}, "every camera has a target; choose the camera of the new one")
        return {"FINISHED"}


class RemoveTarget(bpy.types.Operator):
    """Remove the target from the list; its files are kept"""

    bl_idname = "edgegrad.target_remove"
    bl_label = "Remove Target"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        return len(context.scene.edgegrad.targets) > 0

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.edgegrad
        settings.targets.remove(settings.active_target)
        settings.active_target = max(0, min(settings.active_target, len(settings.targets) - 1))
        return {"FINISHED"}


class OpenTarget(bpy.types.Operator):
    """Choose the picture of the active target, or of a new one for the active camera"""

    bl_idname = "edgegrad.target_open"
    bl_label = "Open Target Picture"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    number: bpy.props.IntProperty(  # type: ignore[valid-type]
        default=-1, options={"HIDDEN", "SKIP_SAVE"}, description="Number of the target; -1: the active one")
    filepath: bpy.props.StringProperty(subtype="FILE_PATH")  # type: ignore[valid-type]
    filter_glob: bpy.props.StringProperty(default=FILTER, options={"HIDDEN"})  # type: ignore[valid-type]

    def invoke(self, context: Any, event: Any) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.edgegrad
        first = not settings.targets
        if first or settings.active_target >= len(settings.targets):
            add_target(context.scene)
        elif self.number >= 0:
            settings.active_target = self.number
        row = settings.targets[settings.active_target]
        row.image = self.filepath
        size = target_rows.picture_size(row.image)
        if size is None:
            return _common.refuse(self, Problem(f"image '{row.image}': can't be read"))
        if first and size != target_rows.render_size(context.scene):
            target_rows.set_render_size(context.scene, size)
            self.report({"INFO"}, f"renders have the size of the picture now, {size[0]} x {size[1]}")
        return {"FINISHED"}


class MatchRender(bpy.types.Operator):
    """Make the scene's renders as large as the picture of the active target"""

    bl_idname = "edgegrad.match_render"
    bl_label = "Match Render to Picture"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    number: bpy.props.IntProperty(  # type: ignore[valid-type]
        default=-1, options={"HIDDEN", "SKIP_SAVE"}, description="Number of the target; -1: the active one")

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.scene.edgegrad.active_target < len(context.scene.edgegrad.targets)

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.edgegrad
        if 0 <= self.number < len(settings.targets):
            settings.active_target = self.number
        row = settings.targets[settings.active_target]
        size = target_rows.picture_size(row.image)
        if size is None:
            return _common.refuse(self, Problem(f"image '{row.image}': can't be read; choose another picture"))
        target_rows.set_render_size(context.scene, size)
        self.report({"INFO"}, f"renders are {size[0]} x {size[1]} pixels now")
        return {"FINISHED"}


class RemoveRow(bpy.types.Operator):
    """Remove the row that is in the way of a fit"""

    bl_idname = "edgegrad.row_remove"
    bl_label = "Remove Row"
    bl_options = {"INTERNAL", "UNDO"}  # noqa: RUF012

    parameters: bpy.props.BoolProperty(options={"SKIP_SAVE"})  # type: ignore[valid-type]
    number: bpy.props.IntProperty(options={"SKIP_SAVE"})  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.edgegrad
        (settings.parameters if self.parameters else settings.targets).remove(self.number)
        return {"FINISHED"}


CLASSES: tuple[Any, ...] = (AddTarget, RemoveTarget, OpenTarget, MatchRender, RemoveRow)

"""The operators that add and remove targets, and import cameras with their pictures."""

from __future__ import annotations

from typing import Any

import bpy

from edgegrad.calibration import read_calibration

from ..targets.calibrated_cameras import HOLDER, add_cameras
from . import _common


class AddTarget(bpy.types.Operator):
    """Add a target for the active camera"""

    bl_idname = "edgegrad.target_add"
    bl_label = "Add Target"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.edgegrad
        settings.targets.add().camera = context.scene.camera
        settings.active_target = len(settings.targets) - 1
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


class ImportCameras(bpy.types.Operator):
    """Add the cameras of a calibration, with their pictures as backgrounds and targets"""

    bl_idname = "edgegrad.cameras_import"
    bl_label = "Import Cameras"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    filepath: bpy.props.StringProperty(subtype="FILE_PATH")  # type: ignore[valid-type]
    filter_glob: bpy.props.StringProperty(default="*.json;*.txt", options={"HIDDEN"})  # type: ignore[valid-type]
    as_targets: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="As Targets", default=True, description="Add each picture to the list of targets")

    def invoke(self, context: Any, _: Any) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.edgegrad
        try:
            found = read_calibration(self.filepath)
            cameras = add_cameras(context.scene, found)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        missing = [one.name for one in found if not one.image.is_file()]
        for camera, one in zip(cameras, found, strict=True):
            if self.as_targets and one.image.is_file():
                item = settings.targets.add()
                item.camera, item.image = camera, str(one.image)
        if missing:
            self.report({"WARNING"}, f"{len(missing)} of {len(found)} pictures are not there, such as '{missing[0]}'")
        self.report({"INFO"}, f"{len(found)} cameras were added below '{HOLDER}', which places and scales them all")
        return {"FINISHED"}


CLASSES: tuple[Any, ...] = (AddTarget, RemoveTarget, ImportCameras)

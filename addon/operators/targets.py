"""The operators on the list of targets, and those that import cameras with their pictures."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from pathlib import Path
from typing import Any

import bpy

from ..export.surroundings.camera import render_size
from ..problem import Problem, counted
from ..status import STATUS
from ..targets import rows
from ..targets.calibrated_cameras import CLIP, HOLDER, add_calibration
from . import _common

FILTER = ";".join(("*.exr;*.png;*.jpg;*.jpeg;*.tif;*.tiff", *(f"*{end}" for end in bpy.path.extensions_movie)))


def add_target(scene: Any) -> Any:
    """Add a target for the next camera without one; return the row, which is made active."""
    settings = scene.edgegrad
    row = settings.targets.add()
    row.camera = rows.next_camera(scene)
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
            _common.say(self, "INFO", "every camera has a target; choose the camera of the new one")
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
        return _import(self, context, self.filepath)


class ImportClip(bpy.types.Operator):
    """Add solved frames of a movie clip as cameras, with their pictures as backgrounds and targets"""

    bl_idname = "edgegrad.cameras_from_clip"
    bl_label = "Cameras from Movie Clip"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    clip: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Clip", description="Movie clip whose camera motion is solved; empty: the active clip of the scene")
    every: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Step", default=10, min=1, description="Use each so-many-th frame")
    as_targets: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="As Targets", default=True, description="Add each frame to the list of targets")

    def invoke(self, context: Any, _: Any) -> set[str]:
        active = context.scene.active_clip or next(iter(bpy.data.movieclips), None)
        if not self.clip and active is not None:
            self.clip = active.name
        return set(context.window_manager.invoke_props_dialog(self))

    def draw(self, context: Any) -> None:
        self.layout.prop_search(self, "clip", bpy.data, "movieclips")
        self.layout.prop(self, "every")
        self.layout.prop(self, "as_targets")

    def execute(self, context: Any) -> set[str]:
        active = context.scene.active_clip
        return _import(self, context, CLIP + (self.clip or (active.name if active else "")), self.every)


def _import(operator: Any, context: Any, source: str, every: int = 1) -> set[str]:
    """Add the cameras of a calibration, and a target for each picture that is there."""
    try:
        found = add_calibration(context.scene, source, every)
    except _common.EXPECTED as error:
        return _common.refuse(operator, error)
    missing = [one.image.name for one in found if not one.image.is_file()]
    for one in found:
        if operator.as_targets and one.image.is_file():
            item = context.scene.edgegrad.targets.add()
            item.camera, item.image = one.camera, str(one.image)
            item.use_frame, item.frame = one.frame is not None, one.frame or 1
    if missing:
        _common.say(operator, "WARNING", f"of {counted(len(found), 'picture', 'pictures')}, {len(missing)} can't be "
                    f"found, such as '{missing[0]}'")
    _common.say(operator, "INFO", f"{counted(len(found), 'camera was', 'cameras were')} added below '{HOLDER}', which "
                    "places and scales them all")
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
        if 0 <= self.number < len(settings.targets):
            settings.active_target = self.number
        return _open(self, context, self.filepath)


def _open(operator: Any, context: Any, path: str) -> set[str]:
    """Take a picture for the active target; the first one sets the size of renders."""
    settings = context.scene.edgegrad
    first = all(not row.image and row.datablock is None for row in settings.targets)
    if settings.active_target >= len(settings.targets):
        add_target(context.scene)
    row = settings.targets[settings.active_target]
    row.image = path
    size, problem = rows.size_of(row), rows.problem_of(row)
    if problem:
        return _common.refuse(operator, Problem(f"image '{row.image}': {problem}"))
    if first and size is not None and size != render_size(context.scene):
        rows.set_render_size(context.scene, size)
        _common.say(operator, "INFO", f"renders have the size of the picture now, {size[0]} x {size[1]}")
    return {"FINISHED"}


class DropTargets(bpy.types.Operator):
    """Take pictures as targets of the active camera and of those without a target"""

    bl_idname = "edgegrad.targets_drop"
    bl_label = "Use as Edgegrad Target"
    bl_options = {"INTERNAL", "UNDO"}  # noqa: RUF012

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE"})  # type: ignore[valid-type]
    files: bpy.props.CollectionProperty(  # type: ignore[valid-type]
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: Any) -> bool:
        return STATUS.job is None

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.edgegrad
        for file in self.files:
            active = settings.active_target
            waits = active < len(settings.targets) and rows.problem_of(settings.targets[active]) != ""
            if not waits and rows.next_camera(context.scene) is not None:
                add_target(context.scene)
            elif not waits and len(self.files) > 1:
                return _common.refuse(self, Problem(f"image '{file.name}': every camera has a target; add a camera"))
            found = _open(self, context, str(Path(self.directory) / file.name))
            if found != {"FINISHED"}:
                return found
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
        size = rows.size_of(row)
        if size is None:
            return _common.refuse(self, Problem(f"image '{row.image}': its size is not known; choose another picture"))
        rows.set_render_size(context.scene, size)
        _common.say(self, "INFO", f"renders are {size[0]} x {size[1]} pixels now")
        return {"FINISHED"}


class UseCamera(bpy.types.Operator):
    """Compare the target's picture with what the active camera sees, or the next camera without a target"""

    bl_idname = "edgegrad.target_use_camera"
    bl_label = "Use Camera"
    bl_options = {"INTERNAL", "UNDO"}  # noqa: RUF012

    number: bpy.props.IntProperty(options={"SKIP_SAVE"})  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        context.scene.edgegrad.targets[self.number].camera = rows.next_camera(context.scene)
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
        held, active = ("parameters", "active_parameter") if self.parameters else ("targets", "active_target")
        rows_left, before = getattr(settings, held), getattr(settings, active)
        rows_left.remove(self.number)
        setattr(settings, active, max(min(before - (self.number < before), len(rows_left) - 1), 0))
        return {"FINISHED"}


CLASSES: tuple[Any, ...] = (AddTarget, RemoveTarget, OpenTarget, DropTargets, MatchRender, UseCamera, RemoveRow,
                            ImportCameras, ImportClip)  # fmt: skip

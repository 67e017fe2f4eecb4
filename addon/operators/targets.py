"""The operators that add and remove targets."""

from __future__ import annotations

from typing import Any

import bpy


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


CLASSES: tuple[Any, ...] = (AddTarget, RemoveTarget)

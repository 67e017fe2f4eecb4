"""Operators on the list of properties to fit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..animated import gathering
from ..animated.stored import add_row
from ..problem import Problem
from . import _common

KINDS = (
    ("OBJECT", "Active Object", "All properties of the active object, its data, modifiers and shape keys"),
    ("BONES", "Active Bone and Below", "Rotations, and free locations, of the active bone and all bones below it"),
    ("MATERIAL", "Active Material", "All values of the nodes of the active object's material"),
    ("WORLD", "World", "All values of the nodes of the world"),
    ("CAMERA", "Camera", "Place and lens of the scene's camera"),
)


def _active(context: Any) -> Any:
    ob = context.view_layer.objects.active
    if ob is None:
        raise Problem("no object is active; select one")
    return ob


def _object(context: Any) -> list[tuple[Any, str]]:
    return gathering.of_object(_active(context))


def _bones(context: Any) -> list[tuple[Any, str]]:
    ob = _active(context)
    bone = ob.data.bones.active if ob.type == "ARMATURE" else None
    if bone is None:
        raise Problem(f"object '{ob.name}': has no active bone; make a bone of an armature active")
    return gathering.of_bones(ob, ob.pose.bones[bone.name])


def _material(context: Any) -> list[tuple[Any, str]]:
    ob = _active(context)
    if ob.active_material is None:
        raise Problem(f"object '{ob.name}': has no active material")
    return gathering.of_nodes(ob.active_material)


def _world(context: Any) -> list[tuple[Any, str]]:
    if context.scene.world is None:
        raise Problem(f"scene '{context.scene.name}': has no world")
    return gathering.of_nodes(context.scene.world)


def _camera(context: Any) -> list[tuple[Any, str]]:
    if context.scene.camera is None:
        raise Problem(f"scene '{context.scene.name}': has no camera; add one and make it active")
    return gathering.of_object(context.scene.camera)


GATHER: dict[str, Callable[[Any], list[tuple[Any, str]]]] = {
    "OBJECT": _object, "BONES": _bones, "MATERIAL": _material, "WORLD": _world, "CAMERA": _camera,
}  # fmt: skip


class ParametersAdd(bpy.types.Operator):
    """Add all properties of one thing to the list of what a fit changes"""

    bl_idname = "edgegrad.parameters_add"
    bl_label = "Add Properties"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    of: bpy.props.EnumProperty(name="Of", items=KINDS)  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        """Add those that a fit can set, and tell the others."""
        try:
            kept, refused = gathering.settable(GATHER[self.of](context))
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        for places in kept:
            add_row(context.scene, places[0].owner, places[0].path, places[0].index if len(places) == 1 else -1)
        for sentence in refused:
            self.report({"INFO"}, sentence)
        self.report({"INFO"}, f"{len(kept)} properties")
        return {"FINISHED"}


class ParameterAdd(bpy.types.Operator):
    """Add the property of this button to the list of what a fit changes"""

    bl_idname = "edgegrad.parameter_add"
    bl_label = "Fit This Property"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context: Any) -> set[str]:
        """Add the property under the mouse."""
        found = getattr(context, "property", None)
        if found is None:
            return _common.refuse(self, Problem("there is no property under the mouse"))
        try:
            add_row(context.scene, *found)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        return {"FINISHED"}


class ParameterRemove(bpy.types.Operator):
    """Remove the property from the list"""

    bl_idname = "edgegrad.parameter_remove"
    bl_label = "Remove Property"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context: Any) -> set[str]:
        """Remove the active line."""
        settings = context.scene.edgegrad
        settings.parameters.remove(settings.active_parameter)
        settings.active_parameter = max(0, min(settings.active_parameter, len(settings.parameters) - 1))
        return {"FINISHED"}


def draw_in_button_menu(menu: Any, context: Any) -> None:
    """Offer the property under the mouse, if it can be fitted, in the menu of its button."""
    found = getattr(context, "property", None)
    if found is not None and getattr(context.scene, "edgegrad", None) is not None:
        menu.layout.separator()
        menu.layout.operator(ParameterAdd.bl_idname)


CLASSES: tuple[Any, ...] = (ParametersAdd, ParameterAdd, ParameterRemove)

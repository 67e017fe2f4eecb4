"""Operators on the list of parameters."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from collections.abc import Callable
from typing import Any

import bpy

from .. import rows, setups
from ..animated import data_path, gathering
from ..animated.stored import add_row
from ..evaluation import active_camera
from ..problem import Problem, counted
from ..status import STATUS
from . import _common

KINDS = (
    ("VERTICES", "Vertices of Selected", "The vertices of the selected meshes"),
    ("BASE_COLOR", "Base Colors of Selected", "The base colors of the selected objects' materials"),
    ("EMISSION", "Emission of Selected", "The emission colors of the selected objects' materials"),
    ("POWER", "Powers of Selected Lights", "The powers, or the strengths, of the selected lights"),
    ("IMAGE", "Images of Selected", "The pixels of the images that the selected objects' materials show"),
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
    return gathering.of_object(active_camera(context.scene))


GATHER: dict[str, Callable[[Any], list[tuple[Any, str]]]] = {
    "OBJECT": _object, "BONES": _bones, "MATERIAL": _material, "WORLD": _world, "CAMERA": _camera,
}  # fmt: skip


def _add_kind(context: Any, kind: str) -> str:
    """Add rows of a kind for what is selected; return what was added, in words."""
    if kind == "VERTICES":
        owners, what = setups.selected(context), "mesh"
    elif kind == "POWER":
        owners, what = setups.selected(context, "LIGHT"), "light"
    elif kind == "IMAGE":
        owners, what = setups.images_of(setups.materials_of(setups.selected(context))), "mesh with an image"
    else:
        owners, what = setups.materials_of(setups.selected(context)), "mesh with a material"
    if not owners:
        raise Problem(f"no {what} is selected; select one")
    for owner in owners:
        rows.add_kind(context.scene, kind, owner)
    return f"{rows.KINDS[kind].label}: {', '.join(owner.name for owner in owners)}"


class ParametersAdd(bpy.types.Operator):
    """Add values of what is selected or active to the list of what a fit changes"""

    bl_idname = "edgegrad.parameters_add"
    bl_label = "Add from Selection"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    of: bpy.props.EnumProperty(name="Of", items=KINDS)  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        """Add those that a fit can set, and tell the others."""
        settings = context.scene.edgegrad
        count = len(settings.parameters)
        try:
            if self.of in rows.KINDS:
                said = _add_kind(context, self.of)
                settings.active_parameter = min(count, len(settings.parameters) - 1)
                self.report({"INFO"}, said)
                return {"FINISHED"}
            kept, refused = gathering.settable(GATHER[self.of](context))
            if not kept:
                raise Problem(refused[0] if refused else "there is no property that a fit can change")
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        for places in kept:
            add_row(context.scene, places[0].owner, places[0].path, places[0].index if len(places) == 1 else -1)
        for sentence in refused:
            _common.say(self, "INFO", sentence)
        settings.active_parameter = max(0, min(count, len(settings.parameters) - 1))
        _common.say(self, "INFO", f"{counted(len(kept), 'property', 'properties')} may change")
        return {"FINISHED"}


def add_of_button(scene: Any, owner: Any, path: str, index: int) -> Any:
    """Add the row of the property that a button shows; the name of an image, as nodes show it, stands for its pixels.

    Raises
    ------
    Problem
        If it can't be fitted.
    """
    owner, path = data_path.of_button(owner, path)
    shown = owner if isinstance(owner, bpy.types.Image) else data_path.resolved(owner, path)
    if isinstance(shown, bpy.types.Image):
        return rows.add_kind(scene, "IMAGE", shown)
    return add_row(scene, owner, path, index)


class ParameterAdd(bpy.types.Operator):
    """Add the property of this button, or the pixels of its image, to the list of what a fit changes"""

    bl_idname = "edgegrad.parameter_add"
    bl_label = "Fit with Edgegrad"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context: Any) -> set[str]:
        """Add the property under the mouse."""
        found = getattr(context, "property", None)
        if found is None:
            return _common.refuse(self, Problem("there is no property under the mouse"))
        try:
            add_of_button(context.scene, *found)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        return {"FINISHED"}


class ParameterRemove(bpy.types.Operator):
    """Remove the parameter from the list; its value stays"""

    bl_idname = "edgegrad.parameter_remove"
    bl_label = "Remove Parameter"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        return len(context.scene.edgegrad.parameters) > 0

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


class SetUp(bpy.types.Operator):
    """Choose the parameters and the quality of a usual task"""

    bl_idname = "edgegrad.set_up"
    bl_label = "Set Up"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    task: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Task", items=tuple((name, one.label, one.use, one.icon, k)
                                 for k, (name, one) in enumerate(setups.SETUPS.items())))  # fmt: skip

    @classmethod
    def description(cls, context: Any, properties: Any) -> str:
        """Return the tip of the button of a task."""
        return setups.SETUPS[properties.task].use

    def execute(self, context: Any) -> set[str]:
        """Set the task up and say what was done."""
        try:
            said = setups.apply(context, self.task)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        STATUS.ended("; ".join(said))
        _common.say(self, "INFO", STATUS.said)
        return {"FINISHED"}


CLASSES: tuple[Any, ...] = (SetUp, ParametersAdd, ParameterAdd, ParameterRemove)

"""Set-ups for the usual tasks: each chooses the parameters and the quality of a fit at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from . import quality, rows
from .animated import gathering
from .animated.stored import add_row
from .problem import Problem, counted


@dataclass(frozen=True)
class Setup:
    """A set-up for one task.

    Attributes
    ----------
    label, use, icon
        For its button.
    add
        Adds the rows of the parameters; returns their keys (`_key`) with what was done, in words. Raises `Problem` for
        a scene without such things, before anything has changed.
    quality
        Name of the quality (`quality.QUALITIES`).
    """

    label: str
    use: str
    icon: str
    add: Callable[[Any], tuple[list[Any], str]]
    quality: str = "NORMAL"


def apply(context: Any, name: str) -> list[str]:
    """Set a task up; return sentences that say what was done.

    Rows of other parameters stay in the list, switched off.
    """
    setup, settings = SETUPS[name], context.scene.edgegrad
    kept, what = setup.add(context)
    off = 0
    for row in settings.parameters:
        wanted = _key(row) in kept
        off += row.enabled and not wanted
        row.enabled = wanted
    settings.active_parameter = next((k for k, row in enumerate(settings.parameters) if row.enabled), 0)
    one = quality.QUALITIES[setup.quality]
    quality.put(settings, list(quality.QUALITIES).index(setup.quality))
    said = [what, f"quality {one.label}: {one.iterations} iterations with {one.samples} samples"]
    if off:
        said.append(counted(off, "other parameter is switched off", "other parameters are switched off"))
    return said


def selected(context: Any, kind: str = "MESH") -> list[Any]:
    """Return the selected objects of a type, or else the active one."""
    found = [ob for ob in context.view_layer.objects if ob.select_get() and ob.type == kind]
    active = context.view_layer.objects.active
    return found or [ob for ob in (active,) if ob is not None and ob.type == kind]


def materials_of(objects: list[Any]) -> list[Any]:
    """Return the materials of objects, each once."""
    slots = [slot.material for ob in objects for slot in ob.material_slots if slot.material is not None]
    return list(dict.fromkeys(slots))


def images_of(materials: list[Any]) -> list[Any]:
    """Return the images that the nodes of materials show, each once."""
    images: dict[Any, None] = {}
    trees = [one.node_tree for one in materials if one.node_tree is not None]
    while trees:
        for node in trees.pop(0).nodes:
            if node.type == "GROUP" and node.node_tree is not None:
                trees.append(node.node_tree)
            elif node.type == "TEX_IMAGE" and node.image is not None:
                images[node.image] = None
    return list(images)


def fed(material: Any, name: str) -> bool:
    """Whether an input of a material's shader is linked to another node, so that it is not one value."""
    tree = material.node_tree
    shaders = [] if tree is None else [node for node in tree.nodes if name in node.inputs and node.type != "MIX_SHADER"]
    return bool(shaders) and all(node.inputs[name].is_linked for node in shaders)


def _key(row: Any) -> tuple[Any, ...]:
    """What a row is about. The row itself must not be kept: Blender moves rows when another one is added."""
    return row.kind, row.owner, row.path, row.index


def _camera(context: Any) -> tuple[list[Any], str]:
    scene = context.scene
    cameras = list(dict.fromkeys(row.camera for row in scene.edgegrad.targets if row.camera)) or [scene.camera]
    if cameras[0] is None:
        raise Problem(f"scene '{scene.name}': has no camera; add one and make it active")
    wanted = [(ob, path) for ob in cameras for path in ("location", gathering.rotation_of(ob))]
    wanted += [(ob.data, "lens" if ob.data.type == "PERSP" else "ortho_scale") for ob in cameras
               if ob.data.type in ("PERSP", "ORTHO")]  # fmt: skip
    found = _settable(scene, wanted)
    return found, f"place, rotation and lens of {_listed(cameras)} may move"


def _pose(context: Any) -> tuple[list[Any], str]:
    rigs = selected(context, "ARMATURE")
    if not rigs:
        rigs = [ob for ob in context.view_layer.objects if ob.type == "ARMATURE"]
    if not rigs:
        raise Problem(f"scene '{context.scene.name}': has no armature; select the object whose pose is to be found")
    wanted = []
    for rig in rigs:
        for bone in rig.pose.bones:
            if bone.parent is None:
                wanted += gathering.of_bones(rig, bone)
    found = _settable(context.scene, wanted)
    return found, f"{counted(len(found), 'property', 'properties')} of the bones of {_listed(rigs)} may move"


def _materials_and_lights(context: Any) -> tuple[list[Any], str]:
    scene = context.scene
    shown = [ob for ob in context.view_layer.objects if not ob.hide_render]
    materials = [one for one in materials_of(shown) if one.library is None and not fed(one, "Base Color")]
    lights = [ob for ob in shown if ob.type == "LIGHT" and ob.data.users == 1 and ob.data.library is None]
    found = [_kind(scene, "BASE_COLOR", one) for one in materials] + [_kind(scene, "POWER", ob) for ob in lights]
    if not found:
        raise Problem(f"scene '{scene.name}': has no material with one base color, and no light of its own; add one")
    return found, f"base colors of {_listed(materials)} and powers of {_listed(lights)} may change"


def _sculpt(context: Any) -> tuple[list[Any], str]:
    meshes = selected(context)
    if not meshes:
        raise Problem("no mesh is selected; select the object whose shape is to be found")
    count = sum(len(ob.data.vertices) for ob in meshes)
    return ([_kind(context.scene, "VERTICES", ob) for ob in meshes],
            f"{counted(count, 'vertex', 'vertices')} of {_listed(meshes)} may move")


def _kind(scene: Any, kind: str, owner: Any) -> Any:
    return _key(rows.add_kind(scene, kind, owner))


def _settable(scene: Any, wanted: list[tuple[Any, str]]) -> list[Any]:
    kept, refused = gathering.settable(wanted)
    if not kept:
        raise Problem(refused[0] if refused else "nothing can be fitted")
    return [_key(add_row(scene, places[0].owner, places[0].path, places[0].index if len(places) == 1 else -1))
            for places in kept]  # fmt: skip


def _listed(owners: list[Any]) -> str:
    names = [f"'{one.name}'" for one in owners]
    if len(names) > 3:
        return f"{', '.join(names[:2])} and {len(names) - 2} more"
    return ", ".join(names) or "nothing"


SETUPS = {
    "CAMERA": Setup("Match Camera", "Find place, rotation and lens of the targets' cameras", "CAMERA_DATA", _camera),
    "POSE": Setup("Match Pose", "Find the pose of an armature", "ARMATURE_DATA", _pose),
    "MATERIALS": Setup("Match Materials and Lights", "Find base colors of materials and powers of lights", "MATERIAL",
                       _materials_and_lights),
    "SCULPT": Setup("Sculpt to Pictures", "Find the shape of the selected meshes", "SCULPTMODE_HLT", _sculpt),
}  # fmt: skip

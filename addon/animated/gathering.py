"""All properties of an object, a material, a light, a camera, a world or a chain of bones that may move a picture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ..problem import Problem
from . import data_path, refusals
from .data_path import Place

# Lattices and curves with more points have no list of all of them.
MOST_POINTS = 64
_LIGHT = ("energy", "color", "size", "size_y", "shadow_soft_size", "angle", "spread", "spot_size", "spot_blend",
          "exposure", "temperature")  # fmt: skip
_CAMERA = ("lens", "ortho_scale", "shift_x", "shift_y", "fisheye_fov", "fisheye_lens", "dof.focus_distance",
           "dof.aperture_fstop")  # fmt: skip
_CURVE = ("bevel_depth", "extrude", "offset")
# Values of modifiers that choose or limit, and do not move what is exported smoothly.
_NOT_SMOOTH = ("merge_threshold", "angle_limit", "threshold", "strength_preview", "tolerance", "debug_options")


def of_object(ob: Any) -> list[tuple[Any, str]]:
    """Return datablock and path of the properties of an object, its data, its modifiers and its shape keys."""
    found = [(ob, path) for path in ("location", rotation_of(ob), "scale")]
    found += [(ob, f'["{bpy.utils.escape_identifier(key)}"]') for key in ob.keys()  # noqa: SIM118
              if isinstance(ob[key], float)]  # fmt: skip
    for modifier in ob.modifiers:
        found += [(ob, path) for path in _of_modifier(modifier)]
    for constraint in ob.constraints:
        found.append((ob, constraint.path_from_id("influence")))
    return found + of_data(ob.data)


def of_data(data: Any) -> list[tuple[Any, str]]:
    """Return the properties of an object's data."""
    if data is None:
        return []
    names: tuple[str, ...] = ()
    if isinstance(data, bpy.types.Light):
        names = _LIGHT
    elif isinstance(data, bpy.types.Camera):
        names = _CAMERA
    elif isinstance(data, bpy.types.Curve):
        names = _CURVE
    found = [(data, name) for name in names if data_path.resolved(data, name) is not None]
    if isinstance(data, bpy.types.Lattice) and len(data.points) <= MOST_POINTS:
        found += [(data, f"points[{k}].co_deform") for k in range(len(data.points))]
    keys = getattr(data, "shape_keys", None)
    if keys is not None:
        found += [(keys, key.path_from_id("value")) for key in keys.key_blocks if key != keys.reference_key]
    if isinstance(data, bpy.types.Light) and getattr(data, "node_tree", None) is not None:
        found += list(_of_tree(data, data.node_tree, "node_tree.", set()))
    return found


def of_nodes(owner: Any) -> list[tuple[Any, str]]:
    """Return the inputs of all nodes of a material or a world, also in its groups."""
    tree = owner.node_tree
    if tree is None:
        return [(owner, "diffuse_color")] if isinstance(owner, bpy.types.Material) else [(owner, "color")]
    return list(_of_tree(owner, tree, "node_tree.", set()))


def of_bones(rig: Any, first: Any) -> list[tuple[Any, str]]:
    """Return the rotations of a pose bone and all below it, and the locations of those that can move."""
    found = []
    for bone in (first, *first.children_recursive):
        found.append((rig, bone.path_from_id(rotation_of(bone))))
        if bone.parent is None or not bone.bone.use_connect:
            found.append((rig, bone.path_from_id("location")))
    return found


def rotation_of(posed: Any) -> str:
    """Name of the property by which an object or a bone is rotated."""
    if posed.rotation_mode == "QUATERNION":
        return "rotation_quaternion"
    return "rotation_axis_angle" if posed.rotation_mode == "AXIS_ANGLE" else "rotation_euler"


def settable(found: list[tuple[Any, str]]) -> tuple[list[list[Place]], list[str]]:
    """Return the places of each property that a fit can set, and a sentence on each of the others."""
    kept: list[list[Place]] = []
    refused: list[str] = []
    for owner, path in found:
        try:
            places = data_path.places(owner, path)
            for place in places:
                refusals.check(place)
        except Problem as problem:
            refused.append(str(problem))
        else:
            kept.append(places)
    return kept, refused


def _of_modifier(modifier: Any) -> Iterator[str]:
    group = getattr(modifier, "node_group", None)
    if modifier.type == "NODES" and group is not None:
        for item in group.interface.items_tree:
            if item.item_type == "SOCKET" and item.in_out == "INPUT" and item.socket_type in (
                    "NodeSocketFloat", "NodeSocketVector", "NodeSocketColor", "NodeSocketRotation"):  # fmt: skip
                yield f'{modifier.path_from_id()}["{item.identifier}"]'
        return
    for prop in modifier.bl_rna.properties:
        if prop.type == "FLOAT" and prop.is_animatable and not prop.is_readonly and prop.identifier not in _NOT_SMOOTH:
            yield str(modifier.path_from_id(prop.identifier))


def _of_tree(owner: Any, tree: Any, prefix: str, seen: set[str]) -> Iterator[tuple[Any, str]]:
    for node in tree.nodes:
        if node.mute or node.type in ("OUTPUT_MATERIAL", "OUTPUT_WORLD", "OUTPUT_LIGHT", "FRAME"):
            continue
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            if socket.is_linked or not socket.enabled or isinstance(value, (int, str, bool, type(None))):
                continue
            yield owner, prefix + socket.path_from_id("default_value")
        if node.type in ("VALUE", "RGB"):
            yield owner, prefix + node.outputs[0].path_from_id("default_value")
        if node.type == "GROUP" and node.node_tree is not None and node.node_tree.name not in seen:
            seen.add(node.node_tree.name)
            yield from _of_tree(node.node_tree, node.node_tree, "", seen)

"""Export of the world: a colour, an environment image, or a request to bake its nodes to an image."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e

from ..problem import Report
from . import nodes
from .expressions import Reader, Unreadable, constant, folded, rgb
from .images import Images
from .visibility import RAYS


@dataclass
class WorldReading:
    """The exported world, and the sun lights of its sky textures.

    Attributes
    ----------
    baked
        Whether the nodes of the world must be baked.
    """

    value: edgegrad.World
    suns: dict[str, edgegrad.SunLight] = field(default_factory=dict)
    baked: bool = False


def read_world(scene: Any, images: Images, report: Report) -> WorldReading:
    """Read the world of Blender's scene."""
    world = scene.world
    if scene.render.film_transparent:
        report.warn(f"scene '{scene.name}'", "its film is transparent, but the world is rendered as background")
    if world is None:
        return WorldReading(edgegrad.World())
    tree = world.node_tree
    if tree is None or (bpy.app.version < (5, 0, 0) and not world.use_nodes):
        return WorldReading(edgegrad.World(np.array(world.color, np.float64), visible_to=_visible_to(world)))
    output = tree.get_output_node("CYCLES")
    surface = None if output is None else nodes.feed(output.inputs["Surface"])
    if surface is None or surface.output is None:
        return WorldReading(edgegrad.World())
    if nodes.source(output.inputs["Volume"]) is not None:
        report.warn(f"world '{world.name}'", "its volume is left out")
    value = _background(surface, images, f"world '{world.name}'", report)
    if value is None:
        return WorldReading(edgegrad.World(visible_to=_visible_to(world)), baked=True)
    value.visible_to = _visible_to(world)
    return WorldReading(value)


def _visible_to(world: Any) -> frozenset[str]:
    flags = getattr(world, "cycles_visibility", None)
    return frozenset(ray for ray in RAYS if ray == "shadow" or getattr(flags, ray, True))


def _background(surface: nodes.Feed, images: Images, where: str, report: Report) -> edgegrad.World | None:
    """Read a Background node of constant strength with a constant colour or a rotated environment image, else None."""
    node, groups = surface.output.node, surface.groups
    if node.type not in ("BACKGROUND", "EMISSION"):
        return None
    strength = constant(node.inputs["Strength"], groups)
    if strength is None:
        return None
    if strength[0] < 0.0:
        report.warn(where, "negative light is treated as zero")
    try:
        color = folded(_Directions(images).value(node.inputs["Color"], groups))
    except Unreadable:
        return None
    found = rgb(color)
    out = edgegrad.World(strength=max(float(strength[0]), 0.0))
    if found is not None:
        if found.min() < 0.0:
            report.warn(where, "negative light is treated as zero")
        out.color = np.maximum(found, 0.0)
        return out
    return _with_image(out, color, where, report)


def _with_image(out: edgegrad.World, color: e.Operand, where: str, report: Report) -> edgegrad.World | None:
    if not isinstance(color, e.ImageTexture) or color.projection != "EQUIRECTANGULAR":
        return None
    rotation = _rotation(color.vector)
    if rotation is None:
        return None
    out.color, out.image, out.rotation = np.ones(3), color.image, rotation
    if color.interpolation == "CLOSEST":
        report.warn(where, "its image is interpolated linearly")
    return out


class _Directions(Reader):
    """Translates the nodes of a world, whose coordinates are the direction of the ray."""

    def __init__(self, images: Images) -> None:
        super().__init__(images, codes=False)

    def get_or(self, node: Any, identifier: str, groups: nodes.Groups, default: e.Operand | None) -> Any:
        return super().get_or(node, identifier, groups, DIRECTION if node.type == "TEX_ENVIRONMENT" else default)

    def _read(self, output: Any, groups: nodes.Groups) -> e.Operand:
        node = output.node
        if node.type == "TEX_COORD" and output.identifier in ("Generated", "Object") and node.object is None:
            return DIRECTION
        if node.type == "NEW_GEOMETRY" and output.identifier == "Position":
            return DIRECTION
        return super()._read(output, groups)


DIRECTION = e.Attribute("(direction)")


def _rotation(vector: e.Operand) -> NDArray[np.float64] | None:
    """(3, 3) rotation by a chain of Mapping nodes; None if the vector is not a rotated direction of the ray."""
    out = np.eye(3)
    while isinstance(vector, e.Transform):
        matrix = np.array(vector.matrix)
        linear = matrix[:, :3]
        scale = np.cbrt(abs(np.linalg.det(linear)))
        if np.abs(matrix[:, 3]).max() > 1e-9 or scale < 1e-9:
            return None
        out = out @ (linear / scale)
        vector = vector.vector
    is_rotation = np.allclose(out @ out.T, np.eye(3), atol=1e-5)
    return out if vector == DIRECTION and is_rotation else None

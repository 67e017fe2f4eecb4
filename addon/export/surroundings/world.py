"""Export of the world: a colour, an environment image, or a request to bake its nodes to an image.

Nodes may make the world different for different kinds of rays (*Is Camera Ray*). The scene has one environment; what
other kinds of rays see, if it is of one colour, is two suns that each fill half of the sphere. An image that the camera
alone sees is a sphere around the scene (`backdrop`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e

from ...problem import Report
from ..approximated.volumes import describe_volume, read_volume
from ..geometry.visibility import RAYS
from ..materials.shaders import Part, parts
from ..nodes import links as nodes
from ..nodes.expressions import Unreadable, folded, number, rgb
from ..nodes.images import Images
from ..nodes.ray_kinds import LIGHT_PATHS, RayReader

BACKDROP = "(world) seen by {} rays"


@dataclass
class WorldReading:
    """The exported world, and the suns of its sky textures and of what only some kinds of rays see.

    Attributes
    ----------
    baked
        Whether the nodes of the world must be baked, as rays of the kind `seen_by` see it.
    backdrop
        What the camera sees instead, if that is an image.
    """

    value: edgegrad.World
    world: Any = None
    suns: dict[str, edgegrad.SunLight] = field(default_factory=dict)
    baked: bool = False
    seen_by: str = "diffuse"
    backdrop: WorldReading | None = None


def read_world(scene: Any, depsgraph: Any, images: Images, report: Report) -> WorldReading:
    """Read the world that the evaluated view layer of Blender's scene shows."""
    world = getattr(depsgraph.view_layer, "world_override", None) or scene.world
    if world is None or not depsgraph.view_layer.use_sky:
        return WorldReading(edgegrad.World())
    world = world.evaluated_get(depsgraph)
    flags = getattr(world, "cycles_visibility", None)
    kinds = frozenset(ray for ray in RAYS if ray == "shadow" or getattr(flags, ray, True))
    if scene.render.film_transparent:
        kinds -= {"camera"}
    tree = world.node_tree
    if tree is None or (bpy.app.version < (5, 0, 0) and not world.use_nodes):
        return WorldReading(edgegrad.World(np.array(world.color, np.float64), visible_to=kinds))
    output = tree.get_output_node("CYCLES")
    where = f"world '{world.name}'"
    medium = None if output is None else _medium(nodes.feed(output.inputs["Volume"]), where, report)
    surface = None if output is None else nodes.feed(output.inputs["Surface"])
    if surface is None or surface.output is None:
        return WorldReading(edgegrad.World(medium=medium))
    linked = [socket.identifier for node in nodes.reached(tree) if node.type == "LIGHT_PATH"
              for socket in node.outputs if socket.is_linked]  # fmt: skip
    alike: dict[tuple[float, ...], list[str]] = {}
    for kind, path in LIGHT_PATHS.items():
        if kind in kinds:
            alike.setdefault(tuple(path.get(name, 0.0) for name in linked), []).append(kind)
    out = _merged([(names, _seen(world, surface, names[0], images, where, report)) for names in alike.values()],
                  where, report)  # fmt: skip
    out.value = replace(out.value, medium=medium)
    return out


def _medium(volume: nodes.Feed, where: str, report: Report) -> edgegrad.Medium | None:
    """Read the world's volume, which has no end: it hides the background and suns."""
    if volume.output is None:
        return None
    found = read_volume(volume)
    if found is None:
        report.warn(where, f"{describe_volume(volume)}; in Cycles, it has no end, so that it hides the "
                           "background and suns, and dims all other light")  # fmt: skip
    for text in () if found is None else found.remarks:
        report.warn(where, text)
    return None if found is None else found.medium


def _seen(world: Any, surface: nodes.Feed, kind: str, images: Images, where: str, report: Report) -> WorldReading:
    """Read the world as rays of one kind see it."""
    reader = _Directions(images, LIGHT_PATHS[kind])
    value = _background(reader, surface, where, report)
    for text in (*reader.approximations, *(reader.notes if value is not None else ())):
        report.warn(where, text)
    if value is None:
        return WorldReading(edgegrad.World(), world.original, baked=True, seen_by=kind)
    return WorldReading(value, world.original, seen_by=kind)


def _merged(readings: list[tuple[list[str], WorldReading]], where: str, report: Report) -> WorldReading:
    """Merge what kinds of rays see into an environment and suns that fill the sphere."""
    groups: list[tuple[list[str], WorldReading]] = []
    for names, reading in readings:
        equal = next((kinds for kinds, other in groups if _same(other, reading)), None)
        if equal is None:
            groups.append((names, reading))
        else:
            equal += names
    if not groups:
        return WorldReading(edgegrad.World())
    varied = [(kinds, one) for kinds, one in groups if not _has_one_color(one)]
    # Light at surfaces is sampled best from the environment.
    kinds, out = next((group for group in (varied or groups) if "diffuse" in group[0]), (varied or groups)[0])
    seen = set(kinds)
    for others, one in groups:
        if one is not out and _has_one_color(one):
            _add_backdrop(out, one.value, others)
        elif one is not out and others == ["camera"]:
            out.backdrop = one
        elif one is not out:
            seen.update(others)
            report.warn(where, f"{', '.join(others)} rays see it as {out.seen_by} rays do: its nodes show them "
                        "different images, and one environment is rendered")  # fmt: skip
    if len([kinds for kinds, _ in groups if kinds != ["camera"]]) > 1:
        report.warn(where, "its nodes show diffuse, glossy and transmission rays different light; in Cycles, a part of "
                    "the light that surfaces receive is of no such kind")  # fmt: skip
    out.value.visible_to = frozenset(seen | {"shadow"})
    return out


def _has_one_color(reading: WorldReading) -> bool:
    return not reading.baked and reading.value.image is None


def _same(a: WorldReading, b: WorldReading) -> bool:
    if a.baked or b.baked:
        return False
    one, other = a.value, b.value
    return one.image == other.image and all(
        np.allclose(x, y) for x, y in ((one.color * one.strength, other.color * other.strength),
                                       (one.rotation, other.rotation)))  # fmt: skip


def _add_backdrop(out: WorldReading, seen: edgegrad.World, kinds: list[str]) -> None:
    color = seen.color * seen.strength
    if not color.any():
        return
    strength = float(color.max())
    for k, axis in enumerate((1.0, -1.0)):
        key = " ".join([BACKDROP.format(", ".join(kinds)), str(k + 1)])
        # The irradiance by a hemisphere of constant radiance is pi times the radiance.
        out.suns[key] = edgegrad.SunLight(np.array([0.0, 0.0, axis]), np.pi * strength, np.pi, color=color / strength,
                                          visible_to=frozenset((*kinds, "shadow")), casts_shadow=True)  # fmt: skip


def _background(reader: _Directions, surface: nodes.Feed, where: str, report: Report) -> edgegrad.World | None:
    """Read a constant colour, or one Background node with a rotated environment image; else None."""
    found = list(parts(reader, surface))
    if reader.notes:  # a factor that can't be read
        return None
    read = [_part(reader, part) for part in found]
    if any(one is None for one in read) or (len(read) > 1 and any(one.image is not None for one in read if one)):
        return None
    if any(one.strength < 0.0 or one.color.min() < 0.0 for one in read if one):
        report.warn(where, "negative light is treated as zero")
    if len(read) == 1 and read[0] is not None:
        out = read[0]
        if out.image is not None and out.image in reader.closest:
            report.warn(where, "its image is interpolated linearly")
        return replace(out, color=np.maximum(out.color, 0.0), strength=max(out.strength, 0.0))
    colors = [np.maximum(one.color * one.strength, 0.0) for one in read if one]
    return edgegrad.World(np.sum([np.zeros(3), *colors], axis=0))


def _part(reader: _Directions, part: Part) -> edgegrad.World | None:
    """Read a Background node of constant weight and strength; other shaders emit nothing. None: it must be baked."""
    weight = number(part.weight)
    if weight is None:
        return None
    if part.node.type not in ("BACKGROUND", "EMISSION"):
        return edgegrad.World()
    try:
        strength = number(folded(reader.value(part.node.inputs["Strength"], part.groups)))
        color = folded(reader.value(part.node.inputs["Color"], part.groups))
    except Unreadable:
        return None
    if strength is None:
        return None
    found = rgb(color)
    if found is not None:
        return edgegrad.World(found, strength * weight)
    return _with_image(reader, color, strength * weight)


def _with_image(reader: _Directions, color: e.Operand, strength: float) -> edgegrad.World | None:
    if not isinstance(color, e.ImageTexture) or color.projection != "EQUIRECTANGULAR":
        return None
    rotation = _rotation(color.vector)
    if rotation is None:
        return None
    if color.interpolation == "CLOSEST":
        reader.closest.add(color.image)
    return edgegrad.World(np.ones(3), strength, color.image, rotation)


class _Directions(RayReader):
    """Translates the nodes of a world, whose coordinates are the direction of the ray.

    Attributes
    ----------
    closest
        Names of the images that are not interpolated.
    """

    def __init__(self, images: Images, path: Any) -> None:
        super().__init__(images, path)
        self.closest: set[str] = set()
        self.codes = False

    def get_or(self, node: Any, identifier: str, groups: nodes.Groups, default: e.Operand | None) -> Any:
        return super().get_or(node, identifier, groups, DIRECTION if node.type == "TEX_ENVIRONMENT" else default)

    def _read(self, output: Any, groups: nodes.Groups) -> e.Operand:
        node = output.node
        if node.type == "TEX_COORD" and output.identifier in ("Generated", "Object") and node.object is None:
            return (0.0, 0.0, 0.0) if node.from_instancer and output.identifier == "Generated" else DIRECTION
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

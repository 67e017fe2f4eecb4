"""Translation of nodes that bend normals, and of displacement, which is rendered as bump."""

from __future__ import annotations

from typing import Any

import bpy

from edgegrad import expression as e
from edgegrad.expression import Expression, Operand, nodes_of, replaced

from ..geometry import attributes
from .expressions import Reader, Unreadable, UnreadableNormal, folded, number, reads
from .links import Feed, Groups, by_identifier, feed, label, upstream
from .object_space import to_object

# Distance of the points at which heights are evaluated, in pixels: Cycles' for displacement, and for all bumps where
# the node has no setting, as before Blender 4.4.
FILTER_WIDTH = 0.1 if bpy.app.version >= (4, 4, 0) else 1.0


def _step(reader: Reader, width: Operand) -> Operand:
    pixel = 1e-3 if reader.view is None else reader.view.pixel_size
    return folded(e.Math("MULTIPLY", e.Math("MAXIMUM", width, 1e-3), pixel))


@reads("BUMP")
def _bump(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    normal = reader.get_or(node, "Normal", groups, e.Coordinates("NORMAL"))
    found = feed(by_identifier(node.inputs, "Height"), groups)
    if found.output is None:
        return normal
    height, strength = reader.get(node, "Height", groups), reader.get(node, "Strength", groups)
    if number(folded(height)) is not None:
        return normal
    if number(folded(strength)) == 0.0:
        return normal if normal == e.Coordinates("NORMAL") else e.VectorMath("NORMALIZE", normal)
    before = [found.output.node, *(one.node for one, _ in upstream(found.output.node, found.groups))]
    for one in dict.fromkeys(one for one in before if one.type == "WIREFRAME"):
        reader.note(f"the edges of the lines of node '{label(one)}' are steps of another slope in the height of node "
                    f"'{label(node, groups)}' than in Cycles, which divides it by the size of a pixel")  # fmt: skip
    wide = by_identifier(node.inputs, "Filter Width")
    width: Operand = FILTER_WIDTH if wide is None else reader.value(wide, groups)
    return e.Bump(height, strength, reader.get(node, "Distance", groups), _step(reader, width), normal, node.invert)


@reads("NORMAL_MAP")
def _normal_map(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if node.space in ("OBJECT", "BLENDER_OBJECT"):
        raise UnreadableNormal(f"node '{label(node, groups)}' (a normal map in object space)")
    color, strength = reader.get(node, "Color", groups), reader.get(node, "Strength", groups)
    if node.space == "TANGENT":
        return e.NormalMap(color, strength, node.uv_map or attributes.ACTIVE_UV)
    # Blender's baked normals point to the other side in y and z.
    flip = -1.0 if node.space == "BLENDER_WORLD" else 1.0
    given = e.VectorMath("MULTIPLY_ADD", color, (2.0, 2.0 * flip, 2.0 * flip), (-1.0, -flip, -flip))
    front = e.Math("MULTIPLY_ADD", e.Backfacing(), -2.0, 1.0)
    facing = e.VectorMath("SCALE", e.VectorMath("NORMALIZE", given), scale=front)
    mixed = e.Mix(e.Math("MAXIMUM", strength, 0.0), e.Coordinates("NORMAL"), facing, clamp_factor=False)
    return e.VectorMath("NORMALIZE", mixed)


@reads("BEVEL")
def _bevel(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    raise UnreadableNormal(f"node '{label(node, groups)}' (rounded edges)")


def displaced_normal(reader: Reader, found: Feed, moved: bool) -> Expression | None:
    """Normal of a surface that is displaced by what is linked to the Displacement of the output; None: the smooth one.

    Cycles takes the part of the displacement along the smooth normal as the height of a bump.

    Parameters
    ----------
    moved
        Whether the displacement also moves vertices. Then the height is read at the place before displacement.

    Raises
    ------
    Unreadable
        If the displacement cannot be read.
    """
    if found.output is None:
        return None
    node = found.output.node
    if node.type == "DISPLACEMENT":
        height, scale = _displacement(reader, node, found.groups)
    elif node.type == "VECTOR_DISPLACEMENT":
        raise Unreadable(f"node '{label(node, found.groups)}' (vector displacement)")
    else:
        vector = reader.output(found.output, found.groups)
        height, scale = e.VectorMath("DOT_PRODUCT", vector, e.Coordinates("NORMAL")), 1.0
    if number(folded(height)) is not None:
        return None
    step = _step(reader, FILTER_WIDTH)
    if not moved:
        return e.Bump(height, 1.0, scale, step, None)
    before = attributes.layer(attributes.BEFORE)
    own = attributes.layer(attributes.OBJECT)
    place = e.DisplacedPosition(before, own)
    there = replaced(e.Math("MULTIPLY", height, scale), lambda node: place if node == own else node)
    if any(node == e.Coordinates("POSITION") for node in nodes_of(there)):
        reader.note("the bump beside its displacement reads the position after displacement; Cycles reads that before, "
                    "which differs a little")  # fmt: skip
    return e.DisplacedBump(there, step, before, own, attributes.layer(attributes.SIDE))


def _displacement(reader: Reader, node: Any, groups: Groups) -> tuple[Operand, Operand]:
    """Height and factor of a Displacement node; its midlevel has no slope unless it varies."""
    height, middle = reader.get(node, "Height", groups), reader.get(node, "Midlevel", groups)
    scale = reader.get(node, "Scale", groups)
    height = e.Math("MULTIPLY", e.Math("SUBTRACT", height, middle), scale)
    if node.space == "OBJECT":
        # Metres of the object's own space. Under a non-uniform scale, a step along the unit normal there goes by
        # |M^T n| along the normal n in the world, where M is the object's matrix.
        return height, (e.VectorMath("LENGTH", to_object(e.Coordinates("NORMAL"), "NORMAL")) if reader.stretched
                        else attributes.layer(attributes.SCALE))  # fmt: skip
    return height, 1.0

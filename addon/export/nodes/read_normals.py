"""Translation of nodes that bend normals."""

from __future__ import annotations

from typing import Any

import bpy

from edgegrad import expression as e
from edgegrad.expression import Operand

from ..geometry import attributes
from .expressions import Reader, UnreadableNormal, folded, number, reads
from .links import Groups, by_identifier, feed, label, upstream

# Distance of the points at which heights are evaluated, in pixels: Cycles' for displacement, and for all bumps where
# the node has no setting, as before Blender 4.4.
FILTER_WIDTH = 0.1 if bpy.app.version >= (4, 4, 0) else 1.0


def bump_step(reader: Reader, width: Operand) -> Operand:
    """Distance, in metres, of the points at which a bump takes its heights, from Blender's filter width."""
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
    return e.Bump(height, strength, reader.get(node, "Distance", groups), bump_step(reader, width), normal, node.invert)


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

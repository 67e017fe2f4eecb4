"""Translation of tangents that nodes read as vectors: along a UV map, or around an axis of the object."""

from __future__ import annotations

from typing import Any

from edgegrad import expression as e
from edgegrad.expression import Expression, Operand

from ..geometry import attributes
from .expressions import Reader, reads
from .links import Groups
from .object_space import from_object


@reads("TANGENT")
def _tangent(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if node.direction_type == "RADIAL":
        return tangent_around(node.axis)
    return _in_surface(attributes.layer(attributes.ALONG + (node.uv_map or attributes.ACTIVE_UV)))


def tangent_around(axis: str) -> Expression:
    """Tangent around an axis ("X", "Y" or "Z") through the middle of the object's texture space."""
    return _in_surface(attributes.layer(attributes.ALONG + attributes.AROUND[axis]))


def _in_surface(direction: Operand) -> Expression:
    """Unit vector of the world, perpendicular to the smooth normal, along a direction in the object's space.

    Cycles turns tangents to the world as it turns normals.
    """
    normal = e.Coordinates("NORMAL")
    turned = e.VectorMath("NORMALIZE", from_object(direction, "NORMAL"))
    across = e.VectorMath("NORMALIZE", e.VectorMath("CROSS_PRODUCT", turned, normal))
    return e.AtHitPoint(e.VectorMath("CROSS_PRODUCT", normal, across))

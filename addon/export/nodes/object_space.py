"""Vectors, points and normals between an object's own space and the world."""

from __future__ import annotations

from edgegrad import expression as e
from edgegrad.expression import Operand

from ..geometry import attributes


def from_object(vector: Operand, kind: str) -> Operand:
    """Transform a vector, point or normal from the object's space to the world's."""
    axes = attributes.INVERSE_ROWS if kind == "NORMAL" else attributes.AXES
    out: Operand = attributes.layer(attributes.LOCATION) if kind == "POINT" else (0.0, 0.0, 0.0)
    for k, axis in enumerate(axes):
        out = e.VectorMath("ADD", out, e.VectorMath("SCALE", attributes.layer(axis), scale=e.Channel(vector, k)))
    return out


def to_object(vector: Operand, kind: str) -> Operand:
    """Transform a vector, point or normal from the world's space to the object's."""
    if kind == "POINT":
        vector = e.VectorMath("SUBTRACT", vector, attributes.layer(attributes.LOCATION))
    axes = attributes.AXES if kind == "NORMAL" else attributes.INVERSE_ROWS
    return e.Combine(*(e.VectorMath("DOT_PRODUCT", attributes.layer(axis), vector) for axis in axes))

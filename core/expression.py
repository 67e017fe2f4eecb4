"""Expressions: values that differ from point to point of a surface, as Blender's shader nodes compute them.

An expression is a tree of frozen dataclasses; a number, or a tuple of numbers, stands for a constant wherever
an expression may. Each has four components: a colour with alpha, a vector (x, y, z, 0), or one number
repeated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields


class Expression:
    """Base of all nodes."""


Operand = Expression | float | tuple[float, ...]


@dataclass(frozen=True)
class Attribute(Expression):
    """A mesh's attribute, interpolated: UV map, colour, any values; 0 where the mesh has none of that name."""

    name: str


@dataclass(frozen=True)
class ImageTexture(Expression):
    """An image of the scene at `vector` (x to the right, y upwards, [0, 1] is the image once).

    Attributes
    ----------
    image
        Name in `Scene.images`.
    interpolation
        ``"LINEAR"``, ``"CLOSEST"`` or ``"CUBIC"``.
    extension
        ``"REPEAT"``, ``"EXTEND"``, ``"CLIP"`` (transparent black outside) or ``"MIRROR"``.
    projection
        ``"FLAT"``, or ``"EQUIRECTANGULAR"`` (the vector is a direction).
    """

    image: str
    vector: Operand
    interpolation: str = "LINEAR"
    extension: str = "REPEAT"
    projection: str = "FLAT"


def operands(node: Expression) -> Iterator[Expression]:
    """The nodes that feed a node."""
    for f in fields(node):  # type: ignore[arg-type]
        value = getattr(node, f.name)
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, Expression):
                yield item


def images_of(node: Expression) -> set[str]:
    """Names of all images that an expression reads."""
    found = {node.image} if isinstance(node, ImageTexture) else set()
    return found.union(*(images_of(operand) for operand in operands(node)))

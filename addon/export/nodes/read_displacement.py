"""Translation of displacement: vectors in world space, and the bump that Cycles makes of them.

Vectors along the axes of the object are read from attributes, which have other names where vertices are moved than
where normals are bent: objects whose materials move vertices may share a mesh although each has its own axes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from edgegrad import expression as e
from edgegrad.expression import Attribute, Expression, Operand, nodes_of, replaced

from ..geometry import attributes
from .expressions import Reader, folded, number, reads, rgb
from .links import Feed, Groups
from .object_space import to_object
from .read_normals import FILTER_WIDTH, bump_step

# Columns of the object's matrix, where vertices are moved.
AXES = tuple(f"(displacement axis {k})" for k in range(3))
_NORMAL = e.Coordinates("NORMAL")


def _scaled(vector: Operand, factor: Operand) -> Expression:
    return e.VectorMath("MULTIPLY", vector, factor)


def _sum(axes: Iterable[Operand], vector: Operand) -> Expression:
    """Sum of three axes, each times a component of a vector."""
    x, y, z = (_scaled(axis, e.Channel(vector, k)) for k, axis in enumerate(axes))
    return e.VectorMath("ADD", e.VectorMath("ADD", x, y), z)


def _axes(reader: Reader) -> list[Attribute]:
    return [attributes.layer(axis) for axis in (AXES if reader.moves else attributes.AXES)]


def _own_normal(reader: Reader, normal: Operand) -> Expression:
    """A normal of the world in the object's space: Cycles multiplies by the transposed matrix, and normalises."""
    return e.VectorMath("NORMALIZE", e.Combine(*(e.VectorMath("DOT_PRODUCT", axis, normal) for axis in _axes(reader))))


def _amount(reader: Reader, node: Any, groups: Groups) -> tuple[Operand, Operand]:
    """Displacement along the normal, in the space of a Displacement node, and that normal in world space."""
    height, middle, scale = (reader.get(node, name, groups) for name in ("Height", "Midlevel", "Scale"))
    amount = e.Math("MULTIPLY", e.Math("SUBTRACT", height, middle), scale)
    normal = reader.get_or(node, "Normal", groups, _NORMAL)
    # Cycles copies the nodes to bend normals, and the copies forget constants.
    return amount, normal if reader.moves or rgb(folded(normal)) is None else _NORMAL


@reads("DISPLACEMENT")
def _displacement(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    amount, normal = _amount(reader, node, groups)
    return _scaled(normal if node.space == "WORLD" else _sum(_axes(reader), _own_normal(reader, normal)), amount)


@reads("VECTOR_DISPLACEMENT")
def _vector_displacement(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    vector, middle, scale = (reader.get(node, name, groups) for name in ("Vector", "Midlevel", "Scale"))
    moved = _scaled(e.VectorMath("SUBTRACT", vector, middle), scale)
    if node.space == "WORLD":
        return moved
    return _sum(_axes(reader), moved if node.space == "OBJECT" else _sum(_frame(reader), moved))


def _frame(reader: Reader) -> tuple[Operand, Operand, Operand]:
    """Tangent, normal and bitangent of the active UV map, in the object's space."""
    tangent = e.AtHitPoint(attributes.layer(attributes.ALONG + attributes.ACTIVE_UV))
    side = e.Channel(e.AtHitPoint(attributes.layer(attributes.ACTIVE_UV + attributes.TANGENT)), 3)
    normal = _own_normal(reader, _NORMAL)
    across = e.VectorMath("NORMALIZE", e.VectorMath("CROSS_PRODUCT", normal, tangent))
    return tangent, normal, _scaled(across, side)


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
    height, scale = _height(reader, found)
    if number(folded(height)) is not None:
        return None
    step = bump_step(reader, FILTER_WIDTH)
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


def _height(reader: Reader, found: Feed) -> tuple[Operand, Operand]:
    """Height of the displacement along the smooth normal, and its constant factor."""
    node = found.output.node
    amount, normal = _amount(reader, node, found.groups) if node.type == "DISPLACEMENT" else (0.0, None)
    if normal == _NORMAL:
        if node.space == "WORLD":
            return amount, 1.0
        # Metres of the object's own space. Under a non-uniform scale, a step along the unit normal there goes by
        # |M^T n| along the normal n in the world, where M is the object's matrix.
        return amount, (e.VectorMath("LENGTH", to_object(_NORMAL, "NORMAL")) if reader.stretched
                        else attributes.layer(attributes.SCALE))  # fmt: skip
    vector = reader.output(found.output, found.groups)
    if not isinstance(vector, Expression):
        return 0.0, 1.0  # a constant has no slope
    return e.VectorMath("DOT_PRODUCT", vector, _NORMAL), 1.0

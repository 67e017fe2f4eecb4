"""What the object of a bake does not have: values of the rendered object, its instancer and the view layer.

They are constants for a whole object, so that the copied materials of a bake get them as constants. Object Info,
Particle Info and Attribute nodes, and coordinates of the instancer, would be those of the bake's own object.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from edgegrad import expression as e
from edgegrad.expression import Expression, Operand, nodes_of, replaced

from ..geometry.attributes import is_of_object
from .expressions import Reader, Unreadable, folded
from .links import Groups, upstream

# Names of the groups around a node, its own name, and the identifier of one of its outputs.
Place = tuple[tuple[str, ...], str, str]
Constants = Mapping[Place, Operand]
Values = tuple[float, ...]

_NODES = ("OBJECT_INFO", "PARTICLE_INFO")
_KINDS = ("OBJECT", "INSTANCER", "VIEW_LAYER")  # of attributes


def _is_constant(output: Any) -> bool:
    node = output.node
    if node.type in ("TEX_COORD", "UVMAP"):
        return bool(node.from_instancer and output.identifier in ("Generated", "UV"))
    return node.type in _NODES or (node.type == "ATTRIBUTE" and node.attribute_type in _KINDS)


def constants_of(reader: Reader, output: Any, groups: Groups) -> dict[Place, Operand]:
    """Translate the constants that an output depends on; expressions may read attributes of the whole object."""
    found: dict[Place, Operand] = {}
    for one, around in [(output, groups), *upstream(output.node, groups)]:
        if not _is_constant(one):
            continue
        try:
            value = reader.output(one, around)
        except Unreadable:  # without a view
            continue
        found[tuple(group.name for group in around), one.node.name, one.identifier] = value
    return found


def attributes_of(constants: Constants) -> set[str]:
    """Return the names of the attributes that constants read."""
    return {node.name for value in constants.values() if isinstance(value, Expression)
            for node in nodes_of(value) if isinstance(node, e.Attribute)}  # fmt: skip


def on_object(constants: Constants, own: Mapping[str, Values]) -> dict[Place, Values]:
    """Evaluate constants for an object with these attributes; others are 0, as in Cycles."""
    out = {}
    for place, one in constants.items():
        given = folded(with_values(one, own.get))
        if not isinstance(given, Expression):
            out[place] = (float(given),) * 3 if not isinstance(given, tuple) else given
    return out


def with_values(value: Operand, own: Callable[[str], Values | None]) -> Operand:
    """Replace the attributes of a whole object by the values that it has; those that it does not have are 0."""

    def constant(node: Expression) -> Expression:
        if not isinstance(node, e.Attribute) or not is_of_object(node.name):
            return node
        found = own(node.name) or (0.0, 0.0, 0.0, 0.0)
        return e.Combine(*(found * 3 if len(found) == 1 else (*found, 0.0)[: max(len(found), 3)]))

    return replaced(value, constant) if isinstance(value, Expression) else value

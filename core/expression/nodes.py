"""Expressions: values that vary over a surface, computed like Blender's shader nodes.

An expression is a tree of frozen dataclasses, in which branches may be shared. A constant operand is a number, or a
tuple of three or four numbers. Each value has four components: a colour with alpha, a vector, or one repeated number.
An operand that should be a number uses the first component. Blender's implicit conversions are separate nodes here:
`Luminance` converts a colour to a number, `Average` a vector. Only `Attribute`, `ImageTexture`, `Ramp` and `Combine`
compute the fourth component (alpha); it is 1 for all other nodes.

Each node computes the same value as the node of the same name in Cycles (Blender 5.0). As there, division by zero and
roots and logarithms of negative numbers return 0.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator
from dataclasses import fields, replace
from functools import cache
from typing import Any, ClassVar

import numpy as np

from .._check import choice, flag, number, text, whole
from .._fields import Check, by, optional


def _operand(where: str, name: str, value: Any) -> Any:
    if isinstance(value, (Expression, bool, np.bool_)):
        return value
    if not isinstance(value, tuple):
        return number(where, f"operand {name}", value)
    if len(value) not in (3, 4):
        raise ValueError(f"{where}: operand {name} must be a number, a tuple of three or four, or an expression, "
                         f"not a tuple of {len(value)}")
    return tuple(number(where, f"operand {name}", one) for one in value)


# Check for each field type. Tables and matrices are checked when an expression is compiled
# (`tables.textures.lowering`).
_CHECKS: dict[str, Check] = {
    "Operand": _operand, "Operand | None": optional(_operand), "str": text, "bool": flag, "float": number,
    "int": by(whole, -(2**31), 2**31 - 1),
}


@cache
def _checked_fields(kind: Any) -> tuple[tuple[str, Check], ...]:
    return tuple((f.name, _CHECKS[str(f.type)]) for f in fields(kind) if f.type in _CHECKS)


class Expression:
    """Base class of all nodes."""

    # Maps a field to its allowed words.
    choices: ClassVar[dict[str, tuple[str, ...]]] = {}

    def __post_init__(self) -> None:
        where = f"expression {type(self).__name__}"
        kind: Any = type(self)
        for name, check in _checked_fields(kind):
            check(where, name, getattr(self, name))
        for name, among in self.choices.items():
            choice(where, name, getattr(self, name), among)


Operand = Expression | float | tuple[float, ...]
Row = tuple[float, float, float, float]


def operands(node: Expression) -> Iterator[Expression]:
    """Yield the direct operands of a node that are expressions."""
    for f in fields(node):  # type: ignore[arg-type]
        value = getattr(node, f.name)
        if isinstance(value, Expression):
            yield value


def nodes_of(node: Expression, but: Container[int] = ()) -> list[Expression]:
    """List a node and all nodes below it, each once, with operands before the nodes that use them.

    Parameters
    ----------
    but
        Ids (`id`) of nodes to leave out, together with nodes that only they use.

    Raises
    ------
    ValueError
        If the expression has a cycle.
    """
    # Nodes are compared by identity, and the traversal has its own stack: equality tests and recursion would fail on
    # trees that are deep or share branches many times.
    found: dict[int, Expression] = {}
    open_: set[int] = set()  # nodes between the root and the top of the stack
    stack: list[tuple[Expression, bool]] = [(node, False)]
    while stack:
        top, ready = stack.pop()
        key = id(top)
        if key in found or key in but:
            continue
        if ready:
            open_.discard(key)
            found[key] = top
            continue
        if key in open_:
            raise ValueError(f"expression {type(top).__name__} is a part of itself; expressions must not have cycles")
        open_.add(key)
        stack.append((top, True))
        stack.extend((operand, False) for operand in operands(top))
    return list(found.values())


def replaced(node: Expression, change: Callable[[Expression], Expression]) -> Expression:
    """A tree in which each node is `change` of the node with its changed operands; unchanged branches stay."""
    done: dict[int, Expression] = {}
    for one in nodes_of(node):
        changes: dict[str, Any] = {}
        for f in fields(one):  # type: ignore[arg-type]
            operand = getattr(one, f.name)
            if isinstance(operand, Expression) and done[id(operand)] is not operand:
                changes[f.name] = done[id(operand)]
        done[id(one)] = change(replace(one, **changes) if changes else one)  # type: ignore[type-var]
    return done[id(node)]

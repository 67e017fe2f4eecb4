"""The numbers in an expression as one vector: constants, the tables of ramps and curves, the matrices of transforms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .nodes import Expression, nodes_of, replaced

# Prefixes of the types of fields that may hold numbers. Integers and words are no parameters.
_NUMERIC = ("Operand", "float", "tuple")


def numbers(root: Expression) -> NDArray[np.float64]:
    """(n,) all numbers: nodes in the order of `nodes_of`, the fields of a node in the order of its class."""
    return np.array([x for node in nodes_of(root) for _, value in _own(node) for x in _flat(value)], np.float64)


def with_numbers(root: Expression, values: Iterable[float]) -> Expression:
    """Replace the numbers of an expression by `values`, in the order of `numbers`.

    Raises
    ------
    ValueError
        If there are more or fewer values than numbers in the expression.
    """
    supply = iter(values)

    def filled(node: Expression) -> Expression:
        changes = {name: _filled(value, supply) for name, value in _own(node)}
        return replace(node, **changes) if changes else node  # type: ignore[type-var]

    try:
        made = replaced(root, filled)
    except StopIteration:
        raise ValueError("expression: has more numbers than were given") from None
    if next(supply, None) is not None:
        raise ValueError("expression: has fewer numbers than were given")
    return made


def _own(node: Expression) -> Iterator[tuple[str, Any]]:
    """Yield the names and values of the fields of a node that hold numbers."""
    for f in fields(node):  # type: ignore[arg-type]
        value = getattr(node, f.name)
        if str(f.type).startswith(_NUMERIC) and value is not None and not isinstance(value, Expression):
            yield f.name, value


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, (tuple, list)):
        for item in value:
            yield from _flat(item)
    else:
        yield value


def _filled(value: Any, supply: Iterator[float]) -> Any:
    if isinstance(value, (tuple, list)):
        out = []
        for item in value:  # not a generator: it would turn StopIteration into RuntimeError
            out.append(_filled(item, supply))
        return tuple(out)
    return next(supply)

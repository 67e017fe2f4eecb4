"""The building block of all maps from a scene's parameters to its tables: rows that depend linearly on a tangent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Linear = Callable[[F64], F64]


@dataclass(frozen=True)
class Piece:
    """The derivative of some rows of one table with respect to one parameter, and its transpose.

    Attributes
    ----------
    table
        Name in `table_derivatives.shapes`.
    first, last
        The rows, `last` excluded.
    push
        Tangent of the parameter, of its shape, to the tangent of the rows.
    pull
        Gradient of the rows to that of the parameter.
    """

    table: str
    first: int
    last: int
    push: Linear
    pull: Linear

    def after(self, push: Linear, pull: Linear) -> Piece:
        """The same rows as they depend on what this piece's parameter depends on."""
        return replace(self, push=lambda v: self.push(push(v)), pull=lambda g: pull(self.pull(g)))


def same(table: str, first: int, last: int, shape: tuple[int, ...], parameter_shape: tuple[int, ...]) -> Piece:
    """Rows, of the given shape, that are the parameter itself."""
    return Piece(table, first, last, lambda v: v.reshape(shape), lambda g: g.reshape(parameter_shape))


def by_matrix(table: str, first: int, matrix: F64) -> list[Piece]:
    """Values from row `first` on, one a row, with the derivative (values, *parameter's shape); none if that is 0.

    Those at the ends that don't depend on the parameter are left out.
    """
    used = np.flatnonzero(matrix.reshape(len(matrix), -1).any(axis=1))
    if not len(used):
        return []
    low, high = int(used[0]), int(used[-1]) + 1
    matrix = matrix[low:high]
    return [Piece(
        table, first + low, first + high,
        lambda v: np.asarray(np.tensordot(matrix, v, v.ndim)),
        lambda g: np.asarray(np.tensordot(g, matrix, 1)),
    )]

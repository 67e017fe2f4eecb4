"""The derivative of some rows of a table with respect to one parameter, of which larger maps are composed."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Linear = Callable[[F64], F64]


class Piece(NamedTuple):
    """The derivative of some rows of one table with respect to one parameter, and its transpose.

    Attributes
    ----------
    table
        Name of the table (`table_derivatives.shapes`).
    first, last
        First row, and the row after the last one.
    push
        Maps a tangent of the parameter, which has its shape, to the tangent of the rows.
    pull
        Maps a gradient by the rows to the gradient by the parameter.
    """

    table: str
    first: int
    last: int
    push: Linear
    pull: Linear

    def after(self, push: Linear, pull: Linear) -> Piece:
        """Apply the chain rule: return the derivative by another parameter, on which this parameter depends."""
        return self._replace(push=lambda v: self.push(push(v)), pull=lambda g: pull(self.pull(g)))


def same(table: str, first: int, last: int, shape: tuple[int, ...], parameter_shape: tuple[int, ...]) -> Piece:
    """Return the identity: the rows, of the given shape, are the parameter itself."""
    return Piece(table, first, last, _reshaped(shape), _reshaped(parameter_shape))


@lru_cache(maxsize=256)  # very many parameters share few shapes
def _reshaped(shape: tuple[int, ...]) -> Linear:
    return lambda values: values.reshape(shape)


def by_matrix(table: str, first: int, matrix: F64) -> list[Piece]:
    """Return the piece of rows from `first` on whose Jacobian is `matrix`, (rows, *shape of the parameter).

    Rows at both ends that do not depend on the parameter are left out; if none depends on it, there is no piece.
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

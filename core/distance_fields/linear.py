"""Grids of values that are interpolated linearly along each axis, as attributes of fields are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


def sampled(grid: NDArray[np.floating], place: F64) -> NDArray[np.float32]:
    """(n, c) values of a grid (ax, ay, az, c) at places (n, 3) within the unit cube."""
    most = np.array(grid.shape[:3]) - 1
    at = np.clip(place, 0.0, 1.0) * most
    cell = np.clip(np.floor(at).astype(np.int64), 0, np.maximum(most - 1, 0))
    u = at - cell
    out = np.zeros((len(place), grid.shape[3]))
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(np.array(corner) == 1, u, 1.0 - u), axis=1)
        out += weight[:, None] * grid[tuple(np.minimum(cell + corner, most).T)]
    return out.astype(np.float32)


def axis_weights(count: int, place: F64) -> F64:
    """(n, count) weights of the values along one axis at places (n,) in [0, 1]."""
    at = place * (count - 1)
    cell = np.clip(np.floor(at).astype(np.int64), 0, max(count - 2, 0))
    out = np.zeros((len(place), count))
    rows = np.arange(len(place))
    out[rows, cell] = 1.0 - (at - cell)
    out[rows, np.minimum(cell + 1, count - 1)] += at - cell
    return out


def mapped(values: F64, maps: Sequence[F64]) -> F64:
    """Apply a matrix along each of the first axes."""
    for axis, matrix in enumerate(maps):
        values = np.moveaxis(np.tensordot(matrix, values, axes=(1, axis)), 0, axis)
    return np.ascontiguousarray(values)

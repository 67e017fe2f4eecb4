"""Preconditioned vertex positions: u = (I + lambda L) x (Nicolet, Jacobson & Jakob 2021).

An optimiser moves u instead of the positions x. A step in u is a step in x filtered twice by
(I + lambda L)^-1, which spreads what a few silhouette vertices feel over their neighbourhood and
leaves translations as they are, since L maps constants to 0.
"""

from __future__ import annotations

import numpy as np
from cholespy import CholeskySolverD, MatrixType
from numpy.typing import NDArray

from ..geometry import topology

F64 = NDArray[np.float64]

# Preconditioning: lambda per welded vertex, so that a disturbance spreads over the same part of a
# surface however finely it is divided (sqrt(lambda) edges, and edges get shorter by sqrt(vertices)).
SMOOTHNESS_PER_VERTEX = 1.0 / 100.0
SMOOTHNESS_RANGE = (1.0, 1000.0)
# Beyond, rounding in 1 + lambda L leaves nothing of the 1, without which the matrix has no inverse.
MOST_SMOOTHNESS = 1e9


class LargeSteps:
    """The maps between positions and preconditioned unknowns of one mesh.

    Vertices at one position (split at UV seams or normals) share one unknown: they are welded by
    `topology.weld`, so seams can't tear.

    Parameters
    ----------
    vertices
        (n, 3) positions that decide what is welded.
    faces
        (m, 3) vertex indices.
    smoothness
        lambda >= 0. A disturbance spreads over about sqrt(lambda) edges; 0 leaves only the welding.
        None: by the number of welded vertices.
    """

    def __init__(self, vertices: F64, faces: NDArray[np.integer], smoothness: float | None) -> None:
        if smoothness is not None and not (np.isfinite(smoothness) and smoothness >= 0.0):
            raise ValueError(f"LargeSteps: smoothness must be finite and not below 0, not {smoothness!r}")
        self.label = topology.weld(np.asarray(vertices, np.float64))
        self.count = int(self.label.max(initial=-1)) + 1  # welded vertices
        self.copies = np.bincount(self.label, minlength=self.count).astype(np.float64)[:, None]
        low, high = SMOOTHNESS_RANGE
        automatic = min(max(SMOOTHNESS_PER_VERTEX * self.count, low), high)
        self.smoothness = automatic if smoothness is None else float(smoothness)
        self.row, self.column = _neighbours(self.label[np.asarray(faces, np.int64)], self.count)
        self.degree = np.bincount(self.row, minlength=self.count).astype(np.float64)
        self._solver = None if self.smoothness == 0.0 else self._factor()

    def unknowns(self, vertices: F64) -> F64:
        """u = (I + lambda L) x: (k, 3) unknowns of (n, 3) positions; k welded vertices."""
        x = self._gather(vertices) / self.copies
        neighbours = np.stack([
            np.bincount(self.row, x[self.column, axis], minlength=self.count) for axis in range(3)
        ], axis=1)
        return x + self.smoothness * (self.degree[:, None] * x - neighbours)

    def vertices(self, unknowns: F64) -> F64:
        """(n, 3) positions x = (I + lambda L)^-1 u of (k, 3) unknowns; all copies of one vertex equal."""
        return np.ascontiguousarray(self._solve(unknowns)[self.label])

    def gradient(self, vertex_gradient: F64) -> F64:
        """(k, 3) gradient of the unknowns from the (n, 3) one of the positions: the transpose of `vertices`."""
        return self._solve(self._gather(vertex_gradient))

    def _gather(self, rows: F64) -> F64:
        """Sum over the copies of each welded vertex: the transpose of spreading by `label`."""
        return np.stack([np.bincount(self.label, rows[:, axis], minlength=self.count) for axis in range(3)], axis=1)

    def _factor(self) -> CholeskySolverD:
        """Sparse Cholesky factor of the symmetric positive definite I + lambda L, L = degree - adjacency."""
        diagonal = np.arange(self.count)
        row = np.concatenate([diagonal, self.row]).astype(np.int32)
        column = np.concatenate([diagonal, self.column]).astype(np.int32)
        value = np.concatenate([1.0 + self.smoothness * self.degree, np.full(len(self.row), -self.smoothness)])
        return CholeskySolverD(self.count, row, column, value, MatrixType.COO)

    def _solve(self, right: F64) -> F64:
        if self._solver is None:
            return np.array(right, np.float64)
        out = np.zeros((self.count, 3))
        self._solver.solve(np.ascontiguousarray(right, np.float64), out)
        return out


def _neighbours(faces: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of the adjacency matrix: every pair of different vertices joined by an edge, both ways."""
    start, end = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    apart = start != end
    start, end = start[apart], end[apart]
    key = np.unique(np.concatenate([start * count + end, end * count + start]))
    return key // count, key % count

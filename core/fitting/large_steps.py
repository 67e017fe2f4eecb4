"""Preconditioned vertex positions: u = (I + lambda L) x (Nicolet, Jacobson & Jakob 2021).

Boundary terms give gradients at the few vertices of a silhouette. Plain gradient steps would move these alone and
crumple the surface. Therefore the optimiser moves u instead of the positions x, with L the graph Laplacian of the mesh.
A step in u equals a step in x that is filtered twice by (I + lambda L)^-1: the filter spreads the gradient of a vertex
over its neighbourhood. It leaves translations unchanged, since L maps constants to 0.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from cholespy import CholeskySolverD, MatrixType
from numpy.typing import NDArray

from ..geometry import topology
from ..geometry.labels import summed

F64 = NDArray[np.float64]

# Default lambda per welded vertex. A local gradient spreads over about sqrt(lambda) edges, and the length of an edge is
# proportional to 1 / sqrt(vertices): so it spreads over the same distance at any resolution of the mesh. A larger value
# gives smoother, slower changes of shape.
SMOOTHNESS_PER_VERTEX = 1.0 / 250.0
SMOOTHNESS_RANGE = (1.0, 1000.0)
# For larger lambda, I is lost in the rounding of I + lambda L, and L alone is singular.
MOST_SMOOTHNESS = 1e9


class LargeSteps:
    """Maps between the vertex positions of one mesh and the preconditioned unknowns u.

    Coincident vertices (split at UV seams or sharp edges) share one unknown, so a seam cannot tear: `topology.weld`
    welds them.

    Parameters
    ----------
    vertices
        (n, 3) positions; coincident ones are welded.
    faces
        (m, 3) vertex indices.
    smoothness
        lambda >= 0. The gradient of a vertex spreads over about sqrt(lambda) edges; 0: welding only. None: chosen
        from the number of welded vertices.
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

    def with_smoothness(self, smoothness: float) -> LargeSteps:
        """Return the same for another smoothness."""
        out = copy(self)
        out.smoothness = smoothness
        out._solver = None if smoothness == 0.0 else out._factor()
        return out

    def unknowns(self, vertices: F64) -> F64:
        """Return the (k, 3) unknowns u = (I + lambda L) x of (n, 3) positions, for k welded vertices."""
        x = self._gather(vertices) / self.copies
        return x + self.smoothness * (self.degree[:, None] * x - self._sum_of_neighbours(x))

    def middle_of_neighbours(self, vertices: F64) -> F64:
        """Return the (n, 3) means of the positions of each vertex's neighbours; without any, the vertex itself."""
        x = self._gather(vertices) / self.copies
        lonely = self.degree == 0.0
        mean = self._sum_of_neighbours(x) / np.where(lonely, 1.0, self.degree)[:, None]
        return np.asarray(np.where(lonely[:, None], x, mean)[self.label])

    def _sum_of_neighbours(self, x: F64) -> F64:
        return np.stack([
            np.bincount(self.row, x[self.column, axis], minlength=self.count) for axis in range(3)
        ], axis=1)

    def vertices(self, unknowns: F64) -> F64:
        """Return the (n, 3) positions x = (I + lambda L)^-1 u of (k, 3) unknowns; copies of a vertex are equal."""
        return np.ascontiguousarray(self._solve(unknowns)[self.label])

    def gradient(self, vertex_gradient: F64) -> F64:
        """Return the (k, 3) gradient by u from the (n, 3) gradient by the positions: the transpose of `vertices`."""
        return self._solve(self._gather(vertex_gradient))

    def _gather(self, rows: F64) -> F64:
        """Sum over the copies of each welded vertex: the transpose of indexing by `label`."""
        return summed(self.label, rows, self.count)

    def _factor(self) -> CholeskySolverD:
        """Factorise the symmetric positive definite I + lambda L, with L = degree - adjacency, by sparse Cholesky."""
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
    """Rows and columns of the adjacency matrix: each pair of vertices with a common edge, in both orders."""
    start, end = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    apart = start != end
    start, end = start[apart], end[apart]
    key = np.unique(np.concatenate([start * count + end, end * count + start]))
    return key // count, key % count

"""Control vertices and the mesh that they move, as under Subdivision: steps that do not fold this mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...geometry import topology
from ...geometry.labels import summed
from .fold_guard import FoldGuard, with_neighbours

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

# A control vertex counts as one that moves a vertex most if its weight there is at least this part of the largest one.
STRONG = 0.5


class Cage:
    """The map from control vertices to a rendered mesh, which `FoldGuard` keeps clean.

    If other variables pose the mesh as well, it is tested in the pose of the start.

    Parameters
    ----------
    vertices, faces
        (n, 3) control vertices at the start, and (m, 3) triangles between them.
    surface, surface_faces
        (r, 3) rendered vertices at the start, and the triangles between these.
    rows, columns, blocks
        Entries of the map: rendered vertex `row` moves by the (3, 3) matrix `block` times the move of `column`.
    """

    def __init__(self, vertices: F64, faces: NDArray[np.integer], surface: F64, surface_faces: NDArray[np.integer],
                 rows: I64, columns: I64, blocks: F64) -> None:  # fmt: skip
        label = topology.weld(surface)
        first = topology.first_of_labels(label)
        self._guard = FoldGuard(surface, surface_faces, label)
        self._vertices, self._surface = vertices, surface[first]
        used = first[label[rows]] == rows  # one copy of each welded vertex
        self._rows, self._columns, self._blocks = label[rows[used]], columns[used], blocks[used]
        weight = np.linalg.norm(self._blocks, axis=(1, 2))
        largest = np.zeros(len(first))
        np.maximum.at(largest, self._rows, weight)
        self._strong = weight >= STRONG * largest[self._rows]
        corners = np.asarray(faces, np.int64)
        self._ends = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])

    def shortened(self, before: F64, change: F64) -> F64:
        """Return (n,) factors in [0, 1] of moves of the control vertices that keep the rendered mesh clean."""
        start = self._surface + self._pushed(before - self._vertices)
        return self._guard.kept(start, len(before), lambda factor: self._pushed(factor[:, None] * change),
                                self._movers, lambda near: with_neighbours(near, self._ends))  # fmt: skip

    def _pushed(self, move: F64) -> F64:
        """Moves of the welded rendered vertices."""
        each = np.einsum("eij,ej->ei", self._blocks, move[self._columns])
        return summed(self._rows, each, len(self._surface))

    def _movers(self, touched: Bool) -> Bool:
        out = np.zeros(len(self._vertices), bool)
        out[self._columns[self._strong & touched[self._rows]]] = True
        return out

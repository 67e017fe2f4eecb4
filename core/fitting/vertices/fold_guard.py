"""Steps of vertices that keep a surface clean: without faces that newly cross, fold over or become slivers.

A step is tested as a whole. Where it makes a bad face, the moves of the face's vertices and of their neighbours are
halved, and the step is tested again. A vertex that stays in the way of a clean surface does not move at all. The mesh
before the step has no bad face, so this ends.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...geometry import topology

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Bool = NDArray[np.bool_]
CrossingSearch = Callable[[F64, NDArray[np.int32]], I64]

# Cosine of the largest angle between the normals of two faces with a common edge.
MOST_BENT = -0.8
# Longest edge times perimeter of a face, over its area; 1 for an equilateral triangle.
MOST_SLIVER = 8.0
# Rounds in which moves are halved, and rounds in which vertices near bad faces are held.
HALVINGS, HELD = 5, 8


def _search() -> CrossingSearch | None:
    """The search for crossing faces of the native module; None: it is not installed."""
    try:
        from ... import _native
    except ImportError:
        return None
    return lambda points, faces: _native.crossing_face_pairs(points, faces, 0)


def with_neighbours(chosen: Bool, ends: I64) -> Bool:
    """Return `chosen` and all vertices with an edge, of the (e, 2) `ends`, to one of them."""
    out = chosen.copy()
    out[ends[chosen[ends].any(axis=1)]] = True
    return out


class FoldGuard:
    """Tests the steps of one mesh. What is bad at the start may stay so.

    Parameters
    ----------
    vertices
        (n, 3) positions at the start.
    faces
        (m, 3) vertex indices.
    label
        (n,) labels of welded vertices.
    """

    def __init__(self, vertices: F64, faces: NDArray[np.integer], label: I64) -> None:
        self._label = label
        self._first = topology.first_of_labels(label)
        corners = label[np.asarray(faces, np.int64)]
        a, b, c = corners.T
        corners = corners[(a != b) & (b != c) & (c != a)]
        self._faces = np.ascontiguousarray(corners, np.int32)
        points = vertices[self._first]
        found = topology.edges(self._faces, np.arange(len(points)))
        first = found.face_first.astype(np.int64)
        inner = np.flatnonzero(np.diff(first) == 2)
        self._pairs = np.stack([found.faces[first[inner]], found.faces[first[inner] + 1]], axis=1).astype(np.int64)
        self._ends = found.vertices.astype(np.int64)
        self._border = np.zeros(len(points), bool)
        self._border[self._ends[np.diff(first) != 2]] = True
        self._search = _search()
        normal, sliver = self._shapes(points)
        self._bent = self._bends(normal)
        self._start_sliver = sliver
        self._sliver = np.maximum(sliver, MOST_SLIVER)
        self._crossing = self._crossings(points)

    def shortened(self, before: F64, change: F64) -> F64:
        """Return (n,) factors in [0, 1] of the moves `change` of vertices from `before` that keep the mesh clean."""
        start, move = before[self._first], change[self._first]
        kept = self.kept(start, len(start), lambda factor: factor[:, None] * move, lambda near: near,
                         lambda near: with_neighbours(near, self._ends))  # fmt: skip
        return np.asarray(kept[self._label])

    def kept(self, start: F64, count: int, moves: Callable[[F64], F64], movers: Callable[[Bool], Bool],
             grown: Callable[[Bool], Bool]) -> F64:  # fmt: skip
        """Return the (count,) factors in [0, 1] that keep the mesh clean, of what moves its vertices.

        Parameters
        ----------
        start
            Positions of the welded vertices before the step.
        count
            Number of movers: the welded vertices themselves, or vertices that control them.
        moves
            Returns the moves of the welded vertices for factors of the movers.
        movers
            Returns which movers move some of the welded vertices most.
        grown
            Adds their neighbours to some movers.
        """
        factor = np.ones(count)
        normal, sliver = self._shapes(start)
        for k in range(HALVINGS + HELD):
            bad = self._bad(start + moves(factor), normal, sliver)
            if not len(bad):
                return factor
            touched = np.zeros(len(start), bool)
            touched[self._faces[bad]] = True
            near = movers(touched)
            if k < HALVINGS:
                # Neighbours half as strongly, so that the brake makes no crease
                factor[near] *= 0.5
                factor[grown(near) & ~near] *= 0.75
            else:
                for _ in range(k - HALVINGS):
                    near = grown(near)
                factor[near] = 0.0
        return np.zeros(count)

    def distortion(self, vertices: F64) -> F64:
        """(n,) for each vertex: by which factor a face at it is less equilateral than at the start, at most.

        1 at borders, which motion along the surface would change.
        """
        sliver = self._shapes(vertices[self._first])[1] / np.maximum(self._start_sliver, 1.0)
        out = np.ones(len(self._first))
        for k in range(3):
            np.maximum.at(out, self._faces[:, k], sliver)
        out[self._border] = 1.0
        return np.asarray(out[self._label])

    def _bad(self, points: F64, before: F64, sliver_before: F64) -> I64:
        """Faces that newly are bad, from the normals and shapes of faces before the step."""
        normal, sliver = self._shapes(points)
        bad = np.einsum("ij,ij->i", normal, before) < 0.0
        bad |= (sliver > self._sliver) & (sliver > sliver_before)
        bent = self._bends(normal) & ~self._bent
        bad[self._pairs[bent]] = True
        new = self._crossings(points)
        new = new[~np.isin(new, self._crossing)]
        bad[new // len(self._faces)] = True
        bad[new % len(self._faces)] = True
        return np.flatnonzero(bad)

    def _shapes(self, points: F64) -> tuple[F64, F64]:
        """Unit normal of each face, and how far it is from equilateral (`MOST_SLIVER`)."""
        a, b, c = (points[self._faces[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        area = np.linalg.norm(normal, axis=1)
        sides = [np.linalg.norm(v, axis=1) for v in (b - a, c - b, a - c)]
        sliver = np.maximum.reduce(sides) * sum(sides) / (2.0 * np.sqrt(3.0) * np.where(area > 0.0, area, 1e-300))
        return normal / np.where(area > 0.0, area, 1.0)[:, None], np.asarray(sliver)

    def _bends(self, normal: F64) -> Bool:
        one, other = self._pairs.T
        return np.asarray(np.einsum("ij,ij->i", normal[one], normal[other]) < MOST_BENT)

    def _crossings(self, points: F64) -> I64:
        """Numbers of the pairs of faces that cross."""
        if self._search is None:
            return np.zeros(0, np.int64)
        pairs = self._search(np.ascontiguousarray(points), self._faces)
        return np.asarray(pairs[:, 0] * len(self._faces) + pairs[:, 1])

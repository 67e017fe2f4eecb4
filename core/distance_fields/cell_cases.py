"""Triangles of a cell for each of the 256 combinations of signs at its corners (marching cubes, Lorensen & Cline 1987).

The table is computed, not written down. On each face of the cell, segments separate the corners inside from those
outside; where two opposite corners are inside, each is cut off alone. The rule only looks at the face, so that both
cells of a face have the same segments and the surface has no gaps. The segments of the six faces form loops, and each
loop is divided into triangles. A loop's diagonal must not lie on a face, where the other cell might have the same one:
that edge would have four triangles.

Bit k of a combination is set if corner k = x + 2 y + 4 z is inside.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

# Edges as (axis, x, y, z) of the lower end.
EDGES = np.array([(axis, *(bits >> k & 1 for k in range(3)))
                  for axis in range(3) for bits in range(8) if not bits >> axis & 1])  # fmt: skip

Polygon = tuple[int, ...]


def _edge(one: int, other: int) -> int:
    low, axis = min(one, other), (one ^ other).bit_length() - 1
    return EDGES.tolist().index([axis, *(low >> k & 1 for k in range(3))])


def _faces() -> list[tuple[int, ...]]:
    """Corners of the six faces, counter-clockwise seen from outside."""
    found = []
    for axis in range(3):
        u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        ring = (0, u, u | v, v)
        found += [ring[::-1], tuple(corner | 1 << axis for corner in ring)]
    return found


def _loops(inside: int, faces: list[tuple[int, ...]]) -> list[Polygon]:
    """Closed loops of crossed edges; the outside is in front of them."""
    following = {}
    for ring in faces:
        for k in range(4):
            before, corner = ring[k - 1], ring[k]
            if inside >> before & 1 or not inside >> corner & 1:
                continue
            # A run of corners inside begins here; the segment cuts it off.
            end = k
            while inside >> ring[(end + 1) % 4] & 1:
                end += 1
            following[_edge(before, corner)] = _edge(ring[end % 4], ring[(end + 1) % 4])
    loops = []
    while following:
        first, at = next(iter(following.items()))
        loop = [first]
        del following[first]
        while at != first:
            loop.append(at)
            at = following.pop(at)
        loops.append(tuple(loop))
    return loops


def _divided(polygon: Polygon, on: list[set[int]]) -> list[Polygon] | None:
    """Triangles of a polygon without a diagonal on a face of the cell; None if there are none."""
    if len(polygon) == 3:
        return [polygon]
    first, last = polygon[0], polygon[-1]
    for k in range(1, len(polygon) - 1):
        sides = [(first, polygon[k])] if k > 1 else []
        sides += [(polygon[k], last)] if k < len(polygon) - 2 else []
        if any({a, b} <= face for a, b in sides for face in on):
            continue
        left = _divided(polygon[: k + 1], on) if k > 1 else []
        right = _divided(polygon[k:], on) if k < len(polygon) - 2 else []
        if left is not None and right is not None:
            return [*left, (first, polygon[k], last), *right]
    return None


@cache
def triangles() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number of triangles of each combination (256,), and their edges (256, most, 3)."""
    faces = _faces()
    on = [{_edge(ring[k - 1], ring[k]) for k in range(4)} for ring in faces]
    found: list[list[Polygon]] = []
    for inside in range(256):
        found.append([])
        for loop in _loops(inside, faces):
            divided = _divided(loop, on)
            assert divided is not None
            found[-1] += divided
    count = np.array([len(case) for case in found])
    edges = np.zeros((256, count.max(), 3), np.int64)
    for inside, case in enumerate(found):
        edges[inside, : len(case)] = np.reshape(case, (-1, 3))
    return count, edges

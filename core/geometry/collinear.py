"""Triangles whose corners lie on one line, and the edges beside them.

Triangulations close T-junctions with such triangles: an edge of one face, and the two halves of it that belong to other
faces, are their sides. They have no area and no side of their own, so that nothing says whether their edges are
silhouettes. Therefore the faces on both sides of the line meet directly, along the pieces between the corners on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .labels import merge, rows_and_places

# Height of a triangle, as a fraction of its largest coordinate, that is rounding: a few units of single precision.
ROUNDING = 5e-7
# Faces that are examined at once: what is computed of them fits into the processor's caches.
BLOCK = 1 << 14


def collinear_faces(
    vertices: NDArray[np.floating[Any]], faces: NDArray[np.integer[Any]], origin: NDArray[np.float64] | None = None
) -> NDArray[np.bool_]:
    """Return whether the corners of each of the (m, 3) faces lie on one line, up to rounding of their positions.

    Rounding is that of coordinates, or, with an `origin`, of the larger ones of them and of those relative to it.
    """
    out = np.empty(len(faces), bool)
    for first in range(0, len(faces), BLOCK):
        block = slice(first, first + BLOCK)
        # Columns: three coordinates of each corner
        a, b, c = (np.ascontiguousarray(vertices[corner].T) for corner in faces[block].T)
        largest = np.maximum(np.maximum(np.abs(a).max(axis=0), np.abs(b).max(axis=0)), np.abs(c).max(axis=0))
        if origin is not None:
            shifted = [np.abs(corner - origin[:, None]).max(axis=0) for corner in (a, b, c)]
            largest = np.maximum(largest, np.max(shifted, axis=0))
        one, other, third = b - a, c - a, c - b
        longest = np.maximum(np.maximum(_square(one), _square(other)), _square(third))
        # Twice the area is the height times the longest side
        area = [one[i] * other[j] - one[j] * other[i] for i, j in ((1, 2), (2, 0), (0, 1))]
        out[block] = _square(area) <= (ROUNDING * largest) ** 2 * longest
    return out


def _square(v: Sequence[NDArray[Any]] | NDArray[Any]) -> NDArray[Any]:
    """Squared lengths of vectors, given by their coordinates."""
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


def lines(key: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of the line of each collinear face. Faces with an edge of the same key (3 n,) share it."""
    _, edge = np.unique(key, return_inverse=True)
    faces = np.arange(len(key) // 3)
    return merge(faces, np.repeat(faces, 3), edge)


def pieces(
    points: NDArray[np.float64], ends: NDArray[np.int64], line_of_end: NDArray[np.int64],
    sides: NDArray[np.int64], line_of_side: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut sides of faces on lines into the pieces between all points on their line.

    Parameters
    ----------
    points
        (k, 3) positions.
    ends
        (n,) points on lines.
    line_of_end
        (n,) their lines.
    sides
        (s, 2) first and last point of each side.
    line_of_side
        (s,) their lines.

    Returns
    -------
    The side (p,) of each piece, and its first and last point (p, 2).
    """
    # Sort the points of each line along it
    pairs = np.unique(np.stack([line_of_end, ends], axis=1), axis=0)
    start = np.flatnonzero(np.concatenate([[True], np.diff(pairs[:, 0]) != 0]))
    number = np.repeat(np.arange(len(start)), np.diff(start, append=len(pairs)))
    from_first = points[pairs[:, 1]] - points[pairs[start, 1]][number]
    far = np.lexsort(((from_first**2).sum(axis=1), number))[np.append(start[1:], len(pairs)) - 1]
    along = (from_first * from_first[far][number]).sum(axis=1)
    pairs = pairs[np.lexsort((along, number))]
    # Walk along each side
    key = pairs[:, 0] * len(points) + pairs[:, 1]
    order = np.argsort(key)
    place = order[np.searchsorted(key, line_of_side[:, None] * len(points) + sides, sorter=order)]
    count = np.abs(place[:, 1] - place[:, 0])
    side, walked = rows_and_places(count)
    step = np.where(place[:, 1] > place[:, 0], 1, -1)[side]
    at = place[side, 0] + step * walked
    return side, np.stack([pairs[at, 1], pairs[at + step, 1]], axis=1)

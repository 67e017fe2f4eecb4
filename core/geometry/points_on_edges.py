"""Points on edges: where edges of one body end along those of another, as bricks do in a wall.

Coincidences are rare, so most edges are put aside by tests that cost little: those between faces that are nearly in one
plane, and those without another edge on about the same line.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .collinear import collinear_faces
from .labels import rows_and_places

# Cosine of the angle between the faces of an edge, above which the edge is part of a smooth or flat surface.
FLAT = 0.985
# Cells of directions, and of the places of lines in units of the size of all: much larger than rounding, and much
# smaller than their range.
DIRECTION, PLACE = 1e-3, 1e-2
# Offsets of two grids of such cells. No line of common shapes is near the cell walls of both.
OFFSETS = (0.2113, 0.7267)
# Pairs of a point and a box up to which all are compared, and pairs that are compared at once.
ALL_PAIRS, BLOCK = 1 << 16, 1 << 22
# Edges longer than this times the median are compared with all points; the others with those in their cells of a grid.
LONG = 2.0


def sharp(
    vertices: NDArray[np.floating[Any]], ends: NDArray[np.int64], face_first: NDArray[np.int64],
    faces: NDArray[np.int64], opposite: NDArray[np.integer[Any]],
) -> NDArray[np.bool_]:
    """Return which edges are borders, folds, or have more than two faces.

    Parameters
    ----------
    vertices
        (n, 3) positions.
    ends
        (E, 2) vertices at the ends of the edges.
    face_first, faces
        (E,) the place of each edge's first face in `opposite`, and the number of its faces.
    opposite
        The corner opposite the edge, of each of its faces.
    """
    out = np.ones(len(ends), bool)
    rows = np.flatnonzero(faces == 2)
    if len(rows) == 0:
        return out
    a, first = vertices[ends[rows, 0]], face_first[rows]
    way, one, other = (vertices[at] - a for at in (ends[rows, 1], opposite[first], opposite[first + 1]))
    # Of the vectors to the opposite corners, the parts across the edge
    square = np.maximum(np.einsum("ij,ij->i", way, way), np.finfo(np.float32).tiny)
    for side in (one, other):
        side -= (np.einsum("ij,ij->i", side, way) / square)[:, None] * way
    size = np.einsum("ij,ij->i", one, one) * np.einsum("ij,ij->i", other, other)
    out[rows] = -np.einsum("ij,ij->i", one, other) < FLAT * np.sqrt(size)
    return out


def points_on_edges(
    vertices: NDArray[np.floating[Any]], ends: NDArray[np.int64], label: NDArray[np.int64], body: NDArray[np.int64],
    group: NDArray[np.int64], slack: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find the ends of edges that lie on edges of other bodies, where both go along one line.

    Parameters
    ----------
    vertices
        (n, 3) positions.
    ends
        (E, 2) vertices at the ends of the edges.
    label
        (n,) labels, the same for vertices in one place.
    body, group
        (E,) two numbers of each edge. Edges of different bodies in one group are compared.
    slack
        Distance up to which positions are equal.

    Returns
    -------
    The vertices (p,) and the edges (p,) on which they lie.
    """
    if len(ends) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    rows = _on_common_lines(vertices, ends, body, group)
    if len(rows) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    one, other = (vertices[ends[rows, k]].astype(np.float64) for k in range(2))
    # Each place once, with the edges that end there
    places, number = np.unique(label[ends[rows]], return_inverse=True)
    number = number.reshape(-1, 2)
    vertex = np.zeros(len(places), np.int64)
    vertex[number] = ends[rows]
    point, edge = _in_boxes(vertices[vertex].astype(np.float64), np.minimum(one, other) - slack,
                            np.maximum(one, other) + slack)
    point, edge = _kept((number[edge] != point[:, None]).all(axis=1), point, edge)
    on_line = collinear_faces(vertices, np.column_stack([ends[rows[edge]], vertex[point]]))
    point, edge = _kept(on_line, point, edge)
    # Keep the points from which other edges go along this one
    at, of = number.ravel(), np.repeat(np.arange(len(rows)), 2)
    far = ends[rows][:, ::-1].ravel()
    order = np.argsort(at, kind="stable")
    at, of, far = at[order], of[order], far[order]
    pair, which = _expanded(np.searchsorted(at, point), np.searchsorted(at, point, side="right"))
    edges = rows[of[which]], rows[edge[pair]]
    fits = (group[edges[0]] == group[edges[1]]) & (body[edges[0]] != body[edges[1]])
    pair, which = _kept(fits, pair, which)
    along = collinear_faces(vertices, np.column_stack([ends[rows[edge[pair]]], far[which]]))
    found = np.unique(pair[along])
    return vertex[point[found]], rows[edge[found]]


def _on_common_lines(
    vertices: NDArray[np.floating[Any]], ends: NDArray[np.int64], body: NDArray[np.int64], group: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the edges on whose lines there may be others, of other bodies in their group."""
    one, other = (vertices[ends[:, k]].astype(np.float64) for k in range(2))
    way = other - one
    way /= np.maximum(np.linalg.norm(way, axis=1), np.finfo(np.float64).tiny)[:, None]
    middle = 0.5 * (one + other)
    middle -= middle.mean(axis=0)
    size = max(float(np.abs(middle).max()), float(np.finfo(np.float64).tiny))
    # Numbers of the line: the same for opposite directions, and the point next to the middle of all
    direction = way * np.roll(way, -1, axis=1) + 0.5 * way * way
    foot = middle - np.einsum("ij,ij->i", middle, way)[:, None] * way
    line = np.concatenate([direction / DIRECTION, foot / (PLACE * size)], axis=1)
    several = np.zeros(len(ends), bool)
    for offset in OFFSETS:
        key = group.astype(np.int64)
        for cell in np.floor(line + offset).astype(np.int64).T:
            key = 1000003 * key + cell  # wraps around: other edges may have the same key
        order = np.argsort(key)
        start = np.flatnonzero(np.diff(key[order], prepend=key[order[0]] - 1))
        bodies = body[order]
        differ = np.minimum.reduceat(bodies, start) != np.maximum.reduceat(bodies, start)
        several[order] |= np.repeat(differ, np.diff(start, append=len(order)))
    return np.flatnonzero(several)


def _kept(mask: NDArray[np.bool_], *arrays: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
    return tuple(array[mask] for array in arrays)


def _expanded(first: NDArray[np.int64], last: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All numbers of the ranges [first, last): the range of each, and the number."""
    of, place = rows_and_places(last - first)
    return of, first[of] + place


def _in_boxes(
    points: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the pairs of points (k, 3) and boxes (n, 3) that contain them."""
    if len(points) * len(low) <= ALL_PAIRS:
        return _all_pairs(points, low, high)
    size = (high - low).max(axis=1)
    cell = max(LONG * float(np.median(size)), 1e-6 * float(np.ptp(points, axis=0).max()))
    long = np.flatnonzero(size > cell)
    point, box = _all_pairs(points, low[long], high[long])
    found = [(point, long[box])]
    short = np.flatnonzero(size <= cell)
    # A short box meets at most two cells along each axis
    origin = np.minimum(points.min(axis=0), low.min(axis=0))
    keys = _cells((points - origin) / cell)
    order = np.argsort(keys)
    keys = keys[order]
    first, last = ((corner[short] - origin) // cell for corner in (low, high))
    for offset in np.ndindex(2, 2, 2):
        meets = np.flatnonzero(np.logical_and.reduce([first[:, k] + offset[k] <= last[:, k] for k in range(3)]))
        key = _cells(first[meets] + offset)
        of, number = _expanded(np.searchsorted(keys, key), np.searchsorted(keys, key, side="right"))
        point, box = order[number], short[meets[of]]
        for k in range(3):
            at = points[point, k]
            inside = (at >= low[box, k]) & (at <= high[box, k])
            point, box = point[inside], box[inside]
        found.append((point, box))
    return np.concatenate([one for one, _ in found]), np.concatenate([other for _, other in found])


def _cells(places: NDArray[np.float64]) -> NDArray[np.int64]:
    """A number of the cell of each of the (k, 3) places, in units of cells, from 0 on."""
    cell = places.astype(np.int64)
    return np.asarray((cell[:, 0] << 42) + (cell[:, 1] << 21) + cell[:, 2])


def _all_pairs(
    points: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """As `_in_boxes`, by a comparison of all with all."""
    found = [(np.zeros(0, np.int64), np.zeros(0, np.int64))]
    rows = max(BLOCK // max(len(points), 1), 1)
    for first in range(0, len(low), rows):
        inside = np.ones((len(low[first:first + rows]), len(points)), bool)
        for k in range(3):
            inside &= low[first:first + rows, k, None] <= points[:, k]
            inside &= high[first:first + rows, k, None] >= points[:, k]
        box, point = np.nonzero(inside)
        found.append((point, box + first))
    return np.concatenate([one for one, _ in found]), np.concatenate([other for _, other in found])

"""Distances of grid nodes from triangles, near the triangles. All coordinates are grid coordinates of cubic cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.labels import rows_and_places
from .ragged import parts

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Largest edge of a piece of a triangle, in cells. Larger pieces look at more nodes that are too far away.
PIECE = 1.5
# The same where one part of a mesh crosses another: as far as a smaller piece, distances may be wrong there.
SMALL_PIECE = 0.2
# Cells across a surface in which its triangles are looked up first, and how far beyond a cell they are listed in it.
_ACROSS = 48.0
_AROUND = 0.5


def pieces(corner: F64, longest: float = PIECE) -> tuple[F64, I64]:
    """Divide triangles (n, 3, 3) into such with short edges.

    Returns
    -------
    (m, 3, 3) pieces, and for each the number of its triangle.
    """
    of = np.arange(len(corner))
    done, done_of = [], []
    while len(corner):
        edge = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
        widest = np.argmax(edge, axis=1)
        rows = np.arange(len(corner))
        small = edge[rows, widest] <= longest
        done.append(corner[small])
        done_of.append(of[small])
        rows, widest = rows[~small], widest[~small]
        a, b, c = (corner[rows, (widest + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        corner = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        of = np.concatenate([of[rows], of[rows]])
    if not done:
        return corner, of
    found, number = np.concatenate(done), np.concatenate(done_of)
    order = np.argsort(number, kind="stable")
    return found[order], number[order]


def near_distances(corner: F64, shape: tuple[int, int, int], band: float) -> F64:
    """(mx, my, mz) distances of nodes from the nearest of small triangles (n, 3, 3); inf beyond `band` cells."""
    square = np.full(shape, np.inf)
    flat = square.reshape(-1)
    middle = corner.mean(axis=1)
    reach = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1, initial=0.0) + band
    most = np.array(shape) - 1
    low = np.maximum(np.ceil(corner.min(axis=1) - band), 0).astype(np.int64)
    high = np.minimum(np.floor(corner.max(axis=1) + band), most).astype(np.int64)
    extent = np.maximum(high - low + 1, 0)
    stride = np.array([shape[1] * shape[2], shape[2], 1])
    for part in parts(extent.prod(axis=1)):
        size = extent[part]
        row, place = rows_and_places(size.prod(axis=1))
        across, z = np.divmod(place, size[row, 2])
        x, y = np.divmod(across, size[row, 1])
        node = low[part][row] + np.stack([x, y, z], axis=1)
        near = np.sum((node - middle[part][row]) ** 2, axis=1) <= reach[part][row] ** 2
        node, row = node[near], row[near]
        found = square_distances(node.astype(np.float64), corner[part][row])
        index = node @ stride
        # The smallest of each node: sort by node, then take minima of runs.
        order = np.argsort(index, kind="stable")
        first = np.flatnonzero(np.diff(index[order], prepend=-1))
        if len(first):
            at = index[order][first]
            flat[at] = np.minimum(flat[at], np.minimum.reduceat(found[order], first))
    out = np.sqrt(square)
    out[out > band] = np.inf
    return out


def square_distances(points: F64, corner: F64) -> F64:
    """(n,) squared distances of points (n, 3) from triangles (n, 3, 3), pairwise."""
    return np.asarray(np.sum((points - closest_points(points, corner)[0]) ** 2, axis=1))


def closest_points(points: F64, corner: F64) -> tuple[F64, F64]:
    """(n, 3) points of triangles (n, 3, 3) that are closest to points (n, 3), pairwise; (n, 3) weights of the corners.

    The foot of the perpendicular, if it lies within the triangle, else the closest of the points of the three edges.
    """
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    ab, ac, ap = b - a, c - a, points - a
    d00, d01, d11 = (np.einsum("ij,ij->i", u, v) for u, v in ((ab, ab), (ab, ac), (ac, ac)))
    d0, d1 = np.einsum("ij,ij->i", ap, ab), np.einsum("ij,ij->i", ap, ac)
    area = d00 * d11 - d01 * d01
    safe = np.where(area > 0.0, area, 1.0)
    v, w = (d11 * d0 - d01 * d1) / safe, (d00 * d1 - d01 * d0) / safe
    inside = (area > 1e-14 * d00 * d11) & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    weight = np.stack([1.0 - v - w, v, w], axis=1)
    outside = np.flatnonzero(~inside)
    if len(outside):
        p, tri = points[outside], corner[outside]
        best = np.full(len(outside), np.inf)
        for k in range(3):
            start, along = tri[:, k], tri[:, (k + 1) % 3] - tri[:, k]
            length = np.einsum("ij,ij->i", along, along)
            t = np.einsum("ij,ij->i", p - start, along) / np.where(length > 0.0, length, 1.0)
            t = np.clip(t, 0.0, 1.0)
            found = np.sum((p - start - t[:, None] * along) ** 2, axis=1)
            better = found < best
            best = np.where(better, found, best)
            one = np.zeros((len(outside), 3))
            one[:, k], one[:, (k + 1) % 3] = 1.0 - t, t
            weight[outside] = np.where(better[:, None], one, weight[outside])
    return np.einsum("nk,nkj->nj", weight, corner), weight


def nearest(points: F64, corner: F64) -> tuple[I64, F64, F64]:
    """Find the nearest of triangles (m, 3, 3) for each of points (n, 3).

    Returns
    -------
    (n,) numbers of the triangles, (n, 3) weights of their corners at the nearest places, and (n,) distances.
    """
    face, distance, weight = np.zeros(len(points), np.int64), np.full(len(points), np.inf), np.zeros((len(points), 3))
    low = corner.min(axis=(0, 1))
    size = float(np.ptp(corner, axis=(0, 1)).max()) / _ACROSS or 1.0
    left = np.arange(len(points))
    while len(left):
        found, number = pieces((corner - low) / size, 1.0)
        at = (points[left] - low) / size
        cell, pairs = _near_pairs(at, found)
        for part in parts(pairs[1] - pairs[0]):
            row, place = rows_and_places((pairs[1] - pairs[0])[part])
            if len(row) == 0:
                continue
            piece = cell[pairs[0][part][row] + place]
            point = left[part][row]
            triangle = number[piece]
            _, w = closest_points(points[point], corner[triangle])
            d = np.linalg.norm(points[point] - np.einsum("nk,nkj->nj", w, corner[triangle]), axis=1)
            order = np.lexsort((triangle, d, point))
            best = order[np.flatnonzero(np.diff(point[order], prepend=-1))]
            face[point[best]], distance[point[best]], weight[point[best]] = triangle[best], d[best], w[best]
        left = left[distance[left] > _AROUND * size]
        size *= 2.0
    return face, weight, distance


def _near_pairs(points: F64, found: F64) -> tuple[I64, tuple[I64, I64]]:
    """List pieces by the unit cells that they or their surroundings touch.

    Returns
    -------
    The list, and for each point the begin and end of its cell's part. All pieces within `_AROUND` are in that part.
    """
    low, high = np.floor(points.min(axis=0)).astype(np.int64), np.floor(points.max(axis=0)).astype(np.int64)
    size = high - low + 1
    first = np.maximum(np.floor(found.min(axis=1) - _AROUND).astype(np.int64), low)
    last = np.minimum(np.floor(found.max(axis=1) + _AROUND).astype(np.int64), high)
    extent = np.maximum(last - first + 1, 0)
    row, place = rows_and_places(extent.prod(axis=1))
    across, z = np.divmod(place, np.maximum(extent[row, 2], 1))
    x, y = np.divmod(across, np.maximum(extent[row, 1], 1))
    stride = np.array([size[1] * size[2], size[2], 1])
    key = (first[row] - low + np.stack([x, y, z], axis=1)) @ stride
    order = np.argsort(key, kind="stable")
    wanted = (np.floor(points).astype(np.int64) - low) @ stride
    sorted_key = key[order]
    return row[order], (np.searchsorted(sorted_key, wanted), np.searchsorted(sorted_key, wanted, side="right"))

"""T-junctions: corners of faces that lie on the open side of another face.

A surface may be closed there although its mesh is not: the side of one face and those of its neighbours are open
borders in the same place. Triangles without area would close it (`geometry/collinear.py`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .collinear import collinear_faces, pieces
from .labels import merge

# Borders at one vertex that are compared with each other.
MOST_BORDERS = 16


def junctions(points: NDArray[np.float64], borders: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return triangles without area that close T-junctions.

    Parameters
    ----------
    points
        (k, 3) positions.
    borders
        (n, 2) points at the ends of open borders.

    Returns
    -------
    (m, 3) points: both ends of a border, and a point on it at which other borders end that lie along it.
    """
    line = _lines_of_borders(points, borders)
    several = np.bincount(line, minlength=len(borders))[line] > 1
    sides, of = borders[several], line[several]
    if len(sides) == 0:
        return np.zeros((0, 3), np.int64)
    side, ends = pieces(points, sides.ravel(), np.repeat(of, 2), sides, of)
    within = ends[:, 1] != sides[side, 1]
    return np.column_stack([sides[side[within]], ends[within, 1]])


def _lines_of_borders(points: NDArray[np.float64], borders: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return a number for each border, the same for those that are joined by borders along one line."""
    at, edge = borders.ravel(), np.repeat(np.arange(len(borders)), 2)
    other = borders[:, ::-1].ravel()
    order = np.argsort(at, kind="stable")
    at, edge, other = at[order], edge[order], other[order]
    found = [np.zeros((0, 2), np.int64)]
    for step in range(1, MOST_BORDERS):
        same = np.flatnonzero(at[step:] == at[:-step])
        if len(same) == 0:
            break
        corners = np.column_stack([at[same], other[same], other[same + step]])
        along = collinear_faces(points, corners)
        found.append(np.column_stack([edge[same], edge[same + step]])[along])
    pairs = np.concatenate(found)
    return merge(np.arange(len(borders)), pairs.ravel(), np.repeat(np.arange(len(pairs)), 2))

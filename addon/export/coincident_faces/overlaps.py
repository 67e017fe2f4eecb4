"""Places where faces of one mesh and material lie on each other in part: bodies that were joined or repeated.

`near_triangles` finds triangles that lie on those of other owners, and those that lie twice at the same place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from edgegrad.geometry.labels import rows_and_places

from ..geometry.normals import bits
from .near_triangles import DISTANCE_STEP, F64, I64, NORMAL_STEP, SHIFTS, Surface, contains, plane_normals

MOST_TRIANGLES = 300_000  # that are searched
MOST_PAIRS = 1 << 20  # points and triangles that are compared; with more, a part of the points stands for all
# Distance from the border of a triangle, in units of rounding, from which a point is surely within it.
WITHIN = 16.0


def overlapped(surfaces: Sequence[Surface], size: float, face: I64, points: F64, slack: F64) -> list[int]:
    """Owners of the points that lie within another triangle of the owner of their own one.

    Parameters
    ----------
    size
        Of the scene.
    face
        Triangle of each point, in the order of the surfaces.
    points, slack
        (n, 3) relative to the middle of the scene, and distance by which each may be rounded.
    """
    if not len(face) or sum(len(surface.faces) for surface in surfaces) > MOST_TRIANGLES:
        return []
    corners = np.concatenate([surface.vertices[surface.faces] for surface in surfaces])
    owner = np.concatenate([surface.owner for surface in surfaces])
    normal, whole = plane_normals(corners)
    distance = np.einsum("nk,nk->n", normal, corners[:, 0])
    cell = np.column_stack([normal / NORMAL_STEP, distance / (DISTANCE_STEP * size)])
    on_others = np.zeros(len(face), bool)
    for shift in SHIFTS:
        key = bits(np.floor(cell + shift).astype(np.int64), owner)
        among = np.flatnonzero(np.isin(key, key[face]) & whole)
        among = among[np.argsort(key[among], kind="stable")]
        first, last = (np.searchsorted(key[among], key[face], side) for side in ("left", "right"))
        step = int((last - first).sum() // MOST_PAIRS) + 1
        some = np.arange(0, len(face), step)
        row, place = rows_and_places((last - first)[some])
        point, triangle = some[row], among[first[some][row] + place]
        apart = triangle != face[point]
        point, triangle = point[apart], triangle[apart]
        for axis in range(3):
            ends, x = corners[triangle, :, axis], points[point, axis]
            near = (ends.min(axis=1) <= x + slack[point]) & (ends.max(axis=1) >= x - slack[point])
            point, triangle = point[near], triangle[near]
        plane = np.einsum("nk,nk->n", normal[triangle], points[point]) - distance[triangle]
        near = (np.abs(plane) <= slack[point]) & contains(corners[triangle], normal[triangle], points[point],
                                                         -WITHIN * slack[point])  # fmt: skip
        found = np.zeros(len(face), bool)
        found[point[near]] = True
        # Points that were passed over are as the one before them.
        on_others |= found[np.repeat(some, step)[: len(face)]]
    return [int(one) for one in owner[face[on_others]]]

"""Partners of the vertices of a symmetric mesh: the vertex that lies, or belongs, on the other side of each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...geometry import topology

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Distance between a vertex and the mirror image of its partner, as a fraction of the extent of the mesh.
TOLERANCE = 1e-4

Edge = tuple[int, ...]


def partners(points: F64, axis: int, polygons: Iterable[Sequence[int]] = ()) -> I64:
    """Find the partner of each vertex across the plane through the origin that an axis is normal to.

    Parameters
    ----------
    points
        (n, 3) positions; coincident vertices are welded.
    axis
        0, 1 or 2.
    polygons
        Vertices of each face of the mesh. Starting from vertices at mirrored places, partners of others are found by
        walking over mirrored faces, so that a mesh may be symmetric although its shape is not. A part of the mesh
        without such vertices gets none.

    Returns
    -------
    (n,) vertex numbers; -1: none was found. The partner of a partner is the vertex itself, or its first copy.
    """
    label = topology.weld(points)
    first = topology.first_of_labels(label)
    found = _by_place(points[first], axis)
    faces = [tuple(int(label[v]) for v in face) for face in polygons]
    if faces:
        after: dict[Edge, Edge] = {(face[k - 1], face[k]): face for face in faces for k in range(len(face))}
        _walk(found, after, list(after))
    return np.asarray(np.where(found < 0, -1, first[found])[label])


def _by_place(points: F64, axis: int) -> I64:
    count = len(points)
    sign = np.ones(3)
    sign[axis] = -1.0
    label = topology.weld(np.concatenate([points, points * sign]), TOLERANCE)
    order = np.argsort(label[:count], kind="stable")
    first = np.searchsorted(label[:count][order], label[count:], side="left")
    last = np.searchsorted(label[:count][order], label[count:], side="right")
    found = np.where(last > first, order[np.minimum(first, count - 1)], -1)
    for vertex in np.flatnonzero(last - first > 1):
        near = order[first[vertex] : last[vertex]]
        apart = np.linalg.norm(points[near] - points[vertex] * sign, axis=1)
        found[vertex] = near[np.argmin(apart)]
    mutual = (found >= 0) & (found[found] == np.arange(count))
    return np.where(mutual, found, -1)


def _walk(found: I64, after: Mapping[Edge, Edge], todo: list[Edge]) -> None:
    """Complete partners over faces whose mirror image is a face: it runs the other way around.

    `after` has the face to the left of each directed edge, and `todo` the edges to begin with.
    """
    while todo:
        a, b = todo.pop()
        if found[a] < 0 or found[b] < 0:
            continue
        face, image = after.get((a, b)), after.get((int(found[b]), int(found[a])))
        if face is None or image is None or len(image) != len(face):
            continue
        start, end = face.index(b), image.index(int(found[b]))
        ring = [face[(start + k) % len(face)] for k in range(len(face))]
        other = [image[(end - k) % len(face)] for k in range(len(face))]
        pairs = [(one, two) for one, two in zip(ring, other, strict=True) if found[one] != two]
        if not pairs or any(found[one] >= 0 or found[two] >= 0 for one, two in pairs):
            continue  # known, or the two faces are divided differently
        for one, two in pairs:
            found[one], found[two] = two, one
        for loop in (ring, other):
            for one, two in zip(loop, loop[1:] + loop[:1], strict=True):
                todo += [(one, two), (two, one)]

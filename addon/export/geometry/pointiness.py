"""Pointiness of vertices, as Cycles computes it: how far the edges at a vertex lie below or above its tangent plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad.geometry.labels import summed

from .mesh import corner_vertices, positions
from .normals import as_rendered, bits, unit, vertex_normals

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


def pointiness(mesh: Any) -> F32:
    """(n, 1) pointiness of each vertex: 0.5 on flat surfaces, more on convex edges.

    Vertices at one place count as one. The angle between the normal and the mean direction of the edges, as a fraction
    of half a turn, is averaged over each vertex and its neighbours.
    """
    points = positions(mesh)
    edges = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", edges.ravel())
    _, first, place = np.unique(bits(points), return_index=True, return_inverse=True)
    place = place.reshape(-1)
    count = len(first)
    edge = np.unique(np.sort(place[edges], axis=1), axis=0)
    edge = edge[edge[:, 0] != edge[:, 1]]
    one, two = edge.T
    normal = unit(summed(place, _summed_normals(mesh, points), count))
    along = unit(points[first[two]].astype(np.float64) - points[first[one]])
    number = np.bincount(one, minlength=count) + np.bincount(two, minlength=count)
    total = summed(one, along, count) - summed(two, along, count)
    cosine = np.einsum("nk,nk->n", normal, total) / np.maximum(number, 1)
    raw = np.where(number > 0, np.arccos(np.clip(cosine, -1.0, 1.0)) / np.pi, 0.0)
    blurred = raw + np.bincount(one, raw[two], count) + np.bincount(two, raw[one], count)
    return (blurred / (number + 1))[place][:, None].astype(np.float32)


def _summed_normals(mesh: Any, points: F32) -> F64:
    """(n, 3) sum of the normals that each vertex has where sharp edges part the faces around it."""
    parts, vertex = as_rendered(mesh), corner_vertices(mesh)
    if parts.vertices == len(points):
        return vertex_normals(mesh).astype(np.float64)
    start, size = (np.empty(len(mesh.polygons), np.int32) for _ in range(2))
    mesh.polygons.foreach_get("loop_start", start)
    mesh.polygons.foreach_get("loop_total", size)
    of_face = np.empty((len(size), 3), np.float32)
    mesh.polygon_normals.foreach_get("vector", of_face.ravel())
    corner = np.arange(len(vertex))
    before, after = corner - 1, corner + 1
    before[start], after[start + size - 1] = start + size - 1, start
    to_before, to_after = (unit(points[vertex[k]].astype(np.float64) - points[vertex]) for k in (before, after))
    angle = np.arccos(np.clip(np.einsum("ck,ck->c", to_before, to_after), -1.0, 1.0))
    weighted = angle[:, None] * np.repeat(of_face, size, axis=0)
    normals = unit(summed(parts.corners.astype(np.int32), weighted, parts.vertices))
    _, first = np.unique(parts.corners, return_index=True)
    return summed(vertex[first], normals[parts.corners[first]], len(points))

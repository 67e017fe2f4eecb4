"""Meshes whose sharp edges are split, as Blender prepares meshes with normals of corners for Cycles.

Random numbers of islands, means over the edges at a vertex, pointiness and free normals depend on it. Later versions of
Cycles have normals of corners instead.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

SPLITS = bpy.app.version < (5, 1, 0)

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]


class Split(NamedTuple):
    """A mesh whose edges may have been split, with the numbers that Blender gives its vertices and edges.

    Attributes
    ----------
    vertices
        Their number.
    corners
        (c,) vertex of each corner.
    edges
        (e, 2) vertices of each edge.
    origin
        (e,) edge of the mesh that each one comes from.
    """

    vertices: int
    corners: I64
    edges: I64
    origin: I64


def split(mesh: Any) -> Split:
    """Split sharp edges and the edges of flat faces.

    Corners at a vertex stay together where an edge that is not split joins their faces. Of these groups of corners, the
    one whose first corner comes last keeps the vertex.
    """
    vertex, edge = (_of_corners(mesh, name) for name in (".corner_vert", ".corner_edge"))
    sharp = _sharp(mesh, edge)
    after = _following(mesh)
    parted = np.zeros(len(mesh.vertices), bool)
    parted[vertex[sharp[edge]]] = parted[vertex[after[sharp[edge]]]] = True
    # Corners by edge, in their order, and at both ends of the edge.
    along = np.argsort(edge, kind="stable")
    ends = np.stack([along, after[along]], axis=1)
    turned = vertex[ends[:, 0]] > vertex[ends[:, 1]]
    ends[turned] = ends[turned, ::-1]
    joined = np.flatnonzero((edge[along[1:]] == edge[along[:-1]]) & ~sharp[edge[along[1:]]])
    pairs = np.concatenate([np.stack([ends[joined, k], ends[joined + 1, k]], axis=1) for k in range(2)])
    corners = _renumbered(vertex, parted, pairs[parted[vertex[pairs[:, 0]]]])
    count = max(len(mesh.vertices), int(corners.max(initial=-1)) + 1)
    return Split(count, corners, *_edges(mesh, edge, along, after, corners))


def unsplit(mesh: Any) -> Split:
    """Return the mesh as it is."""
    edges = _edge_vertices(mesh)
    return Split(len(mesh.vertices), _of_corners(mesh, ".corner_vert").astype(np.int64), edges, np.arange(len(edges)))


def _of_corners(mesh: Any, name: str) -> I32:
    out = np.empty(len(mesh.loops), np.int32)
    if len(out):
        mesh.attributes[name].data.foreach_get("value", out)
    return out


def _edge_vertices(mesh: Any) -> I64:
    out = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", out.ravel())
    return out.astype(np.int64)


def _sharp(mesh: Any, edge: I32) -> NDArray[np.bool_]:
    """(e,) whether an edge is sharp, or belongs to a flat face."""
    out, flat = np.zeros(len(mesh.edges), bool), np.zeros(len(mesh.polygons), bool)
    for name, values in (("sharp_edge", out), ("sharp_face", flat)):
        if name in mesh.attributes:
            mesh.attributes[name].data.foreach_get("value", values)
    size = np.empty(len(flat), np.int32)
    mesh.polygons.foreach_get("loop_total", size)
    out[edge[np.repeat(flat, size)]] = True
    return out


def _following(mesh: Any) -> I64:
    """(c,) next corner of the same face."""
    start, size = (np.empty(len(mesh.polygons), np.int32) for _ in range(2))
    mesh.polygons.foreach_get("loop_start", start)
    mesh.polygons.foreach_get("loop_total", size)
    out = np.arange(1, len(mesh.loops) + 1)
    out[start + size - 1] = start
    return out


def _renumbered(vertex: I32, parted: NDArray[np.bool_], pairs: I64) -> I64:
    """(c,) vertex of each corner, if corners at these vertices share one only with those that pairs join them with."""
    first = np.arange(len(vertex))  # of the corners that share a vertex
    while True:
        least = first.copy()
        for one, two in (pairs.T, pairs.T[::-1]):
            np.minimum.at(least, one, first[two])
        least = least[least]
        if (least == first).all():
            break
        first = least
    out = vertex.astype(np.int64)
    groups = np.unique(first[parted[vertex]])
    groups = groups[np.argsort(vertex[groups], kind="stable")]
    more = groups[:-1][vertex[groups[:-1]] == vertex[groups[1:]]]
    new = np.full(len(vertex), -1)
    new[more] = len(parted) + np.arange(len(more))
    return np.where(parted[vertex] & (new[first] >= 0), new[first], out)


def _edges(mesh: Any, edge: I32, along: I64, after: I64, corners: I64) -> tuple[I64, I64]:
    """Vertices and origins of the edges: those of the mesh, and behind them what sharp ones are split to."""
    edges = np.sort(_edge_vertices(mesh), axis=1)
    ends, origin = np.sort(np.stack([corners[along], corners[after[along]]], axis=1), axis=1), edge[along]
    # Each pair of vertices once, in the order of the corners.
    once = np.sort(np.unique(np.column_stack([origin, ends]), axis=0, return_index=True)[1])
    ends, origin = ends[once], origin[once].astype(np.int64)
    first = np.append(True, origin[1:] != origin[:-1])[:len(origin)]
    edges[origin[first]] = ends[first]
    return np.concatenate([edges, ends[~first]]), np.concatenate([np.arange(len(edges)), origin[~first]])

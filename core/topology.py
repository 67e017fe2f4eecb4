"""Edge topology by position: which faces meet along which segment of space.

A mesh stored with split vertices (normals, UV seams, one vertex per corner) must have the same
boundaries as the same mesh stored shared: a seam counted as two open borders doubles its
derivative. So coincident vertices are welded before edges are matched.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Vertices closer than this times the size of the mesh are one (derivations: "weld by position").
WELD_TOLERANCE = 1e-7


@dataclass
class Edges:
    """Undirected edges of one or more meshes and the faces along them (any number per edge).

    Attributes
    ----------
    vertices
        (E, 2) indices of the end points, into the vertices as stored; for a welded edge those of
        the face that comes first.
    face_first
        (E + 1,) offsets into `faces`.
    faces
        Face indices, all faces of edge k at ``faces[face_first[k]:face_first[k + 1]]``.
    opposite
        Vertex index of each of those faces' third corner, in the same order.
    """

    vertices: NDArray[np.uint32]
    face_first: NDArray[np.uint32]
    faces: NDArray[np.uint32]
    opposite: NDArray[np.uint32]

    def __len__(self) -> int:
        return len(self.vertices)


def weld(vertices: NDArray[np.float64], tolerance: float = WELD_TOLERANCE) -> NDArray[np.int64]:
    """Label of each vertex such that coincident vertices share one.

    Parameters
    ----------
    vertices
        (n, 3) positions.
    tolerance
        Distance below which two vertices are one, as a fraction of the bounding box's diagonal.

    Returns
    -------
    (n,) labels 0 … k - 1 in the order of the first vertex that has each.
    """
    extent = float(np.linalg.norm(np.ptp(vertices, axis=0))) if len(vertices) else 0.0
    step = max(extent * tolerance, np.finfo(np.float32).tiny)
    # One grid would separate neighbours that a cell wall happens to divide. With a second grid
    # shifted by half a cell, a pair that is close along all axes shares a cell in one of them
    # unless walls of both fall between it, which a pair closer than half a cell rules out per axis;
    # the labels of both grids are then merged.
    scaled = (vertices - vertices.min(axis=0)) / (2.0 * step) if len(vertices) else vertices
    label = np.arange(len(vertices))
    for axis_shift in ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5)):
        cell = np.floor(scaled + np.asarray(axis_shift)).astype(np.int64)
        _, group = np.unique(cell, axis=0, return_inverse=True)
        group = group.reshape(-1)
        label = _merge(label, group)
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    order = np.argsort(np.argsort(first))
    return np.asarray(order[inverse.reshape(-1)], np.int64)


def _merge(label: NDArray[np.int64], group: NDArray[np.int64]) -> NDArray[np.int64]:
    """Smallest label that each vertex reaches through shared labels and shared groups."""
    while True:
        least = np.full(int(group.max(initial=-1)) + 1, np.iinfo(np.int64).max)
        np.minimum.at(least, group, label)
        through = least[group]
        by_label = np.full(len(label), np.iinfo(np.int64).max)
        np.minimum.at(by_label, label, through)
        merged = by_label[label]
        if np.array_equal(merged, label):
            return label
        label = merged


def edges(faces: NDArray[np.int32], label: NDArray[np.int64]) -> Edges:
    """Edges of a mesh with the faces along each; needs no positions but the welded labels.

    Parameters
    ----------
    faces
        (m, 3) vertex indices.
    label
        Labels of `weld`.

    Returns
    -------
    The edges in the order of the first face that has each (neighbours in the list are then
    neighbours in space, which keeps rays from them coherent). Edges whose ends are one welded
    vertex have no length and are left out.
    """
    if len(faces) == 0:
        none = np.zeros(0, np.uint32)
        return Edges(np.zeros((0, 2), np.uint32), np.zeros(1, np.uint32), none, none)
    corner = np.stack([np.roll(faces, -k, axis=1) for k in range(3)], axis=1).reshape(-1, 3)  # a, b, opposite
    ends = np.sort(label[corner[:, :2]], axis=1)
    face = np.repeat(np.arange(len(faces), dtype=np.uint32), 3)
    real = ends[:, 0] != ends[:, 1]
    corner, ends, face = corner[real], ends[real], face[real]
    key = ends[:, 0] * (int(label.max()) + 1) + ends[:, 1]
    _, first, inverse, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    rank = np.argsort(np.argsort(first))  # position of each distinct edge by its first corner
    edge = rank[inverse.reshape(-1)]
    order = np.argsort(edge, kind="stable")
    by_first = np.argsort(first)
    face_first = np.concatenate([[0], np.cumsum(count[by_first])]).astype(np.uint32)
    return Edges(
        corner[first[by_first], :2].astype(np.uint32),
        face_first,
        face[order],
        corner[order, 2].astype(np.uint32),
    )


def join(parts: list[Edges], vertex_first: NDArray[np.int64], face_first: NDArray[np.int64]) -> Edges:
    """The edges of several meshes with indices into their concatenated vertices and faces."""
    if not parts:
        return edges(np.zeros((0, 3), np.int32), np.zeros(0, np.int64))
    offset = np.cumsum([0] + [len(p.faces) for p in parts])
    return Edges(
        np.concatenate([p.vertices + np.uint32(v) for p, v in zip(parts, vertex_first, strict=False)]),
        np.concatenate([p.face_first[:-1] + np.uint32(o) for p, o in zip(parts, offset, strict=False)]
                       + [np.array([offset[-1]], np.uint32)]),
        np.concatenate([p.faces + np.uint32(f) for p, f in zip(parts, face_first, strict=False)]),
        np.concatenate([p.opposite + np.uint32(v) for p, v in zip(parts, vertex_first, strict=False)]),
    )

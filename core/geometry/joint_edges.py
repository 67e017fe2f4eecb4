"""Edges of several meshes in one place, as where walls meet that are separate objects.

With its own faces alone, such an edge counts as a border or a silhouette by itself, and rounding decides whether rays
through it meet the other meshes. So each of them gets the faces of all, and each sample of it counts as one of their
number. A border is divided first where other borders along it end. This is right where the meshes move alike, or stand
still while the camera or lights move. If one of them moves against the others, a gap opens or they overlap: then each
keeps its own faces.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .collinear import pieces
from .junctions import lines_of_borders
from .topology import Edges, weld

# Vertices of different meshes are in one place up to this part of the size of the scene: positions are the results of
# different computations in single precision.
TOLERANCE = 5e-7
# Edges in one place, above which they are not joined: each would get the faces of all.
MOST = 64
# Boxes of other meshes that vertices of a mesh are compared with.
MANY = 16


def joined(
    edges: Edges, vertices: NDArray[np.float32], mesh_first_vertex: NDArray[np.int64], mesh_of_edge: NDArray[np.int64],
    kind: NDArray[np.int64],
) -> tuple[Edges, NDArray[np.int64], NDArray[np.int64]]:
    """Join edges of different meshes in one place.

    Parameters
    ----------
    edges, vertices
        The edges of all meshes, and the positions (n, 3) of their vertices.
    mesh_first_vertex
        (M + 1,) offsets of the meshes into `vertices`.
    mesh_of_edge
        (E,) the mesh of each edge.
    kind
        (M,) a number of each mesh. Meshes of different kinds share no edges; those below 0 share none.

    Returns
    -------
    The edges, and what has to stay in place for that: pairs (k, 2) of vertices that are together, and (m, 3) vertices
    on one line, the ends of a border and a point that divides it. Without edges in one place, the edges are the same
    object.
    """
    near = _near_others(vertices, mesh_first_vertex, kind)
    none = np.zeros((0, 2), np.int64), np.zeros((0, 3), np.int64)
    if not near.any():
        return edges, *none
    label = np.full(len(vertices), -1, np.int64)
    label[near] = weld(vertices[near].astype(np.float64), TOLERANCE)
    if not _any_shared(label[near], np.searchsorted(mesh_first_vertex, np.flatnonzero(near), side="right")):
        return edges, *none
    whole, mesh = edges, mesh_of_edge
    edges, row, on_line = _divided(whole, vertices, label, kind[mesh])
    mesh = mesh[row]
    eligible = np.flatnonzero((label[edges.vertices] >= 0).all(axis=1))
    rows, first = _in_one_place(label[edges.vertices[eligible].astype(np.int64)], mesh[eligible], kind)
    if len(rows) == 0:
        return whole, *none
    rows = eligible[rows]
    return _with_faces_of_all(edges, rows, first), _together(edges, rows, first, label), on_line


def _any_shared(label: NDArray[np.int64], mesh: NDArray[np.int64]) -> bool:
    """Whether vertices of different meshes have the same label."""
    least, most = np.full(int(label.max()) + 1, mesh.max()), np.zeros(int(label.max()) + 1, np.int64)
    np.minimum.at(least, label, mesh)
    np.maximum.at(most, label, mesh)
    return bool((least < most).any())


def _divided(
    edges: Edges, vertices: NDArray[np.float32], label: NDArray[np.int64], kind: NDArray[np.int64]
) -> tuple[Edges, NDArray[np.int64], NDArray[np.int64]]:
    """Divide borders at points of other meshes, by the labels of vertices.

    Returns the edges, the row (E,) of each among the given ones, and vertices (m, 3) as `joined`.
    """
    begin = edges.face_first.astype(np.int64)
    ends = label[edges.vertices.astype(np.int64)]
    row, on_line = np.arange(len(edges)), np.zeros((0, 3), np.int64)
    borders = np.flatnonzero((np.diff(begin) == 1) & (ends >= 0).all(axis=1) & (ends[:, 0] != ends[:, 1]))
    if len(borders) == 0:
        return edges, row, on_line
    # One vertex of each label
    known = np.flatnonzero(label >= 0)
    at = np.zeros(int(label.max()) + 1, np.int64)
    at[label[known]] = known
    points = vertices[at].astype(np.float64)
    line = lines_of_borders(points, ends[borders], kind[borders])
    several = np.bincount(line, minlength=len(borders))[line] > 1
    sides, of = ends[borders[several]], line[several]
    if len(sides) == 0:
        return edges, row, on_line
    side, cut = pieces(points, sides.ravel(), np.repeat(of, 2), sides, of)
    count = np.ones(len(edges), np.int64)
    count[borders[several]] = np.bincount(side, minlength=len(sides))
    if (count == 1).all():
        return edges, row, on_line
    row = np.repeat(row, count)
    new = edges.vertices[row].astype(np.int64)
    place = np.flatnonzero(np.isin(row, borders[several]))  # in the order of the sides, as the pieces are
    new[place] = np.where(cut == label[new[place]], new[place], at[cut])
    within = cut[:, 1] != sides[side, 1]
    on_line = np.column_stack([edges.vertices[row[place]], new[place, 1]])[within]
    faces = np.diff(begin)[row]
    first = np.concatenate([[0], np.cumsum(faces)])
    source = np.arange(first[-1]) + np.repeat(begin[row] - first[:-1], faces)
    return replace(edges, vertices=new.astype(np.uint32), face_first=first.astype(np.uint32),
                   faces=edges.faces[source], opposite=edges.opposite[source]), row, on_line.astype(np.int64)


def _in_one_place(
    ends: NDArray[np.int64], mesh: NDArray[np.int64], kind: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows of (n, 2) ends that are in one place with those of other meshes, and the offsets of places."""
    none = np.zeros(0, np.int64), np.zeros(1, np.int64)
    if len(ends) == 0:
        return none
    key = np.stack([kind[mesh], ends.min(axis=1), ends.max(axis=1)], axis=1)
    order = np.lexsort((np.arange(len(key)), *key.T[::-1]))
    key, mesh = key[order], mesh[order]
    start = np.flatnonzero(np.concatenate([[True], (np.diff(key, axis=0) != 0).any(axis=1)]))
    size = np.diff(start, append=len(order))
    several = (np.minimum.reduceat(mesh, start) != np.maximum.reduceat(mesh, start)) & (size <= MOST)
    several &= key[start, 1] != key[start, 2]
    rows = order[np.repeat(several, size)]
    return rows, np.concatenate([[0], np.cumsum(size[several])])


def _together(
    edges: Edges, rows: NDArray[np.int64], first: NDArray[np.int64], label: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Pairs (k, 2) of vertices at the ends of edges in one place."""
    ends = edges.vertices[rows].astype(np.int64)
    lead = np.repeat(ends[first[:-1]], np.diff(first), axis=0)
    turned = label[ends[:, 0]] != label[lead[:, 0]]
    pairs = np.stack([lead.ravel(), np.where(turned[:, None], ends[:, ::-1], ends).ravel()], axis=1)
    return np.asarray(pairs[pairs[:, 0] != pairs[:, 1]])


def _near_others(
    vertices: NDArray[np.float32], mesh_first_vertex: NDArray[np.int64], kind: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which vertices are in the box of another mesh; all of a mesh that meets the boxes of many."""
    near = np.zeros(len(vertices), bool)
    meshes = np.flatnonzero((kind >= 0) & (np.diff(mesh_first_vertex[: len(kind) + 1]) > 0))
    if len(meshes) < 2:
        return near
    ranges = [slice(mesh_first_vertex[m], mesh_first_vertex[m + 1]) for m in meshes]
    low, high = (np.array([limit(vertices[one], axis=0) for one in ranges]) for limit in (np.min, np.max))
    slack = TOLERANCE * float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
    low, high = low - slack, high + slack
    for m, one in enumerate(ranges):
        others = np.flatnonzero(((low <= high[m]) & (high >= low[m])).all(axis=1))
        if len(others) > MANY:
            near[one] = True
            continue
        for other in others[others != m]:
            near[one] |= ((vertices[one] >= low[other]) & (vertices[one] <= high[other])).all(axis=1)
    return near


def _with_faces_of_all(edges: Edges, rows: NDArray[np.int64], places: NDArray[np.int64]) -> Edges:
    """Return the edges, those in one place with the faces of all that are there; their own come first."""
    begin = edges.face_first.astype(np.int64)
    count, sharing = np.diff(begin), np.ones(len(edges), np.uint8)
    slots = {}
    for start, end in zip(places[:-1].tolist(), places[1:].tolist(), strict=True):
        members = rows[start:end].tolist()
        own = [np.arange(begin[e], begin[e + 1]) for e in members]
        for j, e in enumerate(members):
            slots[e] = np.concatenate(own[j:] + own[:j])
            count[e], sharing[e] = len(slots[e]), len(members)
    first = np.concatenate([[0], np.cumsum(count)])
    source = np.arange(first[-1])  # of each new slot, the old one
    source += np.repeat(begin[:-1] - first[:-1], count)
    for e, old in slots.items():
        source[first[e]:first[e + 1]] = old
    return replace(edges, face_first=first.astype(np.uint32), faces=edges.faces[source],
                   opposite=edges.opposite[source], sharing=sharing)

"""Edges of several meshes in one place, as where walls meet that are separate objects.

With its own faces alone, such an edge counts as a border or a silhouette by itself, and rounding decides whether rays
through it meet the other meshes. So each of them gets the faces of all, and each sample of it counts as one of their
number. An edge is divided first where those of other meshes along it end, as in a wall of bricks. This is right where
the meshes move alike, or stand still while the camera or lights move. If one of them moves against the others, a gap
opens or they overlap: then each keeps its own faces.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .. import _native
from .collinear import pieces
from .labels import rows_and_places
from .points_on_edges import points_on_edges, sharp
from .topology import Edges, weld

# Vertices of different meshes are in one place up to this part of the size of the scene: positions are the results of
# different computations in single precision.
TOLERANCE = 5e-7
# Edges in one place, above which they are not joined: each would get the faces of all.
MOST = 64
# Boxes of other meshes that vertices of a mesh are compared with.
MANY = 16
# Vertices that are compared at once, beside those of one mesh.
AT_ONCE = 1 << 20


def joined(
    edges: Edges, vertices: NDArray[np.float32], mesh_first_vertex: NDArray[np.int64], mesh_of_edge: NDArray[np.int64],
    kind: NDArray[np.int64],
) -> tuple[Edges, NDArray[np.int64], NDArray[np.int64]]:
    """Join edges of different meshes in one place, and note which meshes have such edges.

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
    on one line, the ends of an edge and a point that divides it. Without edges in one place, the edges are the same
    object.
    """
    near, meets, slack = _near_others(vertices, mesh_first_vertex, kind)
    none = np.zeros((0, 2), np.int64), np.zeros((0, 3), np.int64)
    if not near.any():
        return edges, *none
    label = np.full(len(vertices), -1, np.int64)
    points = np.flatnonzero(near)
    places = vertices[points].astype(np.float64)
    label[points] = weld(places, slack / max(float(np.linalg.norm(np.ptp(places, axis=0))), slack))
    whole, mesh = edges, mesh_of_edge
    point, divided = _points_on_others(edges, vertices, label, mesh, kind, meets, slack)
    if len(point) == 0 and not _any_shared(label[points], np.searchsorted(mesh_first_vertex, points, side="right")):
        return edges, *none
    edges, row, on_line = _divided(whole, vertices, label, point, divided)
    mesh = mesh[row]
    eligible = np.flatnonzero((label[edges.vertices] >= 0).all(axis=1))
    rows, first = _in_one_place(label[edges.vertices[eligible].astype(np.int64)], mesh[eligible], kind)
    if len(rows) == 0:
        return whole, *none
    rows = eligible[rows]
    together = _together(edges, rows, first, label)
    edges = replace(edges, touching=_touching(edges, vertices, rows, first, mesh[rows]))
    return _with_faces_of_all(edges, rows, first), together, on_line


def _touching(
    edges: Edges, vertices: NDArray[np.float32], rows: NDArray[np.int64], first: NDArray[np.int64],
    mesh: NDArray[np.int64],
) -> NDArray[np.uint32]:
    """Pairs (k, 2) of meshes whose edges are in one place, without edges within flat or smooth surfaces.

    Of many meshes in one place, those next to each other in the order of the meshes are pairs.
    """
    begin = edges.face_first.astype(np.int64)
    folds = sharp(vertices, edges.vertices[rows].astype(np.int64), begin[rows], np.diff(begin)[rows], edges.opposite)
    place = np.repeat(np.arange(len(first) - 1), np.diff(first))[folds]
    mesh = mesh[folds]
    order = np.lexsort((mesh, place))
    place, mesh = place[order], mesh[order]
    pairs = np.column_stack([mesh[:-1], mesh[1:]])[np.diff(place) == 0]
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0).astype(np.uint32)


def _any_shared(label: NDArray[np.int64], mesh: NDArray[np.int64]) -> bool:
    """Whether vertices of different meshes have the same label."""
    least, most = np.full(int(label.max()) + 1, mesh.max()), np.zeros(int(label.max()) + 1, np.int64)
    np.minimum.at(least, label, mesh)
    np.maximum.at(most, label, mesh)
    return bool((least < most).any())


def _points_on_others(
    edges: Edges, vertices: NDArray[np.float32], label: NDArray[np.int64], mesh: NDArray[np.int64],
    kind: NDArray[np.int64], meets: NDArray[np.bool_], slack: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return vertices (p,) at which edges of other meshes end, and the edges (p,) along which these go.

    `label` and `mesh` are labels of vertices and meshes of edges; only meshes that `meets` others count.
    """
    rows = np.flatnonzero(meets[mesh])
    begin, ends = edges.face_first.astype(np.int64), edges.vertices.astype(np.int64)
    rows = rows[sharp(vertices, ends[rows], begin[rows], np.diff(begin)[rows], edges.opposite)]
    own = np.where(label >= 0, label, len(label) + np.arange(len(label)))
    point, edge = points_on_edges(vertices, ends[rows], own, mesh[rows], kind[mesh[rows]], slack)
    near = label[point] >= 0
    return point[near], rows[edge[near]]


def _divided(
    edges: Edges, vertices: NDArray[np.float32], label: NDArray[np.int64], point: NDArray[np.int64],
    divided: NDArray[np.int64],
) -> tuple[Edges, NDArray[np.int64], NDArray[np.int64]]:
    """Divide edges at points on them.

    Returns the edges, the row (E,) of each among the given ones, and vertices (m, 3) as `joined`.
    """
    row, on_line = np.arange(len(edges)), np.zeros((0, 3), np.int64)
    sides = np.unique(divided)
    if len(sides) == 0:
        return edges, row, on_line
    ends, begin = edges.vertices.astype(np.int64), edges.face_first.astype(np.int64)
    at = np.zeros(int(label.max()) + 1, np.int64)  # one vertex of each label
    at[label[point]] = point
    used, number = np.unique(np.concatenate([ends[sides].ravel(), at[label[point]]]), return_inverse=True)
    lines = np.arange(len(sides))
    own = number[: 2 * len(sides)].reshape(-1, 2)
    side, cut = pieces(vertices[used].astype(np.float64), number,
                       np.concatenate([np.repeat(lines, 2), np.searchsorted(sides, divided)]), own, lines)
    count = np.ones(len(edges), np.int64)
    count[sides] = np.bincount(side, minlength=len(sides))
    row = np.repeat(row, count)
    new = ends[row]
    # Both are in the order of the edges. Some are not divided after all: the point is at one of their ends.
    new[np.isin(row, sides)] = used[cut]
    within = cut[:, 1] != own[side, 1]
    on_line = np.column_stack([ends[sides[side[within]]], used[cut[within, 1]]])
    faces = np.diff(begin)[row]
    first = np.concatenate([[0], np.cumsum(faces)])
    source = np.arange(first[-1]) + np.repeat(begin[row] - first[:-1], faces)
    return replace(edges, vertices=new.astype(np.uint32), face_first=first.astype(np.uint32),
                   faces=edges.faces[source], opposite=edges.opposite[source]), row, on_line


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
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], float]:
    """Return which vertices are in the box of another mesh, which meshes' boxes meet others, and the tolerance.

    All vertices count of a mesh that meets the boxes of many.
    """
    near, meets = np.zeros(len(vertices), bool), np.zeros(len(kind), bool)
    meshes = np.flatnonzero((kind >= 0) & (np.diff(mesh_first_vertex[: len(kind) + 1]) > 0))
    if len(meshes) < 2:
        return near, meets, 0.0
    begin, end = mesh_first_vertex[meshes], mesh_first_vertex[meshes + 1]
    # Of vertices between the ends of one mesh and the begin of the next one there are none that count
    bounds = np.column_stack([begin, end]).ravel()[: None if end[-1] < len(vertices) else -1]
    low, high = (limit.reduceat(vertices, bounds, axis=0)[::2] for limit in (np.minimum, np.maximum))
    slack = TOLERANCE * float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
    low, high = low - np.float32(slack), high + np.float32(slack)
    count, pairs = _native.overlapping_boxes(low, high, MANY)
    meets[meshes] = count > 0
    for m in np.flatnonzero(count > MANY):
        near[begin[m] : end[m]] = True
    size = end - begin
    batch = np.cumsum(size[pairs[:, 0]]) // AT_ONCE
    for some in np.split(pairs, np.flatnonzero(np.diff(batch)) + 1):
        one, other = some.T
        pair, place = rows_and_places(size[one])
        vertex = begin[one][pair] + place
        inside = np.ones(len(vertex), bool)
        for axis in range(3):
            x = vertices[vertex, axis]
            inside &= (x >= low[other, axis][pair]) & (x <= high[other, axis][pair])
        near[vertex[inside]] = True
    return near, meets, slack


def _with_faces_of_all(edges: Edges, rows: NDArray[np.int64], places: NDArray[np.int64]) -> Edges:
    """Return the edges, those in one place with the faces of all that are there; their own come first."""
    begin = edges.face_first.astype(np.int64)
    count, sharing = np.diff(begin), np.ones(len(edges), np.uint8)
    number = np.diff(places)
    place = np.repeat(np.arange(len(number)), number)
    # The faces of the edges of each place, one after the other, and where those of each edge begin
    edge, slot = rows_and_places(count[rows])
    all_of_place = begin[rows][edge] + slot
    total = np.add.reduceat(count[rows], places[:-1])
    begin_of_place = np.concatenate([[0], np.cumsum(total)])[:-1]
    own = np.concatenate([[0], np.cumsum(count[rows])])[:-1] - begin_of_place[place]
    count[rows], sharing[rows] = total[place], number[place]
    first = np.concatenate([[0], np.cumsum(count)])
    source = np.arange(first[-1])  # of each new slot, the old one
    source += np.repeat(begin[:-1] - first[:-1], count)
    # Those of an edge are the ones of its place, from its own on
    row, slot = rows_and_places(count[rows])
    turned = (own[row] + slot) % total[place[row]]
    source[first[rows][row] + slot] = all_of_place[begin_of_place[place[row]] + turned]
    return replace(edges, face_first=first.astype(np.uint32), faces=edges.faces[source],
                   opposite=edges.opposite[source], sharing=sharing)

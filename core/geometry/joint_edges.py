"""Edges of several meshes in one place, as where walls meet that are separate objects.

With its own faces alone, such an edge counts as a border or a silhouette by itself, and rounding decides whether rays
through it meet the other meshes. So each of them gets the faces of all, and each sample of it counts as one of their
number. This is right where the meshes move alike, or stand still while the camera or lights move. If one of them moves
against the others, a gap opens or they overlap: then each keeps its own faces.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .topology import Edges, weld

# Vertices of different meshes are in one place up to this part of the size of the scene: positions are the results of
# different computations in single precision.
TOLERANCE = 5e-7
# Edges in one place, above which they are not joined: each would get the faces of all.
MOST = 64
# Boxes of other meshes that vertices of a mesh are compared with.
MANY = 16


@dataclass
class JointEdges:
    """Groups of edges that are in one place.

    Attributes
    ----------
    edge
        (n,) edges, group by group.
    first
        (k + 1,) offsets into `edge`.
    mesh
        (n,) their meshes.
    vertices
        (m, 2) vertices of different meshes that are in one place.
    group_of_pair
        (m,) the group of each of these pairs.
    """

    edge: NDArray[np.int64]
    first: NDArray[np.int64]
    mesh: NDArray[np.int64]
    vertices: NDArray[np.int64]
    group_of_pair: NDArray[np.int64]

    def alike(self, moving: Iterable[int]) -> NDArray[np.bool_]:
        """Return of which groups all meshes move, or none."""
        moves = np.isin(self.mesh, list(moving)).astype(np.int64)
        count = np.add.reduceat(moves, self.first[:-1]) if len(self.edge) else moves
        return (count == 0) | (count == np.diff(self.first))


def joint_edges(
    edges: Edges, vertices: NDArray[np.float32], mesh_first_vertex: NDArray[np.int64], mesh_of_edge: NDArray[np.int64],
    kind: NDArray[np.int64],
) -> JointEdges:
    """Find edges of different meshes in one place.

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
    """
    none = np.zeros(0, np.int64)
    nothing = JointEdges(none, np.zeros(1, np.int64), none, none.reshape(0, 2), none)
    near = _near_others(vertices, mesh_first_vertex, kind)
    eligible = np.flatnonzero(near[edges.vertices].all(axis=1))
    if len(eligible) == 0:
        return nothing
    ends = edges.vertices[eligible].astype(np.int64)
    number = np.cumsum(near) - 1
    label = weld(vertices[near].astype(np.float64), TOLERANCE)[number[ends]]
    low, high = label.min(axis=1), label.max(axis=1)
    mesh = mesh_of_edge[eligible]
    order = np.lexsort((eligible, high, low, kind[mesh]))
    key = np.stack([kind[mesh], low, high], axis=1)[order]
    start = np.flatnonzero(np.concatenate([[True], (np.diff(key, axis=0) != 0).any(axis=1)]))
    size = np.diff(start, append=len(order))
    ordered = mesh[order]
    several = np.minimum.reduceat(ordered, start) != np.maximum.reduceat(ordered, start)
    several &= size <= MOST
    chosen = np.repeat(several, size) & (low[order] != high[order])
    if not chosen.any():
        return nothing
    rows = order[chosen]
    group = np.repeat(np.cumsum(several) - 1, size)[chosen]
    first = np.flatnonzero(np.concatenate([[True], np.diff(group) != 0]))
    # The ends of each edge beside those of the group's first edge
    lead = np.repeat(rows[first], np.diff(first, append=len(rows)))
    turned = label[rows, 0] != label[lead, 0]
    pairs = np.stack([ends[lead].ravel(), np.where(turned[:, None], ends[rows][:, ::-1], ends[rows]).ravel()], axis=1)
    number = np.repeat(np.cumsum(np.concatenate([[False], np.diff(group) != 0])), 2)
    apart = pairs[:, 0] != pairs[:, 1]
    return JointEdges(eligible[rows], np.append(first, len(rows)), mesh[rows], pairs[apart], number[apart])


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


def with_faces_of_all(edges: Edges, joint: JointEdges, groups: NDArray[np.bool_]) -> Edges:
    """Return the edges, those of the chosen groups with the faces of all edges of their group; their own come first."""
    if not groups.any():
        return edges
    begin = edges.face_first.astype(np.int64)
    slots = {int(e): np.arange(begin[e], begin[e + 1]) for e in joint.edge}
    sharing = np.ones(len(edges), np.uint8)
    for k in np.flatnonzero(groups):
        members = joint.edge[joint.first[k]:joint.first[k + 1]].tolist()
        own = [slots[e][: begin[e + 1] - begin[e]] for e in members]
        for j, e in enumerate(members):
            slots[e] = np.concatenate(own[j:] + own[:j])
            sharing[e] = len(members)
    count = np.diff(begin)
    for e in slots:
        count[e] = len(slots[e])
    first = np.concatenate([[0], np.cumsum(count)])
    source = np.arange(first[-1])  # of each new slot, the old one
    source += np.repeat(begin[:-1] - first[:-1], count)
    for e, old in slots.items():
        source[first[e]:first[e + 1]] = old
    return replace(edges, face_first=first.astype(np.uint32), faces=edges.faces[source],
                   opposite=edges.opposite[source], sharing=sharing)

"""Edges that may be visible from the camera: candidates, their part inside the frustum, and the near faces.

The radiance on the screen is discontinuous along a projected edge if the two sides of the edge differ: at a silhouette,
at an open border, or at a crease between flat-shaded faces. One estimator handles all three cases
(native/derivations.md, A). An edge is left out only if nothing can be discontinuous there: it has two coplanar faces on
opposite sides, with the same orientation and material.

Let o be the camera, t = b - a and N = (a - o) x t. N is normal to the plane through the camera and the edge, and a face
lies on the side + or - of that plane by the sign of N.(third vertex - a). If several faces lie on one side, the ray
just beside the edge hits the one whose plane is least steep: for a ray displaced along g = +-N, the distance to a plane
grows with -(n.g)/(n.(a - o)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.topology import Edges
from .film import Film
from .surfaces import Bools, Floats, Ints, Surfaces, dot

# Two faces are coplanar if the sine of the angle between their normals is below this.
COPLANAR = 1e-6
# A face is seen edge-on if the sine of its angle with the plane through the camera and the edge is below this.
EDGE_ON = 1e-10


@dataclass
class EdgeTable:
    """Edges and their adjacent faces, padded to k >= 2 faces.

    Attributes
    ----------
    vertices
        (E, 2) vertex indices.
    faces
        (E, k) adjacent faces first, then -1.
    third
        (E, k) vertex of each face that is not on the edge.
    """

    vertices: Ints
    faces: Ints
    third: Ints

    @classmethod
    def of(cls, edges: Edges, surfaces: Surfaces) -> EdgeTable:
        """Make the table of a scene; triangles without area are ignored."""
        first = edges.face_first.astype(np.int64)
        edge = np.repeat(np.arange(len(edges)), np.diff(first))
        face, third = edges.faces.astype(np.int64), edges.opposite.astype(np.int64)
        solid = np.linalg.norm(surfaces.M[face], axis=1) > 0.0
        edge, face, third = edge[solid], face[solid], third[solid]
        count = np.bincount(edge, minlength=len(edges))
        slot = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
        width = int(count.max(initial=2))
        faces, thirds = np.full((len(edges), width), -1, np.int64), np.zeros((len(edges), width), np.int64)
        faces[edge, slot], thirds[edge, slot] = face, third
        return cls(edges.vertices.astype(np.int64), faces, thirds)

    def smooth(self, surfaces: Surfaces, position: Floats) -> Bools:
        """(E,) whether nothing can be discontinuous at an edge."""
        out = np.zeros(len(self.faces), bool)
        k = np.flatnonzero((self.faces >= 0).sum(axis=1) == 2)
        f, g = self.faces[k, 0], self.faces[k, 1]
        n0, n1 = surfaces.n[f], surfaces.n[g]
        a, b = position[self.vertices[k, 0]], position[self.vertices[k, 1]]
        across = np.cross(n0, b - a)  # in the plane of the first face, perpendicular to the edge
        opposite = dot(across, position[self.third[k, 0]] - a) * dot(across, position[self.third[k, 1]] - a) < 0.0
        coplanar = (np.linalg.norm(np.cross(n0, n1), axis=1) < COPLANAR) & (dot(n0, n1) > 0.0)
        out[k] = coplanar & opposite & (surfaces.material[f] == surfaces.material[g])
        return out


@dataclass
class SeenEdges:
    """Candidate edges inside the frustum.

    Attributes
    ----------
    ends
        (C, 2) vertex indices; `a`, `t` (C, 3) start and span b - a of the whole edge.
    N
        (C, 3) (a - o) x t.
    low, high
        (C,) the interval [low, high] of u in which the edge is inside the frustum.
    depth
        (C, 2) depths z at low and high; `length` (C,) distance between them on the screen, pixels.
    faces, third
        (C, k) all faces of each edge (-1: none) and their third vertices' positions (C, k, 3).
    near
        (C, 2) nearest face on the side of +N and of -N; -1: none, so the background is visible there.
    """

    ends: Ints
    a: Floats
    t: Floats
    N: Floats
    low: Floats
    high: Floats
    depth: Floats
    length: Floats
    faces: Ints
    third: Floats
    near: Ints


def seen_edges(table: EdgeTable, surfaces: Surfaces, position: Floats, film: Film, requested: Bools) -> SeenEdges:
    """Return the candidates among the edges that are marked in `requested` (E,)."""
    k = np.flatnonzero(requested & (table.faces >= 0).any(axis=1) & ~table.smooth(surfaces, position))
    a, b = position[table.vertices[k, 0]], position[table.vertices[k, 1]]
    low, high = clip(film.frustum(film.camera_space(a)), film.frustum(film.camera_space(b)))
    inside = high > low
    k, a, b, low, high = k[inside], a[inside], b[inside], low[inside], high[inside]
    t = b - a
    ends = np.stack([film.camera_space(a + u[:, None] * t) for u in (low, high)], axis=1)
    length = np.linalg.norm(np.diff(film.project(ends), axis=1)[:, 0], axis=1)
    N = np.cross(a - film.centre, t)
    third = position[table.third[k]]
    near = near_faces(surfaces, a - film.centre, N, table.faces[k], third - a[:, None])
    return SeenEdges(table.vertices[k], a, t, N, low, high, ends[..., 2], length, table.faces[k], third, near)


def clip(at_a: Floats, at_b: Floats) -> tuple[Floats, Floats]:
    """Return the interval of u in [0, 1] on which (1-u) at_a + u at_b >= 0 in every column; empty if low >= high.

    The columns are signed distances from the frustum planes. They are linear in u in camera space, before the
    perspective divide. Only u is clipped; the end points of the edge stay unchanged.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = at_a / (at_a - at_b)
    low = np.where((at_a < 0.0) & (at_b >= 0.0), crossing, 0.0).max(axis=1)
    high = np.where((at_a >= 0.0) & (at_b < 0.0), crossing, 1.0).min(axis=1)
    return low, np.where(((at_a < 0.0) & (at_b < 0.0)).any(axis=1), -1.0, high)


def near_faces(surfaces: Surfaces, toward: Floats, N: Floats, faces: Ints, third: Floats) -> Ints:
    """(C, 2) nearest adjacent face of each edge on the side of +N and of -N; -1 if there is none.

    Parameters
    ----------
    toward
        (C, 3) a - o.
    third
        (C, k, 3) third vertices relative to a.

    Notes
    -----
    N and n.(a - o) are the same at all points of an edge, so one answer holds for the whole edge.
    """
    n = surfaces.n[faces]
    height = np.einsum("ckd,cd->ck", third, N)
    size = np.linalg.norm(third, axis=2) * np.linalg.norm(N, axis=1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = -np.einsum("ckd,cd->ck", n, N) / np.einsum("ckd,cd->ck", n, toward)
    slope = np.where(np.isfinite(slope), slope, np.inf)
    out = []
    for g in (1.0, -1.0):
        there = (faces >= 0) & (g * height > EDGE_ON * size)
        best = np.argmin(np.where(there, g * slope, np.inf), axis=1)[:, None]
        nearest = np.take_along_axis(faces, best, axis=1)[:, 0]
        out.append(np.where(there.any(axis=1), nearest, -1))
    return np.stack(out, axis=1)

"""Edges that may be seen from the camera: candidates, their part inside of the frustum, and the near faces.

A jump of the radiance on the screen runs along a projected edge where its two sides differ: a silhouette, an
open border, or a crease between flat-shaded faces (derivations A3 treats them as one case). An edge is left
out only when nothing can jump there: two faces in one plane, on opposite sides of it, with the same
orientation and material.

With t = b - a and N = (a - o) x t, the vector N is normal to the plane through the camera and the edge; a face
lies on the side + or - of that plane by the sign of N.(third vertex - a). Where several faces lie on one side, the
nearest just off the edge is the one whose plane rises least steeply: along g = +-N the ray meets the plane
at a distance growing with -(n.g)/(n.(a - o)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.topology import Edges
from .film import Film
from .surfaces import Bools, Floats, Ints, Surfaces, dot

# Faces whose normals differ by less than this (sine of the angle) count as coplanar.
COPLANAR = 1e-6
# A third vertex nearer to the camera plane of its edge than this (sine) lies in it: that face is seen edge-on.
EDGE_ON = 1e-10


@dataclass
class EdgeTable:
    """Edges with the faces along them, padded to k >= 2.

    Vertices (E, 2); faces (E, k), the existing ones first, -1 for none; third (E, k) vertices of the faces.
    """

    vertices: Ints
    faces: Ints
    third: Ints

    @classmethod
    def of(cls, edges: Edges, surfaces: Surfaces) -> EdgeTable:
        """The edges of a scene; triangles without area take no part."""
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
        """(E,) edges across which nothing can jump."""
        out = np.zeros(len(self.faces), bool)
        k = np.flatnonzero((self.faces >= 0).sum(axis=1) == 2)
        f, g = self.faces[k, 0], self.faces[k, 1]
        n0, n1 = surfaces.n[f], surfaces.n[g]
        a, b = position[self.vertices[k, 0]], position[self.vertices[k, 1]]
        across = np.cross(n0, b - a)  # in the plane of the first face, across the edge
        opposite = dot(across, position[self.third[k, 0]] - a) * dot(across, position[self.third[k, 1]] - a) < 0.0
        coplanar = (np.linalg.norm(np.cross(n0, n1), axis=1) < COPLANAR) & (dot(n0, n1) > 0.0)
        out[k] = coplanar & opposite & (surfaces.material[f] == surfaces.material[g])
        return out


@dataclass
class SeenEdges:
    """Candidate edges within the frustum.

    Attributes
    ----------
    ends
        (C, 2) vertex indices; `a`, `t` (C, 3) start and span b - a of the whole edge.
    N
        (C, 3) (a - o) x t.
    low, high
        (C,) the part u in [low, high] of the edge within the frustum.
    depth
        (C, 2) depths z at low and high; `length` (C,) pixels on the screen between them.
    faces, third
        (C, k) all faces of each edge (-1: none) and their third vertices' positions (C, k, 3).
    near
        (C, 2) nearest face on the side of +N and of -N; -1: none, something far is seen there.
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


def seen_edges(table: EdgeTable, surfaces: Surfaces, position: Floats, film: Film, wanted: Bools) -> SeenEdges:
    """The candidates among the edges `wanted` (E,)."""
    k = np.flatnonzero(wanted & (table.faces >= 0).any(axis=1) & ~table.smooth(surfaces, position))
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
    """The interval of u in [0, 1] on which (1-u) at_a + u at_b >= 0 in every column; low >= high: none.

    The planes' distances are linear in u in camera space, before the perspective divide. The end
    points themselves stay as they are: only u is clipped.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = at_a / (at_a - at_b)
    low = np.where((at_a < 0.0) & (at_b >= 0.0), crossing, 0.0).max(axis=1)
    high = np.where((at_a >= 0.0) & (at_b < 0.0), crossing, 1.0).min(axis=1)
    return low, np.where(((at_a < 0.0) & (at_b < 0.0)).any(axis=1), -1.0, high)


def near_faces(surfaces: Surfaces, toward: Floats, N: Floats, faces: Ints, third: Floats) -> Ints:
    """(C, 2) nearest of the edges' faces on the side of +N and of -N, -1 where no face lies there.

    toward = a - o (C, 3); third (C, k, 3) relative to a. N and n.(a - o) are the same at all points of an
    edge, so the answer is too.
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

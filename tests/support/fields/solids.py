"""Solids for distance fields: meshes, and the distances from them in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from edgegrad import Field, Mesh
from edgegrad.distance_fields import spline
from tests.support import shapes

F64 = NDArray[np.float64]


def solid(vertices: F64, faces: NDArray[np.integer]) -> Mesh:
    return Mesh(np.asarray(vertices, np.float64), np.asarray(faces, np.int32), ("clay",))


def ball(divisions: int = 4, radius: float = 1.0, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    vertices, faces = shapes.ball(divisions, radius)
    return solid(vertices + np.array(centre), faces)


def box(size: float = 2.0) -> Mesh:
    return solid(*shapes.cube(size))


def ring(major: float = 0.7, minor: float = 0.3, around: int = 64, across: int = 32) -> Mesh:
    """A torus around the z axis."""
    a = np.arange(around) * 2.0 * np.pi / around
    b = np.arange(across) * 2.0 * np.pi / across
    out = major + minor * np.cos(b)[None]
    points = np.stack([np.cos(a)[:, None] * out, np.sin(a)[:, None] * out,
                       np.broadcast_to(minor * np.sin(b), out.shape[:0] + (around, across))], axis=-1)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    p, q = i * across + j, (i + 1) % around * across + j
    r, s = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    return solid(points.reshape(-1, 3), np.concatenate([np.stack([p, q, r], 1), np.stack([p, r, s], 1)]))


def joined(*meshes: Mesh) -> Mesh:
    """The faces of several meshes in one."""
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return solid(np.concatenate([mesh.vertices for mesh in meshes]),
                 np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, first, strict=False)]))


def without(mesh: Mesh, faces: slice | NDArray[np.bool_]) -> Mesh:
    """A mesh with holes: without some of its faces."""
    kept = np.ones(len(mesh.faces), bool)
    kept[faces] = False
    return solid(mesh.vertices, mesh.faces[kept])


def box_distance(p: F64, half: float = 1.0) -> F64:
    q = np.abs(p) - half
    return np.asarray(np.linalg.norm(np.maximum(q, 0.0), axis=-1) + np.minimum(q.max(axis=-1), 0.0))


def ring_distance(p: F64, major: float = 0.7, minor: float = 0.3) -> F64:
    return np.asarray(np.hypot(np.hypot(p[..., 0], p[..., 1]) - major, p[..., 2]) - minor)


def nodes_of(field: Field) -> tuple[F64, F64, float]:
    """Places of a field's nodes in its own space, the values there, and the size of a cell."""
    spacing = field.spacing
    axes = [low + h * np.arange(n + 1) for low, h, n in zip(field.lower, spacing, field.cells, strict=True)]
    return (np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1),
            np.asarray(spline.node_values(field.values.astype(np.float64))), float(spacing[0]))

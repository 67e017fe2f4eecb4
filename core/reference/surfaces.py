"""The triangles of the scene in float64, and the queries that the estimators need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..tables.tables import Tables
from .diffuse_tables import DiffuseTables

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_VALUES = ("albedo", "emission", "point_position", "point_intensity", "sun_direction", "sun_irradiance")


def dot(a: Floats, b: Floats) -> Floats:
    """Row by row inner product."""
    return np.einsum("...i,...i->...", a, b)


def unit(a: Floats) -> Floats:
    """Rows scaled to length 1; rows of zeros stay zeros."""
    length = np.linalg.norm(a, axis=-1, keepdims=True)
    return np.divide(a, length, out=np.zeros_like(a), where=length > 0.0)


class Rows:
    """Base class of dataclasses of arrays with one row per sample; fields may be None."""

    def __getitem__(self, keep: Any) -> Self:
        return type(self)(**{name: None if part is None else part[keep] for name, part in vars(self).items()})


@dataclass
class Surfaces:
    """Triangles p0 p1 p2 with M = (p1 - p0) x (p2 - p0), n = M/|M|; area |M|/2.

    Attributes
    ----------
    corners
        (F, 3) vertex indices.
    p
        (F, 3, 3) positions of the corners.
    M, n
        (F, 3) normals; n is zero for triangles without area.
    material, mesh
        (F,) indices.
    albedo, emission
        (materials, 3); `two_sided` (materials,): whether the back emits too.
    scale
        Largest absolute coordinate; rounding errors of float32 positions are about 6e-8 times this.
    """

    corners: Ints
    p: Floats
    M: Floats
    n: Floats
    material: Ints
    mesh: Ints
    albedo: Floats
    emission: Floats
    two_sided: Bools
    environment: Floats
    point_position: Floats
    point_intensity: Floats
    sun_direction: Floats
    sun_irradiance: Floats
    scale: float

    @classmethod
    def of(cls, tables: Tables) -> Surfaces:
        """Make the surfaces of a scene's tables."""
        corners = tables.faces.astype(np.int64)
        p = tables.vertices.astype(np.float64)[corners]
        M = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        mesh = np.repeat(np.arange(len(tables.visible)), np.diff(tables.mesh_first_face))
        diffuse = DiffuseTables(tables)
        return cls(
            corners=corners,
            p=p,
            M=M,
            n=unit(M),
            material=tables.face_material.astype(np.int64),
            mesh=mesh,
            environment=tables.environment.astype(np.float64),
            two_sided=diffuse.two_sided,
            **{name: getattr(diffuse, name).astype(np.float64) for name in _VALUES},
            scale=float(np.abs(tables.vertices).max(initial=1e-6)),
        )

    @property
    def rounding(self) -> float:
        """Distance between the start of a shadow ray and its surface, and between its end and the light."""
        return 4e-6 * self.scale

    @property
    def contact(self) -> float:
        """Distance below which two surfaces are in contact."""
        return 1e-5 * self.scale

    def point(self, face: Ints, beta: Floats) -> Floats:
        """Points with barycentrics `beta` (n, 3) on the triangles."""
        return np.einsum("nk,nkd->nd", beta, self.p[face])

    def meet(self, face: Ints, origin: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Intersect rays with the planes of their triangles: distance (n,) and barycentrics (n, 3).

        Not finite if a ray is parallel to the plane.
        """
        p0, M = self.p[face, 0], self.M[face]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = dot(M, p0 - origin) / dot(M, direction)
            h = np.cross(M, origin + t[:, None] * direction - p0)
            size = dot(M, M)
            b1 = dot(h, self.p[face, 2] - p0) / size
            b2 = -dot(h, self.p[face, 1] - p0) / size
        return t, np.stack([1.0 - b1 - b2, b1, b2], axis=1)

    def emitted(self, face: Ints, direction: Floats) -> Bools:
        """Whether each triangle emits on the side to which `direction` points."""
        front = dot(self.n[face], direction) > 0.0
        return (front | self.two_sided[self.material[face]]) & (self.emission[self.material[face]].max(axis=1) > 0.0)

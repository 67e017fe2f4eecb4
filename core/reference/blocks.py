"""Adjoint blocks: the dependence of a contribution to a pixel on vertices and colours.

Every term of the derivative of a pixel is  sum_samples colour * (g . velocity). Here colour has one value per channel,
and g is a vector. The velocity is that of an edge point, of a material point, of the hit point of a fixed pixel ray, or
of a normal; colour and g contain all other factors. A *sink* receives these blocks. `Forward` has a tangent and adds
colour * (g . velocity) to an image. `Reverse` has an adjoint image A and scatters (A . colour) g to the gradient. Both
use two primitives, `_vertex` and `_colour`, whose implementations are transposes of each other. Therefore forward and
reverse mode agree up to rounding for equal samples.

==  ================  ==================================  =========================================
E   edge point        v = (1-u) a' + u b'                 a += (1-u) g,  b += u g
M   material point    v = sum beta_i p_i'                 p_i += beta_i g
S   hit of fixed ray  v = d n.m/(n.d)                     M with q = n (g.d)/(n.d)
N   area normal       (p1'-p0')x(p2-p0)+(p1-p0)x(p2'-p0') p1 += (p2-p0)xg, p2 += gx(p1-p0), p0 -= both
n   unit normal       M'/|M| without its part along n     N with g <- (g - n(n.g))/|M|
==  ================  ==================================  =========================================
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import fields

import numpy as np

from ..tables.tables import Tables
from .diffuse_tables import Asked, Derivative
from .surfaces import Bools, Floats, Ints, Surfaces, dot


class Sink(ABC):
    """Receives the blocks. All methods take `pixel` (n,) and `colour` (n, 3), most take `g` (n, 3)."""

    def __init__(self, tables: Tables, surfaces: Surfaces, asked: Asked) -> None:
        self.surfaces = surfaces
        self.asked = asked
        moving: Bools = asked.moving.astype(bool)
        self.moving_vertex: Bools = np.repeat(moving, np.diff(tables.mesh_first_vertex))
        self.moving_face: Bools = moving[surfaces.mesh]

    def edge_point(self, pixel: Ints, colour: Floats, ends: Ints, u: Floats, g: Floats) -> None:
        """Block E of the points (1-u) a + u b on edges with vertices `ends` (n, 2)."""
        self._vertex(pixel, colour, ends[:, 0], (1.0 - u)[:, None] * g)
        self._vertex(pixel, colour, ends[:, 1], u[:, None] * g)

    def material_point(self, pixel: Ints, colour: Floats, face: Ints, beta: Floats, g: Floats) -> None:
        """Block M of the points with barycentrics `beta` on the faces."""
        live = self.moving_face[face]
        corner = self.surfaces.corners[face[live]]
        for i in range(3):
            self._vertex(pixel[live], colour[live], corner[:, i], beta[live, i, None] * g[live])

    def screen_point(self, pixel: Ints, colour: Floats, face: Ints, beta: Floats, direction: Floats, g: Floats) -> None:
        """Block S of the points at which the fixed rays along `direction` hit the moving faces (screen form)."""
        n = self.surfaces.n[face]
        self.material_point(pixel, colour, face, beta, n * (dot(g, direction) / dot(n, direction))[:, None])

    def area_normal(self, pixel: Ints, colour: Floats, face: Ints, g: Floats) -> None:
        """Block N of the unnormalised normals M of the faces."""
        live = self.moving_face[face]
        face, pixel, colour, g = face[live], pixel[live], colour[live], g[live]
        p, corner = self.surfaces.p[face], self.surfaces.corners[face]
        g1 = np.cross(p[:, 2] - p[:, 0], g)
        g2 = np.cross(g, p[:, 1] - p[:, 0])
        for i, gi in enumerate((-g1 - g2, g1, g2)):
            self._vertex(pixel, colour, corner[:, i], gi)

    def unit_normal(self, pixel: Ints, colour: Floats, face: Ints, g: Floats) -> None:
        """Block n of the unit normals of the faces."""
        n = self.surfaces.n[face]
        size = np.linalg.norm(self.surfaces.M[face], axis=1, keepdims=True)
        self.area_normal(pixel, colour, face, (g - n * dot(n, g)[:, None]) / size)

    def albedo(self, pixel: Ints, colour: Floats, material: Ints) -> None:
        """Derivative with respect to the albedo of the materials."""
        self._colour("albedo", pixel, colour, material)

    def emission(self, pixel: Ints, colour: Floats, material: Ints) -> None:
        """Derivative with respect to the emitted radiance of the materials, including area lights."""
        self._colour("emission", pixel, colour, material)

    def point_intensity(self, pixel: Ints, colour: Floats, light: Ints) -> None:
        """Derivative with respect to the radiant intensity of point lights."""
        self._colour("point_intensity", pixel, colour, light)

    def sun_irradiance(self, pixel: Ints, colour: Floats, light: Ints) -> None:
        """Derivative with respect to the irradiance of suns."""
        self._colour("sun_irradiance", pixel, colour, light)

    def environment(self, pixel: Ints, colour: Floats) -> None:
        """Derivative with respect to the radiance of the constant environment."""
        self._colour("environment", pixel, colour, None)

    @abstractmethod
    def _vertex(self, pixel: Ints, colour: Floats, vertex: Ints, g: Floats) -> None:
        """Add colour * (g . velocity of the vertex), or its transpose."""

    @abstractmethod
    def _colour(self, table: str, pixel: Ints, colour: Floats, row: Ints | None) -> None:
        """Add colour * (tangent of the table's row) per channel, or its transpose. `row` None: the table is one row."""


class Forward(Sink):
    """Derivative image (pixels, 3) along one tangent."""

    def __init__(
        self, tables: Tables, surfaces: Surfaces, asked: Asked, tangent: Derivative
    ) -> None:
        super().__init__(tables, surfaces, asked)
        self._tangent = {f.name: np.asarray(getattr(tangent, f.name), np.float64) for f in fields(Derivative)}
        self._tangent["vertices"] = np.where(self.moving_vertex[:, None], self._tangent["vertices"], 0.0)
        self.image = np.zeros((tables.width * tables.height, 3))

    def _vertex(self, pixel: Ints, colour: Floats, vertex: Ints, g: Floats) -> None:
        self._add(pixel, colour * dot(g, self._tangent["vertices"][vertex])[:, None])

    def _colour(self, table: str, pixel: Ints, colour: Floats, row: Ints | None) -> None:
        rate = self._tangent[table]
        self._add(pixel, colour * (rate if row is None else rate[row]))

    def _add(self, pixel: Ints, value: Floats) -> None:
        for c in range(3):
            self.image[:, c] += np.bincount(pixel, value[:, c], len(self.image))


class Reverse(Sink):
    """Gradient of <A, image> for an adjoint image A (pixels, 3)."""

    def __init__(self, tables: Tables, surfaces: Surfaces, asked: Asked, adjoint: Floats) -> None:
        super().__init__(tables, surfaces, asked)
        self._adjoint = adjoint
        self._gradient = dict(vars(Derivative.zero(tables)))

    @property
    def gradient(self) -> Derivative:
        """The accumulated gradient; zero for vertices of meshes that are not requested."""
        parts = dict(self._gradient)
        parts["vertices"] = np.where(self.moving_vertex[:, None], parts["vertices"], 0.0)
        return Derivative(**parts)

    def _vertex(self, pixel: Ints, colour: Floats, vertex: Ints, g: Floats) -> None:
        self._scatter(self._gradient["vertices"], vertex, dot(self._adjoint[pixel], colour)[:, None] * g)

    def _colour(self, table: str, pixel: Ints, colour: Floats, row: Ints | None) -> None:
        value = self._adjoint[pixel] * colour
        if row is None:
            self._gradient[table] += value.sum(axis=0)
        else:
            self._scatter(self._gradient[table], row, value)

    @staticmethod
    def _scatter(table: Floats, row: Ints, value: Floats) -> None:
        for c in range(3):
            table[:, c] += np.bincount(row, value[:, c], len(table))

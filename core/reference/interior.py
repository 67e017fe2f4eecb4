"""Interior term: derivative of the radiance of a pixel sample, with fixed visibility.

The camera ray is fixed, so its hit x1 moves along the ray (screen form). A point y of an area light moves with its
triangle (material form), so that the borders of the light need no boundary term. Let f = albedo/pi, w = (y - x1)/r,
c1 = n.w, c2 = -w.M_y and h0 = f L_e/(2 r^2 P), with the notation of `light`. The sample h = h0 c1 c2 has the adjoints

  y    : (h0/r) (n c2 - M_y c1 - 4 w c1 c2)         (material point)
  x1   : the negative of that                        (hit of the fixed ray)
  n    : h0 c2 w                                     (unit normal)
  M_y  : -h0 c1 w                                    (area normal)

point light, h = f I c1/r^2:  x1: -(f I/r^3)(n - 3 c1 w),  n: (f I/r^2) w;     sun, h = f E c1:  n: f E w.

Constant environment: only the rotation of the normal contributes, f L_env int V n'.w dw. The integral of w over the
hemisphere is parallel to n, and n' is perpendicular to n, so int V n'.w dw = -int (1 - V) n'.w dw. The estimator uses
the second form, a sum over blocked directions: it is exactly zero if nothing is blocked.

Colours: h is linear in each colour, so the derivative is h without that factor.
"""

from __future__ import annotations

import numpy as np

from .blocks import Sink
from .film import Film
from .light import Arrival, Lighting, Points
from .radiance import Progress, camera_samples, hits
from .sampling import mixed_direction
from .surfaces import Floats, Ints, dot


def interior(
    film: Film, lighting: Lighting, sink: Sink, *, spp: int, seed: int, max_depth: int, progress: Progress | None
) -> None:
    """Send the blocks of the interior term to the sink."""
    s = lighting.surfaces
    weight = 1.0 / spp
    for samples in camera_samples(film, lighting, spp, seed, stream=1):
        missed = samples.pixel[samples.face < 0]
        sink.environment(missed, np.full((len(missed), 3), weight))
        row, points, beta = hits(film, lighting, samples)
        pixel, material = samples.pixel[row], s.material[points.face]
        front = (points.side > 0.0) | s.two_sided[material]
        sink.emission(pixel[front], np.full((int(front.sum()), 3), weight), material[front])
        if max_depth >= 2:
            hit = _Hit(pixel, samples.direction[row], points, beta, weight * s.albedo[material] / np.pi, weight)
            xi = samples.xi[row]
            if len(lighting.choice):
                _area(lighting, sink, hit, xi[:, :3])
            for k in range(len(s.point_intensity)):
                _point(lighting, sink, hit, k)
            for k in range(len(s.sun_irradiance)):
                _sun(lighting, sink, hit, k)
            if s.environment.any() or sink.asked.environment:
                _environment(lighting, sink, hit, xi[:, 3:5])
        if progress is not None:
            progress(samples.fraction)


class _Hit:
    """Camera hits: pixel, ray direction, shading points, barycentrics, and f = albedo/pi times the sample weight."""

    def __init__(
        self, pixel: Ints, direction: Floats, points: Points, beta: Floats, f: Floats, weight: float
    ) -> None:
        self.pixel, self.direction, self.points, self.beta = pixel, direction, points, beta
        self.f, self.weight = f, weight

    def screen_point(self, sink: Sink, row: Ints, colour: Floats, g: Floats) -> None:
        """Send block S of the hits `row`."""
        sink.screen_point(self.pixel[row], colour, self.points.face[row], self.beta[row], self.direction[row], g)

    def normal(self, sink: Sink, row: Ints, colour: Floats, g: Floats) -> None:
        """Send block n of the normals, oriented to the viewer, at the hits `row`."""
        sink.unit_normal(self.pixel[row], colour, self.points.face[row], self.points.side[row, None] * g)


def _albedo(lighting: Lighting, sink: Sink, hit: _Hit, got: Arrival) -> None:
    """Send the derivative by the albedo, irradiance/pi."""
    material = lighting.surfaces.material[hit.points.face[got.row]]
    sink.albedo(hit.pixel[got.row], hit.weight / np.pi * got.colour * got.factor[:, None], material)


def _area(lighting: Lighting, sink: Sink, hit: _Hit, xi: Floats) -> None:
    s = lighting.surfaces
    got = lighting.visible(hit.points, lighting.area(hit.points, xi))
    assert got.face is not None and got.beta is not None
    assert got.c2 is not None and got.flip is not None and got.base is not None
    row, pixel = got.row, hit.pixel[got.row]
    _albedo(lighting, sink, hit, got)
    sink.emission(pixel, hit.f[row] * got.factor[:, None], got.source)
    colour = hit.f[row] * got.colour
    n, w, M = hit.points.normal[row], got.w, got.flip[:, None] * s.M[got.face]
    c1, c2, base, r = (a[:, None] for a in (got.c1, got.c2, got.base, got.distance))
    g = base / r * (n * c2 - M * c1 - 4.0 * w * c1 * c2)
    sink.material_point(pixel, colour, got.face, got.beta, g)
    sink.area_normal(pixel, colour, got.face, -got.flip[:, None] * base * c1 * w)
    hit.screen_point(sink, row, colour, -g)
    hit.normal(sink, row, colour, base * c2 * w)


def _point(lighting: Lighting, sink: Sink, hit: _Hit, light: int) -> None:
    got = lighting.visible(hit.points, lighting.point(hit.points, light))
    row, pixel = got.row, hit.pixel[got.row]
    _albedo(lighting, sink, hit, got)
    sink.point_intensity(pixel, hit.f[row] * got.factor[:, None], got.source)
    colour = hit.f[row] * got.colour
    n, w, c1, r = hit.points.normal[row], got.w, got.c1[:, None], got.distance[:, None]
    hit.screen_point(sink, row, colour, -(n - 3.0 * c1 * w) / r**3)
    hit.normal(sink, row, colour, w / r**2)


def _sun(lighting: Lighting, sink: Sink, hit: _Hit, light: int) -> None:
    got = lighting.visible(hit.points, lighting.sun(hit.points, light))
    _albedo(lighting, sink, hit, got)
    sink.sun_irradiance(hit.pixel[got.row], hit.f[got.row] * got.factor[:, None], got.source)
    hit.normal(sink, got.row, hit.f[got.row] * got.colour, got.w)


def _environment(lighting: Lighting, sink: Sink, hit: _Hit, xi: Floats) -> None:
    s = lighting.surfaces
    n = hit.points.normal
    w, density = mixed_direction(n, xi)
    blocked = lighting.blocked(hit.points, np.arange(len(w)), w, np.full(len(w), np.inf))
    # int V c1 dw = pi - int (1 - V) c1 dw
    open_ = np.pi - np.where(blocked, dot(n, w) / density, 0.0)
    material = s.material[hit.points.face]
    sink.albedo(hit.pixel, hit.weight / np.pi * s.environment * open_[:, None], material)
    sink.environment(hit.pixel, hit.f * open_[:, None])
    row = np.flatnonzero(blocked)
    hit.normal(sink, row, hit.f[row] * s.environment, -w[row] / density[row, None])

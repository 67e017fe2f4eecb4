"""Direct illumination: irradiance at a point from the lights of the scene, and its radiance towards the viewer.

A diffuse point x with the albedo rho and the unit normal n, oriented to the viewer, has the radiance

  L = L_e(x) + rho/pi * ( int L_e(y) V c1 cos_y / r^2 dA_y  +  sum I V c1 / r^2  +  sum E V c1  +  int L_env V c1 dw )

Here w is the unit direction from x to the light, c1 = n.w > 0, and V the visibility. Area lights are sampled by area: a
triangle with the probability P, then a point y, uniform on it. Let M_y be the unnormalised normal of the triangle,
oriented to x, and c2 = -w.M_y, so that cos_y times the area of the triangle is c2/2. Then one sample of the irradiance
is L_e c1 c2 / (2 r^2 P). The constant environment is sampled with a density proportional to c1, so one sample is pi
L_env V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .rays import Rays
from .sampling import LightChoice, cosine_direction
from .surfaces import Bools, Floats, Ints, Rows, Surfaces, dot


@dataclass
class Points(Rows):
    """Shading points.

    Attributes
    ----------
    x, face
        (n, 3) position and (n,) triangle.
    normal
        (n, 3) unit normal of the triangle, oriented to the viewer; `side` (n,) is +1 if it equals the geometric
        normal, else -1.
    ignore
        (n, k) faces that shadow rays ignore: the own triangle, or all faces of an edge.
    lift
        (n,) distance along the normal at which shadow rays start.
    arms
        (n, j, 3) half-planes that contain the edge on which a point lies, each given by its direction perpendicular
        to the edge (zeros: none). `along` (n, 3) is the direction of the own face, also perpendicular to the edge.
        None for points that are not on an edge.
    """

    x: Floats
    face: Ints
    normal: Floats
    side: Floats
    ignore: Ints
    lift: Floats
    along: Floats | None = None
    arms: Floats | None = None

    @classmethod
    def inside(cls, surfaces: Surfaces, x: Floats, face: Ints, view: Floats) -> Points:
        """Make points inside triangles, seen along the directions `view`."""
        side = np.where(dot(surfaces.n[face], view) < 0.0, 1.0, -1.0)
        normal = side[:, None] * surfaces.n[face]
        return cls(x, face, normal, side, face[:, None], np.full(len(x), surfaces.rounding))

    def hidden_by_arms(self, row: Ints, w: Floats) -> Bools:
        """Whether another face of the edge on which a point lies blocks the direction `w` (rule A4 in derivations.md).

        Angles are measured in the plane perpendicular to the edge, from the own face (0) towards the normal (pi/2). An
        arm blocks w if 0 < angle(arm) < angle(w) < pi.
        """
        if self.arms is None or self.along is None:
            return np.zeros(len(w), bool)
        b1, b2 = self.along[row], self.normal[row]
        angle = np.arctan2(dot(w, b2), dot(w, b1))
        arms = self.arms[row]
        arm = np.arctan2(dot(arms, b2[:, None]), dot(arms, b1[:, None]))
        return ((arm > 0.0) & (arm < angle[:, None])).any(axis=1)


@dataclass
class Arrival(Rows):
    """Light of one kind that may reach some of the points: irradiance = colour * factor if visible.

    Attributes
    ----------
    row
        (m,) indices into the points.
    w, distance
        (m, 3) unit direction towards the light, (m,) its distance (infinite for suns).
    c1
        (m,) cosine at the point.
    colour
        (m, 3) radiance, radiant intensity or irradiance of the light; `source` (m,) is its row in the table of
        the scene.
    factor
        (m,) all other factors of the irradiance.
    face, beta, c2, flip, base
        Area lights only: triangle, barycentrics, c2 = -w.(flip M_y), and factor/(c1 c2).
    """

    row: Ints
    w: Floats
    distance: Floats
    c1: Floats
    colour: Floats
    source: Ints
    factor: Floats
    face: Ints | None = None
    beta: Floats | None = None
    c2: Floats | None = None
    flip: Floats | None = None
    base: Floats | None = None


class Lighting:
    """Direct illumination of the surfaces of a scene."""

    def __init__(self, surfaces: Surfaces, rays: Rays, choice: LightChoice | None = None) -> None:
        self.surfaces = surfaces
        self.rays = rays
        if choice is None:
            choice = LightChoice(surfaces, np.zeros(len(surfaces.emission), bool))
        self.choice = choice

    def with_possible(self, emitting: NDArray[np.uint8]) -> Lighting:
        """Return the same lights, which also sample materials marked in `emitting`, even if their emission is zero."""
        if not emitting.any():
            return self
        return Lighting(self.surfaces, self.rays, LightChoice(self.surfaces, emitting.astype(bool)))

    def area(self, points: Points, xi: Floats) -> Arrival:
        """One sample of the emissive triangles per point, without visibility; `xi` (n, 3) are random numbers."""
        s = self.surfaces
        face, beta, probability = self.choice.sample(xi)
        to = s.point(face, beta) - points.x
        r = np.linalg.norm(to, axis=1)
        w = np.divide(to, r[:, None], out=np.zeros_like(to), where=r[:, None] > 0.0)
        c1 = dot(points.normal, w)
        facing = dot(w, s.M[face])
        material = s.material[face]
        flip = np.where((facing > 0.0) & s.two_sided[material], -1.0, 1.0)
        c2 = -flip * facing
        keep = np.flatnonzero((c1 > 0.0) & (c2 > 0.0) & (face != points.face))
        base = 1.0 / (2.0 * r[keep] ** 2 * probability[keep])
        return Arrival(
            keep, w[keep], r[keep], c1[keep], s.emission[material[keep]], material[keep], base * c1[keep] * c2[keep],
            face[keep], beta[keep], c2[keep], flip[keep], base,
        )

    def point(self, points: Points, light: int) -> Arrival:
        """Irradiance from the point light `light` at every point, without visibility."""
        s = self.surfaces
        to = s.point_position[light] - points.x
        r = np.linalg.norm(to, axis=1)
        w = to / np.maximum(r, 1e-30)[:, None]
        c1 = dot(points.normal, w)
        keep = np.flatnonzero(c1 > 0.0)
        colour = np.broadcast_to(s.point_intensity[light], (len(keep), 3))
        factor = c1[keep] / r[keep] ** 2
        return Arrival(keep, w[keep], r[keep], c1[keep], colour, np.full(len(keep), light), factor)

    def sun(self, points: Points, light: int) -> Arrival:
        """Irradiance from the sun `light` at every point, without visibility."""
        s = self.surfaces
        w = np.broadcast_to(-s.sun_direction[light], points.x.shape)
        c1 = dot(points.normal, w)
        keep = np.flatnonzero(c1 > 0.0)
        colour = np.broadcast_to(s.sun_irradiance[light], (len(keep), 3))
        far = np.full(len(keep), np.inf)
        return Arrival(keep, w[keep], far, c1[keep], colour, np.full(len(keep), light), c1[keep])

    def blocked(self, points: Points, row: Ints, w: Floats, distance: Floats, face: Ints | None = None) -> Bools:
        """Whether something blocks the segment from points `row` in direction `w`, of length `distance`.

        `face`, the triangle of the light itself, never blocks.
        """
        x = points.x[row] + points.lift[row, None] * points.normal[row]
        ignore = points.ignore[row]
        if face is not None:
            ignore = np.concatenate([ignore, face[:, None]], axis=1)
        before = distance - self.surfaces.rounding - 1e-5 * np.where(np.isfinite(distance), distance, 0.0)
        out = points.hidden_by_arms(row, w)
        open_ = np.flatnonzero(~out)
        out[open_] = self.rays.blocked(x[open_], w[open_], before[open_], ignore[open_])
        return out

    def visible(self, points: Points, arrival: Arrival) -> Arrival:
        """Return the entries whose light is not blocked."""
        return arrival[~self.blocked(points, arrival.row, arrival.w, arrival.distance, arrival.face)]

    def emitted(self, points: Points) -> Floats:
        """(n, 3) radiance emitted towards the viewer."""
        s = self.surfaces
        on = s.emitted(points.face, points.normal)
        return np.where(on[:, None], s.emission[s.material[points.face]], 0.0)

    def radiance(self, points: Points, xi: Floats, max_depth: int) -> Floats:
        """(n, 3) radiance towards the viewer, for random numbers `xi` (n, LIGHT_DIMENSIONS)."""
        s = self.surfaces
        out = self.emitted(points)
        if max_depth < 2:
            return out
        irradiance = np.zeros_like(out)
        # A row appears at most once in each arrival, so fancy-index addition adds all contributions.
        if len(self.choice):
            got = self.visible(points, self.area(points, xi[:, :3]))
            irradiance[got.row] += got.colour * got.factor[:, None]
        for k in range(len(s.point_intensity)):
            got = self.visible(points, self.point(points, k))
            irradiance[got.row] += got.colour * got.factor[:, None]
        for k in range(len(s.sun_irradiance)):
            got = self.visible(points, self.sun(points, k))
            irradiance[got.row] += got.colour * got.factor[:, None]
        if s.environment.any():
            w = cosine_direction(points.normal, xi[:, 3:5])
            rows = np.arange(len(w))
            free = ~self.blocked(points, rows, w, np.full(len(w), np.inf))
            irradiance += np.pi * s.environment * free[:, None]
        return out + s.albedo[s.material[points.face]] / np.pi * irradiance

"""Shadow boundary term: edges that move between a receiver and a light. Formula (S), as an integral over the edges:

  dI/dtheta = sum_edges int du int dw  J f L_e sigma (t x w).[e' - lambda x1' - (1 - lambda) y']

The point e = (1-u) a + u b lies on an edge with t = b - a. The direction w goes from a point y of a light through e to
the receiver x1, the first surface behind e, where f = albedo/pi. J = f_px^2 |n1.p|/z^3 is the area on the screen per
area of the receiver, and lambda = |e - y|/|x1 - y|. The velocity x1' is along the ray of its pixel (screen form), and y
moves with its triangle (material form). sigma = sign((t x w).(third vertex - e)) is the side of the occluder: the edge
is a silhouette for this segment only if sigma is equal for all faces of the edge.

Sampling by kind of light:

area light    y by area: dw = |n_y.w| dA_y/|e - y|^2, one sample of L_e dw is L_e |M_y.w| / (2 P |e - y|^2)
point light   L_e dw -> I/|e - p|^2, y fixed
sun           L_e dw -> E,           y at infinity: lambda = 1
environment   cosine between w and t uniform, azimuth about t uniform in the two wedges in which both faces lie on
              one side of w. With the angle delta between the faces, each wedge has the angle alpha = pi - delta, so
              the density is 1/(4 alpha); lambda = 1

Edges are sampled in proportion to their length (times alpha for the environment) and u uniformly, stratified over the
list of all edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .blocks import Sink
from .edges import EdgeTable
from .film import Film
from .light import Lighting, Points
from .radiance import CHUNK, Progress
from .sampling import LIGHT_DIMENSIONS
from .surfaces import Floats, Ints, Rows, dot, unit


@dataclass
class Segments(Rows):
    """Segments from lights through edge points: edge (n,), u (n,), e (n, 3), direction w (n, 3).

    `distance` (n,) is |e - y|, infinite for suns. `colour` (n, 3) is L_e dw divided by all densities. `face` and `beta`
    are the triangle and barycentrics of y; face -1: y is not on a triangle.
    """

    edge: Ints
    u: Floats
    e: Floats
    w: Floats
    distance: Floats
    colour: Floats
    face: Ints
    beta: Floats


class Occluders:
    """Edges that can be silhouettes, with their geometry (E, ...)."""

    def __init__(self, table: EdgeTable, lighting: Lighting, position: Floats) -> None:
        s = lighting.surfaces
        k = np.flatnonzero((table.faces >= 0).any(axis=1) & ~table.smooth(s, position))
        self.ends, self.faces = table.vertices[k], table.faces[k]
        self.a = position[self.ends[:, 0]]
        self.t = position[self.ends[:, 1]] - self.a
        self.third = position[table.third[k]] - self.a[:, None]
        self.length = np.linalg.norm(self.t, axis=1)
        # Unit vectors perpendicular to the edge into each face, and the angle between two faces (0 unless there are
        # two).
        axis = unit(self.t)
        across = unit(self.third - np.einsum("kfd,kd->kf", self.third, axis)[..., None] * axis[:, None])
        count = (self.faces >= 0).sum(axis=1)
        cosine = np.clip(dot(across[:, 0], across[:, 1]), -1.0, 1.0)
        self.delta = np.where(count == 2, np.arccos(cosine), 0.0)
        # The first face has the azimuth 0, the second one +delta.
        self.b1 = across[:, 0]
        turn = np.cross(axis, self.b1)
        self.b2 = np.where(dot(turn, across[:, 1])[:, None] < 0.0, -turn, turn)
        self.axis = axis


def shadow(
    film: Film,
    lighting: Lighting,
    table: EdgeTable,
    position: Floats,
    sink: Sink,
    *,
    spp: int,
    seed: int,
    max_depth: int,
    progress: Progress | None,
) -> None:
    """Send the blocks of the shadow boundary term to the sink; spp samples per pixel and light."""
    s = lighting.surfaces
    edges = Occluders(table, lighting, position)
    # If nothing moves, no shadow moves.
    if max_depth < 2 or not sink.moving_face.any() or not len(edges.length):
        return
    kinds: list[tuple[str, int]] = [("area", 0)] if len(lighting.choice) else []
    kinds += [("point", k) for k in range(len(s.point_intensity))]
    kinds += [("sun", k) for k in range(len(s.sun_irradiance))]
    kinds += [("environment", 0)] if s.environment.any() else []
    count = spp * film.pixels
    for index, (kind, light) in enumerate(kinds):
        weight = edges.length * (np.pi - edges.delta) if kind == "environment" else edges.length
        for first in range(0, count, CHUNK):
            generator = np.random.default_rng([seed, 3, index, first])
            stratum = np.arange(first, min(first + CHUNK, count))
            edge, u, density = _edge_points(weight, stratum, count, generator)
            xi = generator.random((len(stratum), LIGHT_DIMENSIONS))
            segments = _light(lighting, edges, kind, light, edge, u, xi)
            segments.colour = segments.colour / (density[segments.edge] * count)[:, None]
            _connect(film, lighting, edges, segments, sink)
            if progress is not None:
                progress((index + (first + len(stratum)) / count) / len(kinds))


def _edge_points(
    weight: Floats, stratum: Ints, count: int, generator: np.random.Generator
) -> tuple[Ints, Floats, Floats]:
    """Sample edges in proportion to their weight, and u uniformly; also return the probability of every edge."""
    cumulated = np.cumsum(weight)
    along = (stratum + generator.random(len(stratum))) / count * cumulated[-1]
    k = np.minimum(np.searchsorted(cumulated, along, side="right"), len(weight) - 1)
    return k, np.clip((along - (cumulated[k] - weight[k])) / weight[k], 0.0, 1.0), weight / cumulated[-1]


def _light(
    lighting: Lighting, edges: Occluders, kind: str, light: int, edge: Ints, u: Floats, xi: Floats
) -> Segments:
    """Make segments from a light through edge points."""
    s = lighting.surfaces
    n = len(edge)
    e = edges.a[edge] + u[:, None] * edges.t[edge]
    face, beta = np.full(n, -1), np.zeros((n, 3))
    distance = np.full(n, np.inf)
    if kind == "area":
        face, beta, probability = lighting.choice.sample(xi[:, :3])
        to = e - s.point(face, beta)
        distance = np.maximum(np.linalg.norm(to, axis=1), 1e-30)
        w = to / distance[:, None]
        material = s.material[face]
        facing = dot(s.M[face], w)
        solid = np.where(s.two_sided[material], np.abs(facing), np.maximum(facing, 0.0))
        colour = s.emission[material] * (solid / (2.0 * probability * distance**2))[:, None]
    elif kind == "point":
        to = e - s.point_position[light]
        distance = np.maximum(np.linalg.norm(to, axis=1), 1e-30)
        w = to / distance[:, None]
        colour = s.point_intensity[light] / distance[:, None] ** 2
    elif kind == "sun":
        w = np.broadcast_to(s.sun_direction[light], e.shape)
        colour = np.broadcast_to(s.sun_irradiance[light], e.shape)
    else:
        alpha = np.pi - edges.delta[edge]
        cosine = 2.0 * xi[:, 0] - 1.0
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        turn = 2.0 * xi[:, 1]
        azimuth = edges.delta[edge] + np.mod(turn, 1.0) * alpha + np.pi * np.floor(turn)
        w = cosine[:, None] * edges.axis[edge] + sine[:, None] * (
            np.cos(azimuth)[:, None] * edges.b1[edge] + np.sin(azimuth)[:, None] * edges.b2[edge]
        )
        colour = s.environment * (4.0 * alpha)[:, None]
    return Segments(edge, u, e, w, distance, colour, face, beta)


def _connect(film: Film, lighting: Lighting, edges: Occluders, segments: Segments, sink: Sink) -> None:
    """Connect the segments to their receivers and these to the camera, and send the blocks."""
    s = lighting.surfaces
    segments = segments[segments.colour.any(axis=1)]
    # An edge is a silhouette if all its faces lie on one side of the plane through the edge and the light. Faces that
    # are seen edge-on from the light do not count.
    across = np.cross(edges.t[segments.edge], segments.w)
    third = edges.third[segments.edge]
    height = np.einsum("nkd,nd->nk", third, across)
    size = np.linalg.norm(third, axis=2) * np.linalg.norm(across, axis=1)[:, None]
    side = np.where((edges.faces[segments.edge] >= 0) & (np.abs(height) > 1e-10 * size), np.sign(height), 0.0)
    sigma = np.where((side >= 0.0).all(axis=1), 1.0, -1.0) * (side != 0.0).any(axis=1)
    silhouette = ~((side > 0.0).any(axis=1) & (side < 0.0).any(axis=1)) & (sigma != 0.0)
    segments, across, sigma = segments[silhouette], across[silhouette], sigma[silhouette]

    ignore = edges.faces[segments.edge]
    face, gap = lighting.rays.closest(
        segments.e, segments.w, np.zeros(len(sigma)), np.full(len(sigma), np.inf), ignore
    )
    # A receiver in contact with the edge is handled by the primary boundary term.
    keep = np.flatnonzero((face >= 0) & (gap > s.contact))
    before = segments.distance[keep] - s.rounding - 1e-5 * np.minimum(segments.distance[keep], 1e30)
    also = np.concatenate([ignore[keep], segments.face[keep, None]], axis=1)
    keep = keep[~lighting.rays.blocked(segments.e[keep], -segments.w[keep], before, also)]
    segments, across, sigma, face = segments[keep], across[keep], sigma[keep], face[keep]

    gap, _ = s.meet(face, segments.e, segments.w)
    x = segments.e + gap[:, None] * segments.w
    c = film.camera_space(x)
    front = np.isfinite(gap) & (gap > 0.0) & (film.frustum(c) >= 0.0).all(axis=1)
    segments, across, sigma, face = segments[front], across[front], sigma[front], face[front]
    gap, x, c = gap[front], x[front], c[front]
    p = x - film.centre
    span = np.linalg.norm(p, axis=1)
    direction = p / span[:, None]
    points = Points.inside(s, x, face, direction)
    lit = dot(points.normal, segments.w) < 0.0
    near, _ = film.limits(direction)
    rows = np.flatnonzero(lit)
    seen = ~lighting.blocked(points, rows, -direction[rows], (span - near)[rows])
    keep = rows[seen]
    pixel = film.pixel_of(film.project(c[keep]))
    keep, pixel = keep[pixel >= 0], pixel[pixel >= 0]

    got, x_face = segments[keep], face[keep]
    beta = s.meet(x_face, np.broadcast_to(film.centre, (len(keep), 3)), direction[keep])[1]
    screen_area = film.focal**2 * np.abs(dot(s.n[x_face], p[keep])) / c[keep, 2] ** 3
    colour = got.colour * s.albedo[s.material[x_face]] * (screen_area / np.pi)[:, None]
    G = (sigma[:, None] * across)[keep]
    # lambda = |e - y|/(|e - y| + |x1 - e|), which is 1 for lights at infinity
    far_weight = (1.0 / (1.0 + gap[keep] / got.distance))[:, None]
    sink.edge_point(pixel, colour, edges.ends[got.edge], got.u, G)
    sink.screen_point(pixel, colour, x_face, beta, direction[keep], -far_weight * G)
    on = np.flatnonzero(got.face >= 0)
    sink.material_point(pixel[on], colour[on], got.face[on], got.beta[on], -((1.0 - far_weight) * G)[on])

"""Primary boundary term: what moving edges do to the pixels they cross. Formula (P):

  dI/dtheta = sum_edges int du (L- - L+) (f^2/z^3) N.e',    e = (1-u) a + u b,  N = (e - o) x t,  t = b - a

with L+- the radiance seen just beside the edge on the side to which +-N points, f the focal length in pixels and z the
depth of e. There are no screen normals: (f^2/z^3) N.e' du is the area in pixels that the edge sweeps.

Sampling: edges by their length on the screen inside of the frustum, uniformly along it, stratified over the
whole list. With tau the position along the clipped edge on the screen, z0 and z1 the depths of its ends,
u runs from low to high as tau z0/((1-tau) z1 + tau z0).

Both sides are evaluated by construction: the near side is the adjacent face itself at e, the far side what one
ray from the camera through e meets behind e with all faces of the edge ignored; where that ray meets something
before e, the edge isn't seen. Both sides use the same random numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .blocks import Sink
from .edges import SeenEdges
from .film import Film
from .light import Lighting, Points
from .radiance import CHUNK, Progress
from .sampling import LIGHT_DIMENSIONS
from .surfaces import Bools, Floats, Ints, unit


@dataclass
class EdgeSamples:
    """Visible points on edges: edge (n,), u (n,), position e (n, 3), pixel (n,), weight f^2/z^3/pdf (n,).

    `xi` are random numbers for the light, `direction` and `distance` lead from the camera to e, `far` is
    the face behind e (-1: none).
    """

    edge: Ints
    u: Floats
    e: Floats
    pixel: Ints
    weight: Floats
    xi: Floats
    direction: Floats
    distance: Floats
    far: Ints

    def __getitem__(self, keep: Bools) -> EdgeSamples:
        return EdgeSamples(**{name: part[keep] for name, part in vars(self).items()})


def primary(
    film: Film,
    lighting: Lighting,
    edges: SeenEdges,
    sink: Sink,
    *,
    spp: int,
    seed: int,
    max_depth: int,
    progress: Progress | None,
) -> None:
    """Send the blocks of the primary boundary term to the sink."""
    total = float(edges.length.sum())
    if total > 0.0:
        # spp samples per pixel of edge, but no more than the interior term takes for the whole picture
        count = math.ceil(spp * min(total, film.pixels))
        for samples, done in _edge_samples(film, lighting, edges, count, seed):
            plus, minus = (_side(film, lighting, edges, samples, side, max_depth) for side in (0, 1))
            colour = samples.weight[:, None] * (minus - plus)
            sink.edge_point(samples.pixel, colour, edges.ends[samples.edge], samples.u, edges.N[samples.edge])
            if progress is not None:
                progress(done)


def _edge_samples(
    film: Film, lighting: Lighting, edges: SeenEdges, count: int, seed: int
) -> Iterator[tuple[EdgeSamples, float]]:
    """The visible ones among `count` samples, in chunks, with the fraction done."""
    cumulated = np.cumsum(edges.length)
    total = cumulated[-1]
    for first in range(0, count, CHUNK):
        generator = np.random.default_rng([seed, 2, first])
        stratum = np.arange(first, min(first + CHUNK, count))
        along = (stratum + generator.random(len(stratum))) / count * total
        k = np.minimum(np.searchsorted(cumulated, along, side="right"), len(cumulated) - 1)
        length = edges.length[k]
        tau = np.clip((along - (cumulated[k] - length)) / length, 0.0, 1.0)
        z0, z1 = edges.depth[k].T
        blend = (1.0 - tau) * z1 + tau * z0
        span = edges.high[k] - edges.low[k]
        u = edges.low[k] + span * tau * z0 / blend
        du_dtau = span * z0 * z1 / blend**2
        e = edges.a[k] + u[:, None] * edges.t[k]
        c = film.camera_space(e)
        direction = e - film.centre
        distance = np.linalg.norm(direction, axis=1)
        samples = EdgeSamples(
            edge=k,
            u=u,
            e=e,
            pixel=film.pixel_of(film.project(c)),
            # pdf of u: (length/total) / (du/dtau); and 1/count for the mean
            weight=film.focal**2 / c[:, 2] ** 3 * du_dtau * total / (length * count),
            xi=generator.random((len(k), LIGHT_DIMENSIONS)),
            direction=direction / distance[:, None],
            distance=distance,
            far=np.full(len(k), -1, np.int64),
        )
        samples = samples[samples.pixel >= 0]
        yield _visible(film, lighting, edges, samples), (first + len(stratum)) / count


def _visible(film: Film, lighting: Lighting, edges: SeenEdges, samples: EdgeSamples) -> EdgeSamples:
    """The samples whose point is seen, with the face behind it."""
    origin = np.broadcast_to(film.centre, samples.e.shape)
    near, end = film.limits(samples.direction)
    far, distance = lighting.rays.closest(origin, samples.direction, near, end, edges.faces[samples.edge])
    samples.far = far
    return samples[distance > samples.distance - lighting.surfaces.contact]


def _side(
    film: Film, lighting: Lighting, edges: SeenEdges, samples: EdgeSamples, side: int, max_depth: int
) -> Floats:
    """Radiance just beside the samples: side 0 is where +N points, 1 where -N points."""
    s = lighting.surfaces
    near = edges.near[samples.edge, side]
    face = np.where(near >= 0, near, samples.far)
    out = np.where(face[:, None] < 0, s.environment, 0.0)
    for rows, points in (
        _near_points(lighting, edges, samples, near),
        _far_points(film, lighting, samples, np.flatnonzero((near < 0) & (samples.far >= 0))),
    ):
        out[rows] = lighting.radiance(points, samples.xi[rows], max_depth)
    return out


def _near_points(lighting: Lighting, edges: SeenEdges, samples: EdgeSamples, near: Ints) -> tuple[Ints, Points]:
    """Points of the adjacent faces at the edge: shadow rays ignore all faces of the edge, which hide by rule A4."""
    s = lighting.surfaces
    rows = np.flatnonzero(near >= 0)
    k, face = samples.edge[rows], near[rows]
    points = Points.inside(s, samples.e[rows], face, samples.direction[rows])
    t = unit(edges.t[k])
    across = edges.third[k] - edges.a[k][:, None]
    across -= np.einsum("nkd,nd->nk", across, t)[..., None] * t[:, None]
    own = edges.faces[k] == face[:, None]
    points.along = unit(across[np.arange(len(k)), np.argmax(own, axis=1)])
    points.arms = np.where((own | (edges.faces[k] < 0))[..., None], 0.0, unit(across))
    points.ignore = edges.faces[k]
    points.lift = np.zeros(len(rows))
    return rows, points


def _far_points(film: Film, lighting: Lighting, samples: EdgeSamples, rows: Ints) -> tuple[Ints, Points]:
    """Points behind the edge."""
    s = lighting.surfaces
    direction = samples.direction[rows]
    t, _ = s.meet(samples.far[rows], np.broadcast_to(film.centre, direction.shape), direction)
    x = film.centre + np.where(np.isfinite(t), t, 0.0)[:, None] * direction
    return rows, Points.inside(s, x, samples.far[rows], direction)

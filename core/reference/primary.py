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

Contact: an edge may lie in another surface (a box that stands on a floor). Then the far side is that touched surface
at e itself, shaded as a near one: the faces of the edge hide by rule A4. For the near faces, what lies on the other
side of the touched plane is hidden. As a ray that steps over the edge's faces can step over the touched surface too, it
is looked for by a second ray just beside the edge, on the side where no face of the edge is.
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
from .surfaces import Bools, Floats, Ints, dot, unit

# An edge lies in a plane when the sine of the angle between them is below this.
ALONG = 1e-3


@dataclass
class EdgeSamples:
    """Visible points on edges: edge (n,), u (n,), position e (n, 3), pixel (n,), weight f^2/z^3/pdf (n,).

    `xi` are random numbers for the light, `direction` and `distance` lead from the camera to e, `far` is
    the face behind e (-1: none), `touched` the face in which the edge lies there (-1: none).
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
    touched: Ints

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
            touched=np.full(len(k), -1, np.int64),
        )
        samples = samples[samples.pixel >= 0]
        yield _visible(film, lighting, edges, samples), (first + len(stratum)) / count


def _visible(film: Film, lighting: Lighting, edges: SeenEdges, samples: EdgeSamples) -> EdgeSamples:
    """The samples whose point is seen, with the face behind it."""
    origin = np.broadcast_to(film.centre, samples.e.shape)
    near, end = film.limits(samples.direction)
    far, distance = lighting.rays.closest(origin, samples.direction, near, end, edges.faces[samples.edge])
    samples.far = far
    _find_contact(lighting, edges, samples, far, distance)
    aside = np.where((edges.near[samples.edge, 0] < 0)[:, None], 1.0, -1.0) * unit(edges.N[samples.edge])
    beside = unit(samples.e + 2.0 * lighting.surfaces.contact * aside - film.centre)
    nudged, reach = lighting.rays.closest(origin, beside, near, end, edges.faces[samples.edge])
    _find_contact(lighting, edges, samples, nudged, reach)
    samples.far = np.where(samples.touched >= 0, samples.touched, samples.far)
    return samples[distance > samples.distance - lighting.surfaces.contact]


def _find_contact(lighting: Lighting, edges: SeenEdges, samples: EdgeSamples, face: Ints, distance: Floats) -> None:
    """Mark those of the faces hit at the distances (-1: none) in which the samples' edges lie."""
    s = lighting.surfaces
    n, t = s.n[face], unit(edges.t[samples.edge])
    height = np.abs(dot(n, samples.e - s.p[face, 0]))
    # A ray beside the edge meets a plane at a grazing angle farther off; a coplanar surface far away is no contact.
    here = np.abs(distance - samples.distance) < 200.0 * s.contact
    lies = (face >= 0) & here & (height < s.contact) & (np.abs(dot(n, t)) < ALONG)
    samples.touched = np.where(lies, face, samples.touched)


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
        _touched_points(lighting, edges, samples, np.flatnonzero((near < 0) & (samples.touched >= 0)), side),
        _far_points(film, lighting, samples, np.flatnonzero((near < 0) & (samples.far >= 0) & (samples.touched < 0))),
    ):
        out[rows] = lighting.radiance(points, samples.xi[rows], max_depth)
    return out


def _near_points(lighting: Lighting, edges: SeenEdges, samples: EdgeSamples, near: Ints) -> tuple[Ints, Points]:
    """Points of the adjacent faces at the edge: shadow rays ignore all faces of the edge, which hide by rule A4."""
    s = lighting.surfaces
    rows = np.flatnonzero(near >= 0)
    k, face = samples.edge[rows], near[rows]
    points = Points.inside(s, samples.e[rows], face, samples.direction[rows])
    across = _across(edges, k)
    own = edges.faces[k] == face[:, None]
    points.along = across[np.arange(len(k)), np.argmax(own, axis=1)]
    # the two halves of a touched plane hide as faces of the edge do
    touched = samples.touched[rows]
    half = np.where((touched >= 0)[:, None], np.cross(unit(edges.t[k]), s.n[touched]), 0.0)
    points.arms = np.concatenate([np.where(own[..., None], 0.0, across), half[:, None], -half[:, None]], axis=1)
    points.ignore = np.concatenate([edges.faces[k], touched[:, None]], axis=1)
    points.lift = np.zeros(len(rows))
    return rows, points


def _touched_points(
    lighting: Lighting, edges: SeenEdges, samples: EdgeSamples, rows: Ints, side: int
) -> tuple[Ints, Points]:
    """Points of the touched surface at the edge, beside it on the given side; the edge's faces hide by rule A4."""
    s = lighting.surfaces
    k, face = samples.edge[rows], samples.touched[rows]
    points = Points.inside(s, samples.e[rows], face, samples.direction[rows])
    along = np.cross(unit(edges.t[k]), s.n[face])
    toward = edges.N[k] if side == 0 else -edges.N[k]
    points.along = np.where(dot(along, toward)[:, None] < 0.0, -along, along)
    points.arms = _across(edges, k)
    points.ignore = np.concatenate([edges.faces[k], face[:, None]], axis=1)
    points.lift = np.zeros(len(rows))
    return rows, points


def _across(edges: SeenEdges, k: Ints) -> Floats:
    """(n, faces, 3) unit directions from edges k into their faces, perpendicular to the edge; zeros: no face."""
    t = unit(edges.t[k])
    across = edges.third[k] - edges.a[k][:, None]
    across -= np.einsum("nkd,nd->nk", across, t)[..., None] * t[:, None]
    return np.where((edges.faces[k] >= 0)[..., None], unit(across), 0.0)


def _far_points(film: Film, lighting: Lighting, samples: EdgeSamples, rows: Ints) -> tuple[Ints, Points]:
    """Points behind the edge."""
    s = lighting.surfaces
    direction = samples.direction[rows]
    t, _ = s.meet(samples.far[rows], np.broadcast_to(film.centre, direction.shape), direction)
    x = film.centre + np.where(np.isfinite(t), t, 0.0)[:, None] * direction
    return rows, Points.inside(s, x, samples.far[rows], direction)

"""Primary boundary term: the change of pixels by edges that move on the screen. Formula (P):

  dI/dtheta = sum_edges int du (L- - L+) (f^2/z^3) N.e',    e = (1-u) a + u b,  N = (e - o) x t,  t = b - a

Here o is the camera, L+- the radiance just beside the edge on the side to which +-N points, f the focal length in
pixels and z the depth of e. The formula needs no normals on the screen: (f^2/z^3) N.e' du is the swept area in pixels.

Sampling: an edge is chosen in proportion to its length on the screen inside the frustum, and a point uniformly along
it; the samples are stratified over the list of all edges. Let tau be the position along the clipped edge on the screen,
and z0 and z1 the depths of its ends. Then u runs from low to high as tau z0/((1-tau) z1 + tau z0).

The radiance on the two sides is evaluated at e itself, not at displaced points. The near side is an adjacent face at e.
The far side is the hit of a ray from the camera through e that ignores all faces of the edge. If this ray hits a
surface in front of e, the edge is not visible. Both sides use the same random numbers.

Contact: an edge may lie in another surface, such as an edge of a box that stands on a floor. Then the far side is the
touched surface at e. It is shaded like a near side: the faces of the edge block light by rule A4 of derivations.md. For
the near faces, the touched plane blocks everything behind it. A ray that steps over the faces of the edge may also step
over the touched surface. Therefore a second ray searches for it just beside the edge, on the side without a face.
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
from .surfaces import Floats, Ints, Rows, dot, unit

# An edge lies in a plane if the sine of the angle between them is below this.
ALONG = 1e-3


@dataclass
class EdgeSamples(Rows):
    """Samples on edges.

    Attributes
    ----------
    edge, u, e
        (n,) edge, (n,) position along it, and (n, 3) position in space.
    pixel, weight
        (n,) pixel, and (n,) f^2/z^3 divided by the density and the number of samples.
    xi
        (n, LIGHT_DIMENSIONS) random numbers for the light.
    direction, distance
        (n, 3) unit direction and (n,) distance from the camera to e.
    far, touched
        (n,) face behind e, and face in which the edge lies at e; -1: none.
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
        # spp samples per pixel of edge length, but at most as many as the interior term uses for the picture.
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
    """Yield the visible ones of `count` samples in chunks, with the fraction done."""
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
            # The density of u is (length/total) / (du/dtau); 1/count makes the sum a mean.
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
    """Return the samples whose point is visible, with the face behind it."""
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
    """Set `touched` to the face that was hit at a distance (-1: none) if the edge lies in this face."""
    s = lighting.surfaces
    n, t = s.n[face], unit(edges.t[samples.edge])
    height = np.abs(dot(n, samples.e - s.p[face, 0]))
    # A ray beside the edge hits a plane at a grazing angle farther away. A distant coplanar surface is no contact.
    here = np.abs(distance - samples.distance) < 200.0 * s.contact
    lies = (face >= 0) & here & (height < s.contact) & (np.abs(dot(n, t)) < ALONG)
    samples.touched = np.where(lies, face, samples.touched)


def _side(
    film: Film, lighting: Lighting, edges: SeenEdges, samples: EdgeSamples, side: int, max_depth: int
) -> Floats:
    """Radiance just beside the samples, on side 0, to which +N points, or side 1, to which -N points."""
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
    """Points on the adjacent faces at the edge. Shadow rays ignore all faces of the edge; rule A4 replaces them."""
    s = lighting.surfaces
    rows = np.flatnonzero(near >= 0)
    k, face = samples.edge[rows], near[rows]
    points = Points.inside(s, samples.e[rows], face, samples.direction[rows])
    across = _across(edges, k)
    own = edges.faces[k] == face[:, None]
    points.along = across[np.arange(len(k)), np.argmax(own, axis=1)]
    # The two halves of a touched plane block light like faces of the edge.
    touched = samples.touched[rows]
    half = np.where((touched >= 0)[:, None], np.cross(unit(edges.t[k]), s.n[touched]), 0.0)
    points.arms = np.concatenate([np.where(own[..., None], 0.0, across), half[:, None], -half[:, None]], axis=1)
    points.ignore = np.concatenate([edges.faces[k], touched[:, None]], axis=1)
    points.lift = np.zeros(len(rows))
    return rows, points


def _touched_points(
    lighting: Lighting, edges: SeenEdges, samples: EdgeSamples, rows: Ints, side: int
) -> tuple[Ints, Points]:
    """Points on the touched surface, at the edge on the given side; the faces of the edge block by rule A4."""
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
    """Points on the faces behind the edge."""
    s = lighting.surfaces
    direction = samples.direction[rows]
    t, _ = s.meet(samples.far[rows], np.broadcast_to(film.centre, direction.shape), direction)
    x = film.centre + np.where(np.isfinite(t), t, 0.0)[:, None] * direction
    return rows, Points.inside(s, x, samples.far[rows], direction)

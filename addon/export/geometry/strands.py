"""Strands of hair as triangles: curves with radii become prisms around them.

Cycles draws a strand as a tube, or as a ribbon that faces every ray and has a tube's normals. A prism has the same mean
width over all directions if its perimeter is that of the tube. Prisms of thin strands are flat shaded and turned
differently around their strands: their faces then have the tube's normals, and receive light from the tube's
hemispheres, in the mean over many strands. Prisms of wide strands have many sides and smooth normals.

In Cycles a ray that passes through a strand meets it once. So strands that let light through are prisms of two sides,
which are one quad.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .mesh import MeshArrays
from .normals import unit

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Sides of the prisms of strands up to this width in pixels. Odd numbers have nearly the same width from everywhere.
FEWEST_SIDES = 3
SIDES = ((0.3, FEWEST_SIDES, False), (4.0, 5, False), (np.inf, 16, True))
RIBBON, WIDEST_RIBBON = 2, 4.0  # sides of strands that let light through, and up to which width in pixels
# Largest distance between a strand and its prism's axis, relative to the radius, and in pixels. Wide strands, whose
# shape can be seen, have the second alone.
TOLERANCE, PIXEL_TOLERANCE = 0.25, 0.1
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
MOST_SUBDIVISIONS = 4  # sections between two points of a strand, as Cycles has by default


@dataclass
class Strands:
    """n curves of p points in all.

    Attributes
    ----------
    points, radius
        (p, 3) and (p,), metres.
    first
        (n + 1,) first point of each strand, and p.
    along
        (p, c) values at points by name, which are linear in between.
    each
        (n, c) values of whole strands by name.
    smooth
        Whether the strands are Catmull-Rom splines; False: straight between points.
    """

    points: F64
    radius: F64
    first: I64
    along: dict[str, F64] = field(default_factory=dict)
    each: dict[str, F64] = field(default_factory=dict)
    smooth: bool = True

    @property
    def counts(self) -> I64:
        """(n,) points of each strand."""
        return np.diff(self.first)

    def of_point(self) -> I64:
        """(p,) strand of each point."""
        return np.repeat(np.arange(len(self.first) - 1), self.counts)

    def select(self, chosen: NDArray[np.bool_]) -> Strands:
        """Return the strands for which `chosen` (n,) is true."""
        points = chosen[self.of_point()]
        first = np.concatenate([[0], np.cumsum(self.counts[chosen])])
        return Strands(self.points[points], self.radius[points], first, {k: v[points] for k, v in self.along.items()},
                       {k: v[chosen] for k, v in self.each.items()}, self.smooth)  # fmt: skip


def lengths(strands: Strands) -> tuple[F64, F64]:
    """(p,) length of the polygon from a strand's root to each point, and (n,) length of each strand."""
    step = np.zeros(len(strands.points))
    step[1:] = np.linalg.norm(np.diff(strands.points, axis=0), axis=1)
    roots = strands.first[:-1]
    step[roots[roots < len(step)]] = 0.0
    total = np.cumsum(step)
    along = total - total[roots][strands.of_point()]
    return along, along[strands.first[1:] - 1]


def straight(strands: Strands) -> Strands:
    """Return the sections between points as strands of their own, with kinks between them.

    At a kink each reaches beyond the point as far as the outer sides need in order to meet.
    """
    before, start, end, after = _neighbours(strands)
    strand = strands.of_point()[start]
    p = strands.points
    along = unit(p[end] - p[start])

    def beyond(other: F64, point: I64) -> F64:
        cosine = np.einsum("nk,nk->n", unit(other), along)[:, None]
        half = np.sqrt(np.maximum(1.0 - cosine, 0.0) / np.maximum(1.0 + cosine, 1e-6))
        return np.where(other.any(axis=1)[:, None], np.minimum(half, 1.0), 0.0) * strands.radius[point][:, None]

    ends = [p[start] - beyond(p[start] - p[before], start) * along, p[end] + beyond(p[after] - p[end], end) * along]
    points = np.stack([start, end], axis=1).reshape(-1)
    return Strands(np.stack(ends, axis=1).reshape(-1, 3), strands.radius[points], 2 * np.arange(len(start) + 1),
                   {k: v[points] for k, v in strands.along.items()}, {k: v[strand] for k, v in strands.each.items()},
                   False)  # fmt: skip


def usable(strands: Strands) -> Strands:
    """Return the strands that have a length, two or more points, and a finite shape."""
    if not len(strands.points):
        return strands
    finite = np.isfinite(strands.points).all(axis=1) & np.isfinite(strands.radius)
    good = (strands.counts > 1) & (np.bincount(strands.of_point()[~finite], minlength=len(strands.counts)) == 0)
    out = strands.select(good)
    if not len(out.points):
        return out
    thick = np.maximum.reduceat(out.radius, out.first[:-1]) > 0.0
    return out.select((lengths(out)[1] > 0.0) & thick)


def sides_for(pixels: float, translucent: bool) -> tuple[int, bool]:
    """Return the number of a prism's sides, and whether it is smooth shaded, for a strand this many pixels wide."""
    if translucent and pixels <= WIDEST_RIBBON:
        return RIBBON, False
    return next((sides, smooth) for most, sides, smooth in SIDES if pixels <= most)


def resampled(strands: Strands, pixel: float, tolerance: float = PIXEL_TOLERANCE, wide: bool = False) -> Strands:
    """Return the strands with as many points as their shape needs, if a pixel has this size (metres)."""
    allowed = max(0.0 if wide else TOLERANCE * float(np.median(strands.radius)), tolerance * pixel)
    count = int(strands.counts[0])
    equal = bool((strands.counts == count).all())
    stride = 1
    while equal and (count - 1) % (2 * stride) == 0 and _deviation(strands, count, 2 * stride) <= allowed:
        stride *= 2
    if stride > 1:
        kept = np.tile(np.arange(count) % stride == 0, len(strands.counts))
        first = np.arange(len(strands.first)) * ((count - 1) // stride + 1)
        # Further points between the kept ones would follow another spline.
        return Strands(strands.points[kept], strands.radius[kept], first,
                       {k: v[kept] for k, v in strands.along.items()}, strands.each, False)  # fmt: skip
    if not strands.smooth:
        return strands
    for sections in (1, 2, MOST_SUBDIVISIONS):
        # A parabola's largest distance to its chord falls with the square of the number of sections.
        if _bulge(strands) <= allowed * sections**2 or sections == MOST_SUBDIVISIONS:
            return subdivided(strands, sections)
    return strands


def _shape(strands: Strands) -> F64:
    """(p, 4) points, and radii, whose errors count more: they add up over all strands."""
    return np.column_stack([strands.points, 5.0 * strands.radius])


def _deviation(strands: Strands, count: int, stride: int) -> float:
    """Distance that 99 % of the points keep from the polygon through every `stride`-th point."""
    points = _shape(strands).reshape(-1, count, 4)
    start, end = points[:, :-1:stride], points[:, stride::stride]
    worst = np.zeros(len(points))
    for k in range(1, stride):
        worst = np.maximum(worst, _distance(points[:, k::stride], start, end).max(axis=1))
    return float(np.quantile(worst, 0.99))


def _distance(p: F64, start: F64, end: F64) -> F64:
    """Distance of points from line segments."""
    edge = end - start
    t = np.einsum("...k,...k->...", p - start, edge) / np.maximum(np.einsum("...k,...k->...", edge, edge), 1e-30)
    nearest = start + np.clip(t, 0.0, 1.0)[..., None] * edge
    return np.asarray(np.linalg.norm(p - nearest, axis=-1))


def _bulge(strands: Strands) -> float:
    """Distance that 99 % of the splines' sections keep from their chords."""
    before, start, end, after = _neighbours(strands)
    p = _shape(strands)
    middle = (9.0 * (p[start] + p[end]) - p[before] - p[after]) / 16.0
    return float(np.quantile(_distance(middle, p[start], p[end]), 0.99))


def _neighbours(strands: Strands) -> tuple[I64, I64, I64, I64]:
    """Points before, at the start, at the end and after each section; a strand's end points count twice."""
    of_point = strands.of_point()
    last = strands.first[1:] - 1
    start = np.flatnonzero(np.arange(len(strands.points)) != last[of_point])
    strand = of_point[start]
    return (np.maximum(start - 1, strands.first[strand]), start, start + 1, np.minimum(start + 2, last[strand]))


def subdivided(strands: Strands, sections: int) -> Strands:
    """Return the strands with `sections` straight sections between two points, which lie on Catmull-Rom splines."""
    if sections == 1:
        return replace(strands, smooth=False)
    before, start, end, after = _neighbours(strands)
    t = (np.arange(sections) / sections)[:, None]
    spline = 0.5 * np.concatenate([-t + 2 * t**2 - t**3, 2 - 5 * t**2 + 3 * t**3, t + 4 * t**2 - 3 * t**3, t**3 - t**2],
                                  axis=1)  # fmt: skip
    linear = np.concatenate([0 * t, 1 - t, t, 0 * t], axis=1)
    around = np.stack([before, start, end, after], axis=1)
    first = np.concatenate([[0], np.cumsum((strands.counts - 1) * sections + 1)])
    # Sections of a strand fill the places before its last point.
    last = first[1:] - 1
    places = np.setdiff1d(np.arange(first[-1]), last)

    def between(values: F64, weights: F64) -> F64:
        out = np.empty((first[-1], values.shape[1]))
        out[places] = np.einsum("tk,skc->stc", weights, values[around]).reshape(-1, values.shape[1])
        out[last] = values[strands.first[1:] - 1]
        return out

    radius = between(strands.radius[:, None], spline)[:, 0]
    return Strands(between(strands.points, spline), np.maximum(radius, 0.0), first,
                   {k: between(v, linear) for k, v in strands.along.items()}, strands.each, False)  # fmt: skip


def triangles(strands: Strands, sides: int) -> int:
    """Return the number of triangles of prisms around the strands."""
    return (len(strands.points) - len(strands.counts)) * (2 if sides == RIBBON else 2 * sides)


def prisms(strands: Strands, sides: int, smooth: bool) -> tuple[MeshArrays, I64]:
    """Return the strands as prisms, and the point of a strand that each vertex surrounds."""
    across = _frames(strands)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    # The perimeter of the prism is that of the circle.
    reach = strands.radius * np.pi / (sides * np.sin(np.pi / sides))
    ring = np.cos(angle)[:, None] * across[:, None, 0] + np.sin(angle)[:, None] * across[:, None, 1]
    vertices = strands.points[:, None] + reach[:, None, None] * ring
    here = _neighbours(strands)[1][:, None] * sides
    side = np.arange(sides if sides > RIBBON else 1)
    turn = (side + 1) % sides
    quads = np.stack([here + side, here + turn, here + sides + turn, here + sides + side], axis=-1).reshape(-1, 4)
    faces = np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1)
    # A ring of radius zero leaves one triangle of each quad.
    pointed = strands.radius <= 0.0
    kept = ~np.stack([pointed[quads[:, 0] // sides], pointed[quads[:, 2] // sides]], axis=1)
    faces = faces[kept].astype(np.int32)
    positions = vertices.reshape(-1, 3).astype(np.float32)
    corners = np.arange(3 * len(faces), dtype=np.int32).reshape(-1, 3)
    arrays = MeshArrays(positions, faces, corners, np.arange(len(faces), dtype=np.int32),
                        np.zeros(len(faces), np.int32))  # fmt: skip
    if smooth:
        arrays.smoothing = faces
        arrays.normals = ring.reshape(-1, 3).astype(np.float32)
        arrays.exact = True
    return arrays, np.repeat(np.arange(len(strands.points)), sides)


def _frames(strands: Strands) -> F64:
    """(p, 2, 3) two unit vectors across the strand at each point, carried along without twist."""
    _, start, end, _ = _neighbours(strands)
    chord = np.zeros((len(strands.points) + 1, 3))
    chord[start] = unit(strands.points[end] - strands.points[start])
    along = chord[:-1].copy()
    along[end] += chord[start]
    u = np.zeros_like(strands.points)
    for k in range(int(strands.counts.max(initial=0))):
        now = strands.first[:-1][strands.counts > k] + k
        tangent = along[now]
        degenerate = np.einsum("nk,nk->n", tangent, tangent) < 1e-12
        tangent[degenerate] = (0.0, 0.0, 1.0)
        along[now] = tangent = unit(tangent)
        ahead = _turned(tangent) if k == 0 else u[now - 1]
        u[now] = unit(ahead - tangent * np.einsum("nk,nk->n", ahead, tangent)[:, None])
        lost = ~(np.abs(u[now]).max(axis=1, initial=0.0) > 0.0)
        if lost.any():
            other = np.roll(tangent[lost], 1, axis=1) + (0.1, 0.2, 0.3)
            u[now[lost]] = unit(np.cross(tangent[lost], other))
    return np.stack([u, np.cross(along, u)], axis=1)


def _turned(along: F64) -> F64:
    """(n, 3) vectors across the unit vectors `along`; neighbours in this order are turned evenly around them."""
    least = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    u = unit(np.cross(along, least))
    angle = 2.0 * np.pi * GOLDEN * np.arange(len(along))[:, None]
    return np.asarray(np.cos(angle) * u + np.sin(angle) * np.cross(along, u))

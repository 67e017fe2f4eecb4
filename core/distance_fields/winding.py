"""Generalised winding numbers (Jacobson, Kavan & Sorkine-Hornung 2013): 1 inside of a mesh, 0 outside of it.

A mesh may have holes, intersect itself and have faces twice: its winding number is still defined everywhere, and 1/2
where the surface would have to be. Fans of triangles close the borders of the mesh. The winding number of the closed
surface is a whole number, and counted exactly by the surface's crossings with a ray. That of the fans is the sum of
their solid angles. The difference is the winding number of the mesh.

All coordinates are grid coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry.labels import connected, rows_and_places, summed
from .linear import mapped
from .ragged import parts

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Rays whose crossings do not cancel have met an edge within rounding: they are repeated beside.
_SHIFTS = ((0.0, 0.0), (1.7e-7, 2.9e-7), (-3.1e-6, 1.3e-6), (2.3e-5, -1.9e-5))
# Offset of a fan's apex, as fractions of its size: the fan does not lie in the plane of a flat border, which often is
# one of nodes.
_APEX = np.array([0.0137, 0.0191, -0.0113])
_BLOCK = 16  # nodes along an axis whose distant fans are interpolated together
_CHEBYSHEV = 5  # places along an axis from which they are interpolated
_AWAY = 2.0  # fans are distant beyond this multiple of the block's radius, plus their own


@dataclass(frozen=True)
class Surface:
    """A mesh whose borders are closed by fans.

    Attributes
    ----------
    vertices
        (n, 3) positions: those of the mesh, and the apexes of the fans.
    faces
        (m, 3) faces of the mesh: none without an area between distinct vertices, none twice, no pair of opposite ones.
    fans
        (k, 3) faces of the fans.
    """

    vertices: F64
    faces: I64
    fans: I64

    @classmethod
    def closed(cls, vertices: F64, faces: I64) -> Surface:
        """Close a mesh whose coincident vertices are welded."""
        faces = _distinct(faces)
        start, end = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
        count = len(vertices)
        key = np.minimum(start, end) * count + np.maximum(start, end)
        edge, of = np.unique(key, return_inverse=True)
        net = np.bincount(of.reshape(-1), np.where(start < end, 1.0, -1.0), minlength=len(edge)).astype(np.int64)
        border = np.repeat(np.flatnonzero(net), np.abs(net[net != 0]))
        low, high = edge[border] // count, edge[border] % count
        forward = net[border] > 0
        a, b = np.where(forward, low, high), np.where(forward, high, low)
        group = connected(a, b, count)
        names, number = np.unique(group[a], return_inverse=True)
        number = number.reshape(-1)
        size = np.bincount(number)
        apexes = summed(number, vertices[a]) / size[:, None]
        reach = np.zeros(len(names))
        np.maximum.at(reach, number, np.abs(vertices[a] - apexes[number]).max(axis=1, initial=0.0))
        apexes += 2.0 * reach[:, None] * _APEX
        return cls(np.concatenate([vertices, apexes]), faces, np.stack([b, a, count + number], axis=1))

    def at_nodes(self, shape: tuple[int, int, int]) -> F64:
        """(mx, my, mz) winding numbers at the nodes of a grid."""
        columns = np.stack(np.meshgrid(np.arange(shape[0]), np.arange(shape[1]), indexing="ij"), axis=-1)
        xy = columns.reshape(-1, 2).astype(np.float64)
        count = np.zeros((len(xy), shape[2] + 1))
        left = np.arange(len(xy))
        for shift in _SHIFTS:
            query, height, sign = self._crossings(xy[left] + shift)
            place = np.clip(np.ceil(height), 0, shape[2]).astype(np.int64)
            found = np.bincount(query * (shape[2] + 1) + place, sign, minlength=len(left) * (shape[2] + 1))
            count[left] = found.reshape(len(left), -1)
            left = left[np.bincount(query, sign, minlength=len(left)) != 0.0]
            if len(left) == 0:
                break
        # A crossing above a node counts for it.
        whole = np.cumsum(count[:, ::-1], axis=1)[:, ::-1][:, 1:].reshape(shape)
        return whole - self._fans_at_nodes(shape)

    def at_points(self, points: F64) -> F64:
        """(n,) winding numbers at points."""
        out = np.zeros(len(points))
        left = np.arange(len(points))
        for shift in _SHIFTS if len(points) else ():
            query, height, sign = self._crossings(points[left, :2] + shift)
            above = height > points[left[query], 2]
            out[left] = np.bincount(query[above], sign[above], minlength=len(left))
            left = left[np.bincount(query, sign, minlength=len(left)) != 0.0]
            if len(left) == 0:
                break
        return out - self._fans_at(points, np.arange(len(self.fans)))

    def _crossings(self, xy: F64) -> tuple[I64, F64, F64]:
        """Crossings of vertical lines with the closed surface.

        Returns
        -------
        For each crossing the number of the line, the height, and 1 where the line leaves, -1 where it enters.
        """
        faces = np.concatenate([self.faces, self.fans])
        corner = self.vertices[faces][:, :, :2]
        low, high = np.floor(xy.min(axis=0)), np.floor(xy.max(axis=0))
        first = np.floor(corner.min(axis=1))
        last = np.floor(corner.max(axis=1))
        met = np.flatnonzero(np.all((last >= low) & (first <= high), axis=1))
        first, last = np.maximum(first[met], low).astype(np.int64), np.minimum(last[met], high).astype(np.int64)
        low_cell, size = low.astype(np.int64), (high - low).astype(np.int64) + 1
        # Lists of the faces over each square of the plane.
        extent = last - first + 1
        row, place = rows_and_places(extent.prod(axis=1))
        square = (first[row] - low_cell + np.stack([place // extent[row, 1], place % extent[row, 1]], axis=1)) @ [
            size[1], 1]  # fmt: skip
        order = np.argsort(square, kind="stable")
        listed = met[row[order]]
        begin = np.searchsorted(square[order], np.arange(size.prod() + 1))
        cell = (np.floor(xy).astype(np.int64) - low_cell) @ [size[1], 1]
        count = begin[cell + 1] - begin[cell]
        found: list[tuple[I64, F64, F64]] = [(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))]
        for part in parts(count):
            row, place = rows_and_places(count[part])
            face = listed[begin[cell[part]][row] + place]
            hit, height, sign = self._pierced(faces[face], xy[part][row])
            found.append((row[hit] + part.start, height, sign))
        query, height, sign = (np.concatenate(column) for column in zip(*found, strict=True))
        return query, height, sign

    def _pierced(self, faces: I64, xy: F64) -> tuple[I64, F64, F64]:
        """Which faces a vertical line passes, pairwise; height and sign of these crossings."""
        sides = [_side(self.vertices, faces[:, k - 2], faces[:, k - 1], xy) for k in range(3)]
        sign = sides[0][1]
        hit = np.flatnonzero((sign != 0.0) & (sign == sides[1][1]) & (sign == sides[2][1]))
        weight = np.stack([side[0][hit] for side in sides])
        total = weight.sum(axis=0)
        z = self.vertices[faces[hit], 2].T
        flat = total == 0.0
        height = np.where(flat, z.mean(axis=0), (weight * z).sum(axis=0) / np.where(flat, 1.0, total))
        return hit, np.clip(height, z.min(axis=0), z.max(axis=0)), sign[hit]

    def _fans_at(self, points: F64, chosen: I64) -> F64:
        """Winding numbers of some fans' faces at points."""
        out = np.zeros(len(points))
        if len(chosen) == 0:
            return out
        corner = self.vertices[self.fans[chosen]]
        step = max((1 << 18) // len(chosen), 1)
        for first in range(0, len(points), step):
            part = points[first : first + step]
            out[first : first + step] = solid_angles(part, corner).sum(axis=1) / (4.0 * np.pi)
        return out

    def _fans_at_nodes(self, shape: tuple[int, int, int]) -> F64:
        """Winding numbers of the fans at nodes. Those of distant fans are smooth in a block, and interpolated."""
        out = np.zeros(shape)
        if len(self.fans) == 0:
            return out
        corner = self.vertices[self.fans]
        middle = corner.mean(axis=1)
        radius = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1)
        for begin in np.ndindex(*(-(-m // _BLOCK) for m in shape)):
            low = np.array(begin) * _BLOCK
            high = np.minimum(low + _BLOCK, shape)
            half = 0.5 * (high - 1 - low)
            away = np.linalg.norm(middle - (low + half), axis=1) - radius
            distant = away > _AWAY * max(float(np.linalg.norm(half)), 1.0)
            axes = [np.arange(a, b) for a, b in zip(low, high, strict=True)]
            nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            part = self._fans_at(nodes.astype(np.float64), np.flatnonzero(~distant))
            if distant.any():
                part += self._interpolated(low + half, np.maximum(half, 0.5), axes, np.flatnonzero(distant))
            box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
            out[box] = part.reshape(tuple(high - low))
        return out

    def _interpolated(self, centre: F64, half: F64, axes: list[I64], chosen: I64) -> F64:
        """Winding numbers of distant fans at a block's nodes, from those at Chebyshev's nodes."""
        t = np.cos((2 * np.arange(_CHEBYSHEV) + 1) * np.pi / (2 * _CHEBYSHEV))
        places = np.stack(np.meshgrid(*(c + h * t for c, h in zip(centre, half, strict=True)), indexing="ij"), axis=-1)
        value = self._fans_at(places.reshape(-1, 3), chosen).reshape((_CHEBYSHEV,) * 3)
        maps = []
        for axis in range(3):
            x = (axes[axis] - centre[axis]) / half[axis]
            weight = np.ones((len(x), _CHEBYSHEV))
            for k in range(_CHEBYSHEV):
                for j in range(_CHEBYSHEV):
                    if j != k:
                        weight[:, k] *= (x - t[j]) / (t[k] - t[j])
            maps.append(weight)
        return mapped(value, maps).reshape(-1)


def solid_angles(points: F64, corner: F64) -> F64:
    """(n, m) signed solid angles of triangles (m, 3, 3) from points (n, 3): positive seen from behind."""
    a, b, c = (np.moveaxis(corner[None, :, k] - points[:, None], -1, 0) for k in range(3))
    la, lb, lc = (np.sqrt((v * v).sum(axis=0)) for v in (a, b, c))
    volume = (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
              + a[2] * (b[0] * c[1] - b[1] * c[0]))  # fmt: skip
    below = la * lb * lc + (a * b).sum(axis=0) * lc + (b * c).sum(axis=0) * la + (c * a).sum(axis=0) * lb
    return 2.0 * np.arctan2(volume, below)


def _distinct(faces: I64) -> I64:
    """Leave out faces with a vertex twice, copies of a face, and pairs of opposite faces, which cancel."""
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    if len(faces) == 0:
        return faces
    turn = np.argmin(faces, axis=1)
    rolled = np.take_along_axis(faces, (turn[:, None] + np.arange(3)) % 3, axis=1)
    forward = rolled[:, 1] < rolled[:, 2]
    same = np.where(forward[:, None], rolled, rolled[:, [0, 2, 1]])
    _, first, of = np.unique(same, axis=0, return_index=True, return_inverse=True)
    net = np.bincount(of.reshape(-1), np.where(forward, 1.0, -1.0), minlength=len(first))
    kept = same[first][net != 0.0]
    return np.asarray(np.where((net[net != 0.0] > 0.0)[:, None], kept, kept[:, [0, 2, 1]]))


def _side(vertices: F64, start: I64, end: I64, xy: F64) -> tuple[F64, F64]:
    """On which side of an edge, seen from above, a vertical line passes.

    Returns
    -------
    Twice the area of the triangle of the edge and the line, positive left of the edge; and its sign. Both faces of an
    edge compute the same number, so that no line passes between them. A line on the edge is moved by an infinitely
    small (d, d^2).
    """
    low, high = vertices[np.minimum(start, end)], vertices[np.maximum(start, end)]
    dx, dy = high[:, 0] - low[:, 0], high[:, 1] - low[:, 1]
    area = dx * (xy[:, 1] - low[:, 1]) - dy * (xy[:, 0] - low[:, 0])
    sign = np.sign(area)
    sign = np.where(sign != 0.0, sign, np.where(dy != 0.0, -np.sign(dy), np.sign(dx)))
    turned = np.where(start > end, -1.0, 1.0)
    return turned * area, turned * sign

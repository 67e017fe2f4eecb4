"""The camera: rays through pixels, projection of points, splatting.

A pixel is the integral of the radiance over its unit square (box filter); row 0 is on top. A point p, relative to the
centre of projection, has the depth z = -Z.p and the screen position s = (cx + f X.p/z, cy - f Y.p/z).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.labels import summed
from ..tables.camera import PLACES
from ..tables.tables import Tables
from .surfaces import Floats, Ints, dot, unit


@dataclass
class Film:
    """The pinhole camera in float64. The rows of `axes` are X (right), Y (up) and Z (backwards)."""

    centre: Floats
    axes: Floats
    focal: float
    principal: Floats
    width: int
    height: int
    clip_start: float
    clip_end: float

    @classmethod
    def of(cls, tables: Tables) -> Film:
        """Make the camera of a scene's tables."""
        row = tables.camera.astype(np.float64)
        return cls(
            centre=row[PLACES["camera_position"]],
            axes=row[PLACES["camera_axes"]].reshape(3, 3),
            focal=float(row[PLACES["focal"]][0]),
            principal=row[PLACES["principal_point"]],
            width=tables.width,
            height=tables.height,
            clip_start=float(tables.clip_start),
            clip_end=float(tables.clip_end),
        )

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.width * self.height

    def directions(self, s: Floats) -> Floats:
        """Unit directions (n, 3) of the rays through screen positions `s` (n, 2)."""
        across = s - self.principal
        X, Y, Z = self.axes
        return unit(across[:, :1] * X - across[:, 1:] * Y - self.focal * Z)

    def limits(self, direction: Floats) -> tuple[Floats, Floats]:
        """Distances along rays to the planes at the depths clip_start and clip_end."""
        depth_per_length = -dot(direction, self.axes[2])
        return self.clip_start / depth_per_length, self.clip_end / depth_per_length

    def camera_space(self, x: Floats) -> Floats:
        """(…, 3) points in camera space (X.p, Y.p, z). The map is affine; the depth z is positive in front."""
        p = x - self.centre
        return np.stack([p @ self.axes[0], p @ self.axes[1], -(p @ self.axes[2])], axis=-1)

    def project(self, c: Floats) -> Floats:
        """Screen positions (…, 2) of points in camera space."""
        ratio = self.focal * c[..., :2] / c[..., 2:]
        return np.stack([self.principal[0] + ratio[..., 0], self.principal[1] - ratio[..., 1]], axis=-1)

    def frustum(self, c: Floats) -> Floats:
        """(…, 6) values, linear in the point, that are all >= 0 inside the view frustum."""
        x, y, z = c[..., 0], c[..., 1], c[..., 2]
        cx, cy = self.principal
        f = self.focal
        return np.stack(
            [
                z - self.clip_start,
                self.clip_end - z,
                cx * z + f * x,
                (self.width - cx) * z - f * x,
                cy * z - f * y,
                (self.height - cy) * z + f * y,
            ],
            axis=-1,
        )

    def pixel_of(self, s: Floats) -> Ints:
        """Index of the pixel at each screen position; -1 outside the picture."""
        column, row = np.floor(s[:, 0]), np.floor(s[:, 1])
        inside = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        return np.where(inside, row * self.width + column, -1).astype(np.int64)

    def splat(self, pixel: Ints, colour: Floats) -> Floats:
        """(pixels, 3) sum of the colours of the samples in each pixel."""
        return summed(pixel, colour, self.pixels)

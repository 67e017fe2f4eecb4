"""Calibrated lenses: intrinsics and distortion, and pictures without it.

A point of the scene at (X, Y, Z) before the camera (X to the right, Y down, Z forward) has the ideal coordinates
x = X / Z, y = Y / Z. With r² = x² + y², the lens moves it to

    x' = x R + 2 p1 x y + p2 (r² + 2 x²)
    y' = y R + p1 (r² + 2 y²) + 2 p2 x y
    R  = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)

and the picture has it at (fx x' + cx, fy y' + cy), in pixels from the upper left corner of the picture, whose first
pixel has its centre at (0.5, 0.5). This is the model of OpenCV and of COLMAP's FULL_OPENCV; the models that are named
here are special cases. Cameras of a fit have no distortion, so it is taken out of their pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .._check import array, number, numeric
from .._fields import Check
from ..scene.camera import Camera
from .intrinsics import F64, Flags, Intrinsics

_COEFFICIENTS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")


@dataclass(frozen=True)
class Lens(Intrinsics):
    """Intrinsics of a calibrated camera whose picture is a perspective with distortion.

    Attributes
    ----------
    width, height
        Size of its pictures, pixels.
    fx, fy, cx, cy
        Focal lengths and principal point, pixels.
    k1, k2, k3, k4, k5, k6, p1, p2
        Distortion, as above.
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    checks: ClassVar[dict[str, Check]] = {**Intrinsics.checks, **dict.fromkeys(_COEFFICIENTS, number)}

    def camera(self, to_world: ArrayLike) -> Camera:
        """Return the camera without distortion and with square pixels of the size fx, at a pose in Blender's axes."""
        return Camera(np.asarray(to_world, np.float64), 2.0 * float(np.arctan(0.5 * self.width / self.fx)),
                      self.width, self.height, self._lens_shift)  # fmt: skip

    def distort(self, ideal: ArrayLike) -> F64:
        """Map (..., 2) ideal coordinates x, y to pixels of the picture."""
        sides = numeric("Lens", "ideal", ideal).shape[:-1]
        x, y = np.moveaxis(np.asarray(array("Lens", "ideal", ideal, (*sides, 2), np.float64)), -1, 0)
        r2 = x * x + y * y
        radial = self._radial(r2)
        cross = 2.0 * x * y
        moved_x = x * radial + self.p1 * cross + self.p2 * (r2 + 2.0 * x * x)
        moved_y = y * radial + self.p1 * (r2 + 2.0 * y * y) + self.p2 * cross
        return np.stack([self.fx * moved_x + self.cx, self.fy * moved_y + self.cy], axis=-1)

    def _radial(self, r2: F64) -> F64:
        """The factor R of the module's formula."""
        return (1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))) / (
            1.0 + r2 * (self.k4 + r2 * (self.k5 + r2 * self.k6))
        )

    def _source(self, places: F64) -> tuple[F64, Flags]:
        ideal = self._ideal(places)
        return self.distort(ideal), (ideal**2).sum(axis=2) <= self._limit() ** 2

    def _limit(self) -> float:
        """Distance of ideal coordinates from the axis up to which the distortion grows outwards; then it folds back."""
        radii = np.linspace(0.0, self._corner, 4096)
        with np.errstate(divide="ignore", invalid="ignore"):
            falls = ~(np.diff(radii * self._radial(radii * radii)) > 0.0)
        return float(radii[np.argmax(falls)]) if falls.any() else np.inf

"""Calibrated fisheye lenses, and lenses of panoramas.

A fisheye shows a direction at the angle θ from its axis at the distance r from the principal point, on the same side:

    r = θ + k1 θ³ + k2 θ⁵ + k3 θ⁷ + k4 θ⁹

A point at (X, Y, Z), X to the right, Y down and Z forward, has θ = atan2(s, Z) with s = √(X² + Y²). The picture has it
at (fx r X / s + cx, fy r Y / s + cy). This is the fisheye model of OpenCV; θ may be more than a right angle. COLMAP's
model FOV has, for its parameter ω,

    r = atan2(2 tan(ω/2) sin θ, cos θ) / ω

Cameras of a fit, and those of Cycles, have the inverse: θ is a polynomial of degree 4 of r. It is exact for k = 0, an
equidistant fisheye. Else it is fitted by least squares over the angles of the picture. If no pixel is off by more than
`FisheyeLens.least_shift`, the picture stays as it is. Else the difference is taken out of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from .._check import array, number, numeric
from .._fields import Check, by
from ..scene.camera import MOST_ANGLE, Camera
from .intrinsics import F64, Flags, Intrinsics

# Angles at which the model is examined and fitted.
ANGLES = 4096
# Least weight of a pixel in the fit, as the slope of r: so that the fit grows where the lens compresses angles.
STEEPEST = 0.1
# Radians. Below, COLMAP's model FOV is a perspective as far as single precision can tell.
LEAST_OMEGA = 1e-3
# By how much, relatively, a panorama may exceed the sphere by rounding.
ROUNDING = 1e-6


@dataclass(frozen=True)
class FisheyeLens(Intrinsics):
    """Intrinsics of a calibrated fisheye camera.

    Attributes
    ----------
    width, height
        Size of its pictures, pixels.
    fx, fy, cx, cy
        Focal lengths and principal point, pixels.
    k1, k2, k3, k4
        Distortion, as above.
    omega
        Parameter of COLMAP's model FOV, radians; 0: the model of OpenCV.
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    omega: float = 0.0

    checks: ClassVar[dict[str, Check]] = {**Intrinsics.checks, **dict.fromkeys(("k1", "k2", "k3", "k4"), number),
                                          "omega": by(number, least=0.0, below=np.pi)}  # fmt: skip
    # Calibrations are rarely more precise.
    least_shift: ClassVar[float] = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        if 0.0 < self.omega < LEAST_OMEGA:
            raise ValueError(f"FisheyeLens: omega must be 0, or {LEAST_OMEGA:g} or more, not {self.omega:g}")
        if not self._widest > 0.0:
            raise ValueError("FisheyeLens: k1 to k4 make its picture fold back in the middle; check their order and "
                             "signs")  # fmt: skip

    def camera(self, to_world: ArrayLike) -> Camera:
        """Return the camera with square pixels of the size fx, at a pose in Blender's axes."""
        # It sees more than the lens if it can, since pixels at the border of what a camera sees are partly black.
        widest = min(np.pi, 1.0001 * float(self._angle(self._grows)))
        return Camera(
            np.asarray(to_world, np.float64), width=self.width, height=self.height, shift=self._lens_shift,
            kind="FISHEYE_POLYNOMIAL", fisheye_fov=2.0 * widest,
            fisheye_polynomial=self._of_width(self._angle),
        )  # fmt: skip

    def project(self, points: ArrayLike) -> F64:
        """Map (..., 3) points, X to the right, Y down and Z forward, to pixels of the picture.

        Points that the lens does not see, since the model folds back before their angle, get NaN.
        """
        sides = numeric("FisheyeLens", "points", points).shape[:-1]
        x, y, z = np.moveaxis(np.asarray(array("FisheyeLens", "points", points, (*sides, 3), np.float64)), -1, 0)
        aside = np.hypot(x, y)
        angle = np.arctan2(aside, z)
        radius = np.where(angle <= self._widest, self._radius(angle), np.nan)
        at = radius / np.where(aside > 0.0, aside, 1.0)
        return np.stack([self.fx * x * at + self.cx, self.fy * y * at + self.cy], axis=-1)

    def _source(self, places: F64) -> tuple[F64, Flags]:
        ideal = self._ideal(places)
        radius = np.hypot(ideal[..., 0], ideal[..., 1])
        angle = self._angle(radius)
        seen = (radius <= self._grows) & (angle <= self._widest)
        outwards = self._radius(np.where(seen, angle, 0.0)) / np.maximum(radius, 1e-12)
        return ideal * outwards[..., None] * [self.fx, self.fy] + [self.cx, self.cy], seen

    def _radius(self, angle: F64) -> F64:
        """The distance r of the module's formulas."""
        if self.omega:
            spread = 2.0 * np.tan(0.5 * self.omega)
            return np.asarray(np.arctan2(spread * np.sin(angle), np.cos(angle)) / self.omega)
        square = angle * angle
        with np.errstate(over="ignore", invalid="ignore"):
            factor = self.k1 + square * (self.k2 + square * (self.k3 + square * self.k4))
            return np.asarray(angle * (1.0 + square * factor))

    @cached_property
    def _widest(self) -> float:
        """Angle up to which r grows, at most π."""
        angles = np.linspace(0.0, np.pi, ANGLES)
        with np.errstate(invalid="ignore"):
            falls = ~(np.diff(self._radius(angles)) > 0.0)
        return float(angles[falls.argmax()]) if falls.any() else np.pi

    @cached_property
    def _edge(self) -> float:
        """Largest r of the lens within the picture of `camera`."""
        return min(float(self._radius(np.array(self._widest))), self._corner)

    @cached_property
    def _angle(self) -> Polynomial:
        """The angle of the camera as a polynomial of r, with five coefficients."""
        equidistant = Polynomial([0.0, 1.0, 0.0, 0.0, 0.0])
        if not (self.omega or self.k1 or self.k2 or self.k3 or self.k4):
            return equidistant
        angles = np.linspace(0.0, self._widest, 16 * ANGLES)
        # Points are denser towards the border, where polynomials that are fitted to evenly spaced ones err most.
        share = np.sin(0.5 * np.pi * (np.arange(ANGLES) + 0.5) / ANGLES)
        angle = np.interp(self._edge * share, self._radius(angles), angles)
        weight = np.maximum(np.gradient(self._edge * share, angle), STEEPEST)  # of an error of the angle, in r
        inside = np.linspace(0.0, 1.0, ANGLES)
        for degree in (4, 3, 2):  # that of highest degree that grows everywhere, as an angle must
            powers = share[:, None] ** np.arange(1, degree + 1)
            found = np.linalg.lstsq(powers * weight[:, None], angle * weight, rcond=None)[0]
            fitted = Polynomial(np.concatenate([[0.0], found, np.zeros(4 - degree)]))
            out = Polynomial(fitted.coef / self._edge ** np.arange(5.0))
            if (fitted.deriv()(inside) > 0.0).all() and np.abs(self._of_width(out)).max() <= MOST_ANGLE:
                return out
        return equidistant

    def _of_width(self, angle: Polynomial) -> F64:
        """(5,) coefficients for radii that are divided by the picture's width, not by fx."""
        return np.asarray(angle.coef * (self.width / self.fx) ** np.arange(5.0))

    @cached_property
    def _grows(self) -> float:
        """Radius within the picture, at least `_edge`, up to which the angle of the camera grows."""
        radii = np.linspace(self._edge, self._corner, ANGLES)
        falls = self._angle.deriv()(radii) <= 0.0
        return self._edge + 0.9 * float(radii[falls.argmax()] - self._edge) if falls.any() else self._corner


@dataclass(frozen=True)
class PanoramaLens(Intrinsics):
    """Intrinsics of a panorama in equirectangular projection.

    A pixel at (x, y) has the longitude π (x - cx) / fx and the latitude π (cy - y) / fy, so that a picture of all
    directions has fx = width / 2 and fy = height.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        turn, rise = 0.5 * self.width / self.fx, self.height / self.fy
        if max(turn, rise) > 1.0 + ROUNDING:
            raise ValueError(f"PanoramaLens: its picture spans {360.0 * turn:.4g} x {180.0 * rise:.4g} degrees, more "
                             "than all directions; fx must be half of the width or more, and fy the height or more")

    def camera(self, to_world: ArrayLike) -> Camera:
        """Return the camera at a pose in Blender's axes."""
        sides, edges = np.array([0.0, self.width]), np.array([self.height, 0.0])
        longitude, latitude = np.pi * (sides - self.cx) / self.fx, np.pi * (self.cy - edges) / self.fy
        return Camera(np.asarray(to_world, np.float64), width=self.width, height=self.height, kind="EQUIRECTANGULAR",
                      longitude=longitude, latitude=latitude)  # fmt: skip

    def _source(self, places: F64) -> tuple[F64, Flags]:
        return places, np.ones(places.shape[:2], np.bool_)

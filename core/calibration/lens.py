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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array, light_values, number, numeric, whole
from .._fields import Check, CheckedAtOnce, by
from ..scene.camera import MAX_SIDE, Camera

F64 = NDArray[np.float64]

_ONE_FOCAL, _TWO_FOCAL = ("f", "cx", "cy"), ("fx", "fy", "cx", "cy")
# Parameters of each known model, in the order of COLMAP's files.
MODELS: dict[str, tuple[str, ...]] = {
    "SIMPLE_PINHOLE": _ONE_FOCAL,
    "PINHOLE": _TWO_FOCAL,
    "SIMPLE_RADIAL": (*_ONE_FOCAL, "k1"),
    "RADIAL": (*_ONE_FOCAL, "k1", "k2"),
    "OPENCV": (*_TWO_FOCAL, "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": (*_TWO_FOCAL, "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
}
_COEFFICIENTS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
# Pixels that a picture without distortion may be off; less is not worth the blur of resampling.
LEAST_SHIFT = 0.01
# Pixels. Coordinates divided by a shorter focal length may be no numbers.
LEAST_FOCAL = 1e-6
# Pixels that are interpolated at a time.
BAND = 1 << 20


@dataclass(frozen=True)
class Lens(CheckedAtOnce):
    """Intrinsics of a calibrated camera.

    Attributes
    ----------
    width, height
        Size of its pictures, pixels.
    fx, fy, cx, cy
        Focal lengths and principal point, pixels.
    k1, k2, k3, k4, k5, k6, p1, p2
        Distortion, as above.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    checks: ClassVar[dict[str, Check]] = {
        **dict.fromkeys(("width", "height"), by(whole, 1, MAX_SIDE)),
        **dict.fromkeys(("fx", "fy"), by(number, above=LEAST_FOCAL)),
        **dict.fromkeys(("cx", "cy", *_COEFFICIENTS), number),
    }

    @classmethod
    def of_model(cls, where: str, model: str, width: int, height: int, values: Sequence[float]) -> Lens:
        """Return the lens of a model of COLMAP (`MODELS`).

        Raises
        ------
        ValueError
            If the model is unknown here, or has another number of parameters.
        """
        if model not in MODELS:
            raise ValueError(f"{where}: its camera model '{model}' is not supported (known: {', '.join(MODELS)}); "
                             "undistort the pictures first, for example with COLMAP's image_undistorter")
        names = MODELS[model]
        if len(values) != len(names):
            raise ValueError(f"{where}: camera model '{model}' has {len(names)} parameters ({', '.join(names)}), not "
                             f"{len(values)}")  # fmt: skip
        named = dict(zip(names, values, strict=True))
        focal = named.pop("f", None)
        return cls(width, height, **(named if focal is None else {"fx": focal, "fy": focal} | named))

    def of_size(self, height: int, width: int) -> Lens:
        """Return the same lens for pictures of another size that show the same."""
        x, y = width / self.width, height / self.height
        return replace(self, width=width, height=height, fx=self.fx * x, fy=self.fy * y, cx=self.cx * x, cy=self.cy * y)

    def camera(self, to_world: ArrayLike) -> Camera:
        """Return the camera without distortion and with square pixels of the size fx, at a pose in Blender's axes."""
        return Camera(
            np.asarray(to_world, np.float64), 2.0 * float(np.arctan(0.5 * self.width / self.fx)),
            self.width, self.height,
            np.array([0.5 - self.cx / self.width, (self.cy - 0.5 * self.height) / self.width]),
        )  # fmt: skip

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

    @property
    def shift(self) -> float:
        """Largest distance, in pixels, between a place in the picture and in that of `camera`."""
        return max(float(np.abs(self.distort(self._ideal(rows)) - self._centres(rows)).max()) for rows in self._bands())

    def undistort(self, picture: ArrayLike, weight: ArrayLike | None = None) -> tuple[NDArray[Any], F64]:
        """Return a picture as `camera` would have taken it.

        Each pixel is interpolated linearly between four pixels of the picture. Pixels of which the picture has
        nothing, since they lie outside or where the model folds back, have the weight 0.

        Parameters
        ----------
        picture
            (H, W, C) linear light of the lens's size.
        weight
            (H, W) weight of each pixel, as a mask; None: all 1.

        Returns
        -------
        The picture and its weights, of the same size.
        """
        image = light_values("Lens", "picture", picture, (self.height, self.width, None))
        weights = np.ones(image.shape[:2]) if weight is None else np.asarray(
            array("Lens", "weight", weight, image.shape[:2], np.float64, least=0.0, booleans=True))  # fmt: skip
        if self.shift < LEAST_SHIFT:
            return image, weights
        limit = self._limit()
        total, found = np.zeros(image.shape[:2]), np.zeros_like(image)
        for rows in self._bands():
            found[rows], total[rows] = self._interpolated(image, weights, rows, limit)
        return found, total

    def _interpolated(self, image: NDArray[Any], weights: F64, rows: slice, limit: float) -> tuple[F64, F64]:
        """Return some rows of the undistorted picture, and their weights."""
        ideal = self._ideal(rows)
        source = self.distort(ideal)
        inside = ((ideal**2).sum(axis=2) <= limit * limit) & (source >= 0.0).all(axis=2)
        inside &= (source[..., 0] <= self.width) & (source[..., 1] <= self.height)
        at = np.clip(np.where(inside[..., None], source, 0.5) - 0.5, 0.0, [self.width - 1, self.height - 1])
        low = np.minimum(at.astype(np.int64), [max(self.width - 2, 0), max(self.height - 2, 0)])
        part = at - low
        total, found = np.zeros(inside.shape), np.zeros((*inside.shape, image.shape[2]))
        for dx in (0, 1):
            for dy in (0, 1):
                x, y = np.minimum(low[..., 0] + dx, self.width - 1), np.minimum(low[..., 1] + dy, self.height - 1)
                share = np.abs(1.0 - dx - part[..., 0]) * np.abs(1.0 - dy - part[..., 1]) * weights[y, x]
                total += share
                found += share[..., None] * image[y, x]
        total *= inside
        return found / np.where(total > 0.0, total, np.inf)[..., None], total

    def _bands(self) -> Iterator[slice]:
        """Slices of rows of about a million pixels, which bound the memory that photographs need."""
        step = max(1, BAND // self.width)
        return (slice(first, min(first + step, self.height)) for first in range(0, self.height, step))

    def _centres(self, rows: slice) -> F64:
        x, y = np.meshgrid(np.arange(self.width) + 0.5, np.arange(rows.start, rows.stop) + 0.5)
        return np.stack([x, y], axis=2)

    def _ideal(self, rows: slice) -> F64:
        """(rows, W, 2) ideal coordinates of pixels of `camera`."""
        return np.asarray((self._centres(rows) - [self.cx, self.cy]) / self.fx)

    def _limit(self) -> float:
        """Distance of ideal coordinates from the axis up to which the distortion grows outwards; then it folds back."""
        corners = [(x - self.cx, y - self.cy) for x in (0, self.width) for y in (0, self.height)]
        radii = np.linspace(0.0, max(float(np.hypot(*corner)) for corner in corners) / self.fx, 4096)
        with np.errstate(divide="ignore", invalid="ignore"):
            falls = ~(np.diff(radii * self._radial(radii * radii)) > 0.0)
        return float(radii[np.argmax(falls)]) if falls.any() else np.inf

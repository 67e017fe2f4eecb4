"""What calibrated lenses of all kinds have in common: the size of their pictures, and pictures as a camera takes them.

A camera of a fit has fewer kinds of distortion than calibrated lenses. What is left of the distortion is taken out of
the picture: each pixel of the camera is interpolated at the place where the lens has it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array, light_values, number, whole
from .._fields import Check, CheckedAtOnce, by
from ..scene.camera import MAX_SIDE, Camera

F64 = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Pixels. Coordinates divided by a shorter focal length may be no numbers.
LEAST_FOCAL = 1e-6
# Pixels that are interpolated at a time.
BAND = 1 << 20
# Places along a side at which distortions are examined.
SAMPLED = 257


@dataclass(frozen=True)
class Intrinsics(CheckedAtOnce, ABC):
    """Size, focal lengths and principal point of a calibrated camera.

    Attributes
    ----------
    width, height
        Size of its pictures, pixels.
    fx, fy, cx, cy
        Focal lengths and principal point, pixels.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    checks: ClassVar[dict[str, Check]] = {
        **dict.fromkeys(("width", "height"), by(whole, 1, MAX_SIDE)),
        **dict.fromkeys(("fx", "fy"), by(number, above=LEAST_FOCAL)),
        **dict.fromkeys(("cx", "cy"), number),
    }
    # Pixels that the picture of `camera` may be off; less is not worth the blur of resampling.
    least_shift: ClassVar[float] = 0.01

    @abstractmethod
    def camera(self, to_world: ArrayLike) -> Camera:
        """Return the camera at a pose in Blender's axes."""

    @abstractmethod
    def _source(self, places: F64) -> tuple[F64, Flags]:
        """Where the picture has (h, w, 2) places of that of `camera`, and (h, w) whether the model has them."""

    def of_size(self, height: int, width: int) -> Self:
        """Return the same lens for pictures of another size that show the same."""
        x, y = width / self.width, height / self.height
        return replace(self, width=width, height=height, fx=self.fx * x, fy=self.fy * y, cx=self.cx * x, cy=self.cy * y)

    @property
    def shift(self) -> float:
        """Largest distance along an axis, in pixels, between a place in the picture and in that of `camera`."""
        places = self._sampled()
        source, seen = self._source(places)
        return float(np.abs(source - places)[seen].max(initial=0.0))

    @property
    def keeps_pictures(self) -> bool:
        """Whether `undistort` returns pictures and weights as they are."""
        return self.shift < self.least_shift and bool(self._source(self._sampled())[1].all())

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
        where = type(self).__name__
        image = light_values(where, "picture", picture, (self.height, self.width, None))
        weights = np.ones(image.shape[:2]) if weight is None else np.asarray(
            array(where, "weight", weight, image.shape[:2], np.float64, least=0.0, booleans=True))  # fmt: skip
        if self.shift < self.least_shift:
            return image, weights * np.concatenate([self._source(self._centres(rows))[1] for rows in self._bands()])
        total, found = np.zeros(image.shape[:2]), np.zeros_like(image)
        for rows in self._bands():
            found[rows], total[rows] = self._interpolated(image, weights, rows)
        return found, total

    def _interpolated(self, image: NDArray[Any], weights: F64, rows: slice) -> tuple[F64, F64]:
        """Return some rows of the undistorted picture, and their weights."""
        source, inside = self._source(self._centres(rows))
        inside = inside & (source >= 0.0).all(axis=2)
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

    def _sampled(self) -> F64:
        """(h, w, 2) evenly spaced centres of pixels, with those at the border; distortions are smooth."""
        across, along = (np.linspace(0.5, side - 0.5, min(side, SAMPLED)) for side in (self.width, self.height))
        return np.stack(np.meshgrid(across, along), axis=2)

    def _ideal(self, places: F64) -> F64:
        """Distances of places in the picture of `camera` from its principal point, in its focal length fx."""
        return np.asarray((places - [self.cx, self.cy]) / self.fx)

    @property
    def _corner(self) -> float:
        """Distance of the farthest corner of `camera` from its principal point, in its focal length fx."""
        x, y = max(self.cx, self.width - self.cx), max(self.cy, self.height - self.cy)
        return float(np.hypot(x, y)) / self.fx

    @property
    def _lens_shift(self) -> F64:
        """(2,) `Camera.shift` of a camera with square pixels and this principal point."""
        return np.array([0.5 - self.cx / self.width, (self.cy - 0.5 * self.height) / self.width])

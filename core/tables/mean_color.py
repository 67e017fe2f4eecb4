"""Mean colours of images and expressions, for computations that need one colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..expression import Expression, images_of
from ..scene.image import Image
from ..scene.scene import Scene


def mean_color(image: Image, sphere: bool = False) -> NDArray[np.float64]:
    """(3,) mean of an image; negative values count as 0. `sphere`: mean over directions of an equirectangular image."""
    pixels = image.pixels if image.pixels.min() >= 0.0 else np.maximum(image.pixels, 0.0)
    rows = pixels.mean(axis=1, dtype=np.float64)
    weights = np.ones(len(rows))
    if sphere:
        weights = np.sin(np.pi * (np.arange(len(rows)) + 0.5) / len(rows))
    mean = np.average(rows, axis=0, weights=weights)
    return np.repeat(mean, 3) if len(mean) == 1 else mean[:3]


def mean_expression(scene: Scene, expression: Expression) -> NDArray[np.float64]:
    """(3,) mean of the images that an expression reads; 0.5 if it reads none."""
    names = sorted(images_of(expression))
    if not names:
        return np.full(3, 0.5)
    return np.mean([mean_color(scene.images[name]) for name in names], axis=0)

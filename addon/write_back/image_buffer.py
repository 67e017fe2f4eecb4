"""Pixels of image datablocks, as Blender holds them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def pixels_of(image: Any) -> NDArray[np.float32]:
    """Return a copy of an image's numbers, (height * width * channels,), from the lowest row upwards."""
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels

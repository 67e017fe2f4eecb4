"""The curve of sRGB between code values and linear light."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import numeric


def srgb_to_linear(code: ArrayLike) -> NDArray[np.float64]:
    """Convert sRGB code values in [0, 1] to linear light (the piecewise curve of IEC 61966-2-1)."""
    x = np.asarray(numeric("srgb_to_linear", "code", code), np.float64)
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.0) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(light: ArrayLike) -> NDArray[np.float64]:
    """Convert linear light to sRGB code values; the inverse of `srgb_to_linear`."""
    x = np.asarray(numeric("linear_to_srgb", "light", light), np.float64)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 0.0) ** (1.0 / 2.4) - 0.055)

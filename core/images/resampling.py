"""Pictures of another size, by the exact area filter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import numeric, wholes
from ..scene.camera import MAX_SIDE

# Largest relative difference of two aspects that counts as rounding.
MOST_STRETCHED = 0.05


def resample(picture: ArrayLike, size: tuple[int, int]) -> NDArray[Any]:
    """Return a picture of another size: each new pixel is the mean over its area.

    The picture counts as constant within each of its pixels, and both pictures cover the same area. The mean over the
    picture stays the same.

    Parameters
    ----------
    picture
        (H, W) or (H, W, C); colours must be linear light, and premultiplied if there is an alpha.
    size
        (height, width) of the result.

    Returns
    -------
    (height, width) or (height, width, C) of the picture's float type; the picture itself if it has this size.
    """
    source = numeric("resample", "picture", picture, booleans=True)
    if source.ndim not in (2, 3) or source.size == 0:
        raise ValueError(f"resample: picture must have the shape (H, W) or (H, W, C), not {source.shape}")
    height, width = wholes("resample", "size", size, 2, 1, MAX_SIDE)
    kind = source.dtype if source.dtype.kind == "f" else np.dtype(np.float64)
    if source.shape[:2] == (height, width):
        return source.astype(kind, copy=False)
    return _means(_means(source.astype(np.float64), height, 0), width, 1).astype(kind)


def _means(x: NDArray[np.float64], count: int, axis: int) -> NDArray[np.float64]:
    """Means over `count` equal intervals of an axis: differences of its integral, which is linear within a pixel."""
    old = x.shape[axis]
    if old == count:
        return x
    x = np.moveaxis(x, axis, 0)
    integral = np.concatenate([np.zeros_like(x[:1]), np.cumsum(x, axis=0)])
    # In whole numbers, so that borders that coincide do so exactly.
    before, rest = np.divmod(np.arange(count + 1) * old, count)
    fraction = (rest / count).reshape(-1, *[1] * (x.ndim - 1))
    at = integral[before] + fraction * x[np.minimum(before, old - 1)]
    return np.moveaxis(np.diff(at, axis=0) * (count / old), 0, axis)


def same_aspect(one: tuple[int, ...], other: tuple[int, ...]) -> bool:
    """Whether two sizes (height, width, …) have one aspect, up to the rounding of the smaller one to whole pixels."""
    (high, wide), (height, width) = sorted((one[:2], other[:2]))
    rounding = min(abs(high - height * wide / width), abs(wide - width * high / height))
    return rounding < 1.0 and abs(high * width / (height * wide) - 1.0) < MOST_STRETCHED

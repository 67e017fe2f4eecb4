"""Blender's dither in 8-bit pictures, which is known and can be taken away.

Before Blender rounds a picture to 8 bits, it adds noise to the code values, the same to all channels of a pixel. It is
a hash of the pixel's column and row, so it is known. If code = T + d + r with the dither d and the rounding r, then
code - d has the error r alone: subtractive dithering (Roberts 1962). At Blender's default, d has 1.3 times the variance
of r.

Whether a picture contains the dither, and how much of it, follows from the picture: its second differences of
neighbouring pixels are fitted by those of the dither. So nothing is taken away from a photograph.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

# Largest value of the dither, in code values from 0 to 1, at the intensity 1.
LARGEST = 0.0033
# Differences of neighbours above this are taken for edges of the picture, in whole codes.
EDGE = 4.0
# Variance of the amount, relative to that of independent differences: neighbouring ones share pixels.
INDEPENDENT = 3.0
# Standard errors by which the amount of the dither has to differ from 0.
SIGNIFICANT = 5.0


def pattern(height: int, width: int) -> F64:
    """(H, W) dither at the intensity 1, row 0 on top: triangularly distributed around 0.

    The hash is "iqint3" of Jarzynski & Olano 2020, of column and row, counted from the lower left.
    """
    x, y = np.meshgrid(np.arange(width, dtype=np.uint32), np.arange(height, dtype=np.uint32)[::-1])
    factor = np.uint32(1103515245)
    first, second = factor * (x >> np.uint32(1) ^ y), factor * (y >> np.uint32(1) ^ x)
    uniform = 2.0 * (factor * (first ^ second >> np.uint32(3))).astype(np.float64) / 0xFFFFFFFF - 1.0
    return LARGEST * np.sign(uniform) * (1.0 - np.sqrt(1.0 - np.abs(uniform)))


def without_dither(values: F64, levels: int) -> F64:
    """Return code values (H, W, C) in [0, 1] without Blender's dither; without it, or not of 8 bits, as they are.

    Channels at their smallest or largest value stay, since they may have been clipped. An alpha is never dithered.
    """
    if levels != 255 or values.ndim != 3 or min(values.shape[:2]) < 3:
        return values
    height, width = values.shape[:2]
    noise = pattern(height, width)
    inner = (values[..., :3] > 0.0) & (values[..., :3] < 1.0)
    amount = _amount(values[..., :3], inner, noise, levels)
    if amount == 0.0:
        return values
    out = values.copy()
    out[..., :3] = np.where(inner, np.clip(values[..., :3] - amount * noise[..., None], 0.0, 1.0), values[..., :3])
    return out


def _amount(values: F64, inner: NDArray[np.bool_], noise: F64, levels: int) -> float:
    """Factor of the dither that a picture contains; 0 if it does not differ from 0 significantly.

    It is that of least squares over second differences, which smooth shading hardly has, where there is no edge. All
    channels have the same dither, so their mean counts once.
    """
    whole = inner.all(axis=2)
    found, known = [], []
    for here, picture, own in ((whole, values.mean(axis=2), noise), (whole.T, values.mean(axis=2).T, noise.T)):
        smooth = np.abs(np.diff(picture, axis=0)) < EDGE / levels
        used = here[2:] & here[1:-1] & here[:-2] & smooth[1:] & smooth[:-1]
        found.append(np.diff(picture, n=2, axis=0)[used])
        known.append(np.diff(own, n=2, axis=0)[used])
    a, b = np.concatenate(found), np.concatenate(known)
    square = float(b @ b)
    if square == 0.0:
        return 0.0
    amount = float(a @ b) / square
    error = np.sqrt(INDEPENDENT * float(((a - amount * b) ** 2).mean()) / square)
    return amount if amount > SIGNIFICANT * error else 0.0

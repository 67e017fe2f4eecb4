"""The difference of two renderers' mean pictures, relative to the noise of both.

Each renderer gives a few pictures with different seeds. Their spread is the noise; summed over blocks of 8 x 8 pixels
the difference of the means is divided by its standard error, and Welch's formula gives the degrees of freedom of the
quotient, which is turned into a normal deviate. Of 1000 such numbers 2.7 lie beyond 3 if both renderers have the same
expected picture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.support.block_statistics import block_sums
from tests.support.distributions import student_to_normal

BLOCK = 8
# Relative precision up to which two renderers compute the same value: tables, single precision, texture filters.
PRECISION = 1e-3

# What counts as agreement.
MEAN_LIMIT = 0.01
BEYOND_LIMIT = 0.02
EXCESS_LIMIT = 0.01


@dataclass(frozen=True)
class Agreement:
    """Outcome of a comparison; all but `beyond` relative to the mean of the second picture.

    Attributes
    ----------
    mean, mean_error
        Difference of the pictures' means, signed, and its standard error.
    beyond
        Share of blocks and channels that are more than three standard errors apart; 0.0027 by chance.
    rmse, noise
        Root mean square difference of the blocks' means, and what the noise lets expect.
    pixel_rmse, pixel_noise
        The same of single pixels.
    our_noise, their_noise
        Root mean square standard deviation of the pixels of one picture.
    """

    mean: float
    mean_error: float
    beyond: float
    rmse: float
    noise: float
    pixel_rmse: float
    pixel_noise: float
    our_noise: float
    their_noise: float

    @property
    def excess(self) -> float:
        """The part of the blocks' difference that noise doesn't explain."""
        return float(np.sqrt(max(self.rmse**2 - self.noise**2, 0.0)))

    @property
    def agrees(self) -> bool:
        """Whether the mean and the picture are the same but for noise."""
        return abs(self.mean) <= MEAN_LIMIT and (self.beyond <= BEYOND_LIMIT or self.excess <= EXCESS_LIMIT)


def compare(ours: NDArray[np.float32], theirs: NDArray[np.float32]) -> tuple[Agreement, NDArray[np.float64]]:
    """Compare (seeds, H, W, 3) pictures; also returns the (rows, columns, 3) blocks' normal deviates.

    Raises
    ------
    ValueError
        If the sizes differ, or one side has a single seed.
    """
    if ours.shape[1:] != theirs.shape[1:]:
        raise ValueError(f"the pictures have different sizes: {ours.shape[1:3]} and {theirs.shape[1:3]}")
    if min(len(ours), len(theirs)) < 2:
        raise ValueError("the noise can't be estimated from one seed")
    a, b = (np.asarray(x, np.float64) for x in (ours, theirs))
    scale = float(b.mean()) or 1.0
    counts = block_sums(np.ones((*a.shape[1:3], 1)), BLOCK)
    blocks = [block_sums(x, BLOCK) / counts for x in (a, b)]
    difference, variance, freedom = _welch(*blocks)
    # Blocks without noise: a small difference is rounding, not disagreement.
    floor = (PRECISION * np.maximum(blocks[1].mean(axis=0), 0.01 * scale)) ** 2
    z = student_to_normal(difference / np.sqrt(variance + floor), np.where(variance > floor, freedom, 1e9))
    pixels, pixel_variance, _ = _welch(a, b)
    mean, mean_variance, _ = _welch(a.mean(axis=(1, 2, 3)), b.mean(axis=(1, 2, 3)))
    return Agreement(
        mean=float(mean) / scale,
        mean_error=math.sqrt(mean_variance) / scale,
        beyond=float(np.mean(np.abs(z) > 3.0)),
        rmse=_root_mean(difference**2) / scale,
        noise=_root_mean(variance) / scale,
        pixel_rmse=_root_mean(pixels**2) / scale,
        pixel_noise=_root_mean(pixel_variance) / scale,
        our_noise=_root_mean(a.var(axis=0, ddof=1)) / scale,
        their_noise=_root_mean(b.var(axis=0, ddof=1)) / scale,
    ), z


def _welch(
    a: NDArray[np.float64], b: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Difference of the means over seeds, its variance, and that estimate's degrees of freedom (Welch 1947)."""
    ours, theirs = (x.var(axis=0, ddof=1) / len(x) for x in (a, b))
    spread = ours**2 / (len(a) - 1) + theirs**2 / (len(b) - 1)
    variance = ours + theirs
    return a.mean(axis=0) - b.mean(axis=0), variance, np.maximum(variance**2 / np.maximum(spread, 1e-300), 1.0)


def _root_mean(squares: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(squares)))

"""Which iteration of a fit counts as the best."""

from __future__ import annotations

import numpy as np

from edgegrad.fitting.history import SMOOTHED_OVER, chance


def test_the_last_of_equally_good_iterations_is_not_lost_to_chance() -> None:
    """Of 600 noisy losses of the same mean, the least smoothed one is no better than the last."""
    losses = np.random.default_rng(0).normal(1.0, 0.1, (2000, 600))
    smoothed = np.stack([np.convolve(row, np.full(SMOOTHED_OVER, 1.0 / SMOOTHED_OVER), "valid") for row in losses])
    error = 0.1 / np.sqrt(SMOOTHED_OVER)
    kept = smoothed[:, -1] <= smoothed.min(axis=1) + chance(600) * error
    assert kept.mean() > 0.9
    worse = smoothed[:, -1] + 9.0 * error
    assert (worse <= smoothed.min(axis=1) + chance(600) * error).mean() < 0.01

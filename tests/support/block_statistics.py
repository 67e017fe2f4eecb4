"""Does an estimated picture agree with a reference within the noise of both? A chi-square test of block sums.

Single pixels are too noisy to show a small bias, and one number for the whole picture hides it. So pictures are
summed over blocks of 8 x 8 pixels, and each block's difference is divided by its standard error. That error is itself
estimated from a few seeds, so the quotient follows Student's distribution; it is turned into the normal deviate z of
the same tail probability. The sum of z^2 over the blocks then has a chi-square distribution, which shows a small bias
in many blocks; the largest |z| shows a large one in a single block. Colour channels share their samples, so each is
tested by itself. The smallest of all these p-values is multiplied by their number (Bonferroni).

The level of an alarm is set for the whole suite: all statistical comparisons of a run together raise a false alarm with
a probability of at most `SUITE_ALARM`, since each has the level `SUITE_ALARM / MOST_COMPARISONS` (Bonferroni) and
`tests/conftest.py` fails a run that makes more of them. So a change of sampling, which draws other numbers for every
test, leaves them all passing; a seed that raises an alarm has found something and is not to be replaced.
"""

from __future__ import annotations

import math
import pathlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

import edgegrad
from tests.support import peer_scenes
from tests.support.distributions import (
    chi_square_quantile,
    chi_square_tail,
    student_quantile,
    student_to_normal,
    two_sided,
)

Floats = NDArray[np.float64]

# With this probability any comparison of a whole run fails though all estimates are right.
SUITE_ALARM = 1e-3
# Comparisons that a run may make: those of all tests, the slow ones too, with some room for further ones.
MOST_COMPARISONS = 2000
# Level of one comparison.
ALARM = SUITE_ALARM / MOST_COMPARISONS
# Level of each of two comparisons with independent numbers that must both fail to raise an alarm.
STAGE_ALARM = math.sqrt(ALARM)
# What every comparison must notice: a derivative that is wrong by this part of itself raises an alarm. A term
# that is left out, counted twice or of the wrong sign changes more.
NOTICED = 0.5
# Values of theta at which a central difference's interval is sampled.
THETAS = 8
# Blocks with less than this part of the largest variance count as without noise: they must simply be equal.
QUIET = 1e-6


@dataclass(frozen=True)
class Agreement:
    """Outcome of a comparison.

    Attributes
    ----------
    z
        (rows, columns, 3) normal deviates of the blocks; 0 in quiet blocks.
    p_value
        Probability of a difference this large when both have the same mean.
    error, noise
        Root of the summed squares of the blocks' differences, and what the standard errors let expect, both
        relative to the reference.
    strength
        (rows, columns, 3) reference over standard error; 0 in quiet blocks.
    """

    z: Floats
    p_value: float
    error: float
    noise: float
    strength: Floats

    def noticed(self, level: float) -> float:
        """The smallest relative error of the whole reference that raises an alarm in every second comparison.

        An error by the factor 1 + d adds d times `strength` to the deviates z. The sum of their squares is expected to
        grow by d^2 times the sum of the squared strengths, and a single deviate by d times its strength.
        """
        strongest = float(np.abs(self.strength).max())
        if strongest == 0.0:
            return math.inf
        channels = [c for c in range(3) if self.strength[..., c].any()]
        loud = int(np.count_nonzero(self.strength))
        alone = NormalDist().inv_cdf(1.0 - level / (4.0 * loud)) / strongest
        together = math.inf
        for c in channels:
            blocks = int(np.count_nonzero(self.strength[..., c]))
            needed = chi_square_quantile(level / (2.0 * len(channels)), blocks) - blocks
            together = min(together, math.sqrt(needed / float(np.sum(self.strength[..., c] ** 2))))
        return min(alone, together)

    def __str__(self) -> str:
        rms = math.sqrt(float(np.mean(self.z[self.z != 0.0] ** 2))) if self.z.any() else 0.0
        worst = np.unravel_index(np.argmax(np.abs(self.z)), self.z.shape)
        return (
            f"p = {self.p_value:.2g}, block error {self.error:.4f} (noise {self.noise:.4f}), z rms {rms:.2f}, "
            f"largest {self.z[worst]:+.1f} in block row {worst[0]}, column {worst[1]}, channel {worst[2]}"
        )


def block_sums(image: ArrayLike, size: int = 8) -> Floats:
    """(..., rows, columns, 3) sums over blocks of size x size pixels; blocks at the far borders may be smaller."""
    a = np.asarray(image, np.float64)
    rows, columns = np.arange(0, a.shape[-3], size), np.arange(0, a.shape[-2], size)
    return np.asarray(np.add.reduceat(np.add.reduceat(a, rows, axis=-3), columns, axis=-2))


def compare(samples: ArrayLike, reference: ArrayLike, stderr: ArrayLike | None = None) -> Agreement:
    """Test the mean of independent estimates against a reference.

    Parameters
    ----------
    samples
        (groups, seeds, H, W, 3), seeds >= 2; the mean over all is tested. The groups (values of theta) may have
        different means, seeds within a group only differ by noise. Or (seeds, H, W, 3): one group.
    reference, stderr
        (H, W, 3) reference and its standard error per pixel (None: exact).
    """
    samples = np.asarray(samples, np.float64)
    if samples.ndim == 4:
        samples = samples[None]
    groups, seeds = samples.shape[:2]
    if seeds < 2:
        raise ValueError("the noise can't be estimated from one seed")
    sums = block_sums(samples)
    own = sums.var(axis=1, ddof=1).mean(axis=0) / (groups * seeds)
    other = block_sums(np.square(np.zeros(samples.shape[-3:]) if stderr is None else np.asarray(stderr, np.float64)))
    wanted = block_sums(reference)
    difference = sums.mean(axis=(0, 1)) - wanted
    variance = own + other
    scale = float(np.linalg.norm(wanted)) or 1.0
    error, noise = float(np.linalg.norm(difference)) / scale, math.sqrt(float(variance.sum())) / scale
    loud = variance > QUIET * variance.max()
    # Float32 rounding, or an event that is too rare to show in either picture, is no disagreement.
    allowed = 5.0 * math.sqrt(QUIET * float(variance.max())) + 1e-4 * float(np.abs(wanted).max())
    z, strength = np.zeros(difference.shape), np.zeros(difference.shape)
    if loud.any():
        strength[loud] = wanted[loud] / np.sqrt(variance[loud])
        freedom = groups * (seeds - 1) * (variance[loud] / np.maximum(own[loud], 1e-6 * variance[loud])) ** 2
        z[loud] = student_to_normal(difference[loud] / np.sqrt(variance[loud]), freedom)
    if (np.abs(difference[~loud]) > allowed).any():
        return Agreement(z, 0.0, error, noise, strength)
    channels = [c for c in range(3) if loud[..., c].any()]
    together = [chi_square_tail(float(np.sum(z[..., c] ** 2)), int(loud[..., c].sum())) for c in channels]
    alone = two_sided(float(np.abs(z).max())) * int(loud.sum())
    p_value = min([1.0, 2.0 * alone] + [2.0 * len(channels) * p for p in together])
    return Agreement(z, p_value, error, noise, strength)


def over_theta(
    path: str | pathlib.Path,
    eps: float,
    estimate: Callable[[edgegrad.Scene, Mapping[str, Floats], int], ArrayLike],
    seeds: int = 2,
) -> Floats:
    """(THETAS, seeds, H, W, 3) estimates at stratified theta in [-eps/2, eps/2] of the scene in a file.

    A central difference of width eps is the derivative's mean over that interval, not its value at 0.
    `estimate` gets scene, tangent and seed.
    """
    out = []
    for k in range(THETAS):
        scene, tangent = peer_scenes.load_at(path, eps * ((k + 0.5) / THETAS - 0.5))
        out.append([np.asarray(estimate(scene, tangent, seeds * k + s), np.float64) for s in range(seeds)])
    return np.asarray(out)


# ---------------------------------------------------------------- verdicts
class Count:
    """How many comparisons this process has made; `tests/conftest.py` adds up those of all processes of a run."""

    made = 0


def check(outcome: Agreement | float, level: float = ALARM) -> None:
    """Assert that a comparison, or a p-value, raises no alarm; it counts as one comparison of the suite."""
    Count.made += 1
    p_value = outcome if isinstance(outcome, float) else outcome.p_value
    assert p_value > level, str(outcome)


def check_in_stages(estimate: Callable[[int], Agreement]) -> None:
    """Assert that `estimate` of a first seed raises no alarm, or that another one does not confirm it.

    Each of the two stages has the level `STAGE_ALARM`: a false alarm has the probability `ALARM`, and less of an error
    is needed for a true one than with a single comparison of that level.
    """
    outcome = estimate(0)
    if outcome.p_value <= STAGE_ALARM:
        print("to be confirmed:", outcome)
        outcome = estimate(100_000)
    check(outcome, STAGE_ALARM)


def check_noticed(outcome: Agreement, level: float = ALARM) -> None:
    """Assert that a comparison with something wrong raises an alarm: it is sensitive enough.

    This adds nothing to the probability of a false alarm, since it fails where there is none.
    """
    assert outcome.p_value < level, str(outcome)


def mean_p_value(samples: ArrayLike, expected: ArrayLike, rounding: ArrayLike = 0.0) -> float:
    """Probability of means as far from `expected` as those of (n, ...) independent samples (Student, Bonferroni).

    Parameters
    ----------
    rounding
        Difference that errors other than noise may make, in units of the samples.
    """
    a = np.asarray(samples, np.float64)
    difference = np.maximum(np.abs(a.mean(axis=0) - np.asarray(expected, np.float64)) - rounding, 0.0)
    return _smallest(difference, a.var(axis=0, ddof=1) / len(a), np.full(difference.shape, len(a) - 1.0))


def means_p_value(one: ArrayLike, other: ArrayLike, rounding: float = 0.0) -> float:
    """Probability of means of two sets of independent samples as far from each other (Welch 1947, Bonferroni)."""
    a, b = np.asarray(one, np.float64), np.asarray(other, np.float64)
    parts = [x.var(axis=0, ddof=1) / len(x) for x in (a, b)]
    variance = parts[0] + parts[1]
    squares = parts[0] ** 2 / (len(a) - 1) + parts[1] ** 2 / (len(b) - 1)
    freedom = np.where(squares > 0.0, variance**2 / np.where(squares > 0.0, squares, 1.0), 1.0)
    return _smallest(np.maximum(np.abs(a.mean(axis=0) - b.mean(axis=0)) - rounding, 0.0), variance, freedom)


def half_width(samples: ArrayLike) -> Floats:
    """By how much means of (n, ...) independent samples must be off for an alarm; smaller errors are not noticed."""
    a = np.asarray(samples, np.float64)
    count = max(1, a[0].size)
    return np.asarray(student_quantile(ALARM / count, len(a) - 1) * a.std(axis=0, ddof=1) / math.sqrt(len(a)))


def normal_p_value(z: ArrayLike) -> float:
    """Probability of a normal deviate as large as the largest of these (Bonferroni)."""
    return min(1.0, two_sided(float(np.abs(z).max())) * np.size(z))


def _smallest(difference: Floats, variance: Floats, freedom: Floats) -> float:
    """The smallest two-sided p-value, times their number; 0 where means differ that have no noise."""
    if np.any((variance == 0.0) & (difference > 0.0)):
        return 0.0
    t = np.where(variance > 0.0, difference / np.sqrt(np.where(variance > 0.0, variance, 1.0)), 0.0)
    z = student_to_normal(np.atleast_1d(t), np.atleast_1d(freedom))
    return normal_p_value(z)

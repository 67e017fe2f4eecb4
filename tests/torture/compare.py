"""The derivative beside differences of pictures, as deviates of a known distribution.

The derivative's mean over an interval of the parameter *is* the difference of the pictures at its ends, divided by its
length: nothing is truncated, and the interval may be long enough for the difference to have little noise. So the
derivative is estimated at random places of the interval with a seed each, the difference with common random numbers
for several other seeds, and the difference of their block sums is divided by its standard error.

Estimates of derivatives may have heavy tails, and then few of them have a mean that is too small more often than not.
So what looks wrong is done again with other seeds and several times as many: an error stays, chance doesn't.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from edgegrad import Renderer, plan
from edgegrad.scene import parameters
from tests.support.block_statistics import block_sums
from tests.support.distributions import student_to_normal
from tests.torture.tame import ABSENT, Comparison

F64 = NDArray[np.float64]
SEEDS, MORE, BLOCK = 12, 6, 6
# Samples per pixel of derivatives, and of pictures, which are cheaper.
SPP, PICTURE_SPP = 48, 192
# Deviates beyond this are looked at again; beyond it both times, they are errors.
DOUBT, ERROR = 3.5, 5.0
# Parts of the difference's size, or of the picture's, that rounding may be.
ROUNDING = 2e-4


@dataclass
class Outcome:
    """The result of a comparison.

    Attributes
    ----------
    z, first
        Deviates of the blocks' sums, of the last round and of the first one.
    derivative, difference, error
        Sums over the picture, and the standard error of what they differ by.
    rounds
        1, or 2 where the first looked wrong.
    missing
        What the plan names as not computed; then nothing is compared.
    """

    z: list[float] = field(default_factory=list)
    derivative: float = 0.0
    difference: float = 0.0
    error: float = 0.0
    rounds: int = 0
    missing: tuple[str, ...] = ()
    first: list[float] = field(default_factory=list)

    @property
    def wrong(self) -> bool:
        """Whether the derivative isn't that of the picture."""
        return max(map(abs, self.z), default=0.0) > ERROR


def compare(c: Comparison, seed: int, scale: int = 1, absent: tuple[str, ...] = ABSENT) -> Outcome:
    """Compare the derivative with differences.

    Parameters
    ----------
    seed
        Of the random numbers.
    scale
        How many times the seeds.
    absent
        Beginnings of the plan's sentences on parts that the scene does not have.
    """
    said = plan(c.scene, [c.path], max_depth=c.max_depth, bounces=c.bounces).missing
    missing = tuple(part for part in said if not part.startswith(absent))
    if missing:
        return Outcome(missing=missing)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        rng = np.random.default_rng(seed)
        out = _round(c, rng, SEEDS * scale, 1)
        first = out.z
        if max(map(abs, out.z), default=0.0) > DOUBT:
            out = _round(c, rng, MORE * SEEDS * scale, 2)
        out.first = first
    return out


def _round(c: Comparison, rng: np.random.Generator, seeds: int, rounds: int) -> Outcome:
    ends = []
    for theta in (c.step, -c.step):
        parameters.put(c.scene, c.path, c.curve(theta)[0])
        renderer = Renderer(c.scene, threads=1)
        ends.append([renderer.render(spp=PICTURE_SPP, max_depth=c.max_depth, bounces=c.bounces, seed=seed)
                     for seed in range(1000 * rounds, 1000 * rounds + seeds)])
    differences = _sums((np.asarray(ends[0], np.float64) - np.asarray(ends[1], np.float64)) / (2.0 * c.step))
    pictures = _sums(np.asarray(ends[0], np.float64)).mean(axis=0)
    found = []
    for theta in rng.uniform(-c.step, c.step, seeds):
        value, rate = c.curve(theta)
        parameters.put(c.scene, c.path, value)
        renderer = Renderer(c.scene, threads=1)
        found.append(renderer.render_forward({c.path: rate}, spp=SPP, max_depth=c.max_depth, bounces=c.bounces,
                                             seed=int(rng.integers(1 << 31))))
    derivatives = _sums(np.asarray(found, np.float64))
    parameters.put(c.scene, c.path, c.curve(0.0)[0])
    z = deviates(derivatives, differences, ROUNDING * (np.abs(pictures) + np.abs(differences).mean(axis=0)))
    totals = [sums.sum(axis=1) for sums in (derivatives, differences)]
    error = float(np.sqrt(sum(total.var(ddof=1) / seeds for total in totals)))
    return Outcome(z.tolist(), float(totals[0].mean()), float(totals[1].mean()), error, rounds)


def _sums(pictures: F64) -> F64:
    """(n, blocks) sums over blocks of all channels."""
    return block_sums(pictures, BLOCK).sum(axis=-1).reshape(len(pictures), -1)


def deviates(one: F64, other: F64, rounding: F64) -> F64:
    """Normal deviates of the differences of two estimates' means (samples, k), by Welch's test.

    Differences below `rounding` (k,) are 0.
    """
    own, others = one.var(axis=0, ddof=1) / len(one), other.var(axis=0, ddof=1) / len(other)
    gap, variance = one.mean(axis=0) - other.mean(axis=0), own + others
    gap = np.sign(gap) * np.maximum(np.abs(gap) - rounding, 0.0)
    quiet = variance <= 1e-30 * np.maximum(gap**2, 1e-300)
    freedom = variance**2 / np.maximum(own**2 / (len(one) - 1) + others**2 / (len(other) - 1), 1e-300)
    t = np.where(quiet, np.sign(gap) * 1e3, gap / np.sqrt(np.where(quiet, 1.0, variance)))
    return student_to_normal(t, np.maximum(freedom, 1.0))

"""Does an estimated picture agree with a reference within the noise of both? A chi-square test of block sums.

Single pixels are too noisy to show a small bias, and one number for the whole picture hides it. So pictures are
summed over blocks of 8 x 8 pixels, and each block's difference is divided by its standard error. That error is itself
estimated from a few seeds, so the quotient follows Student's distribution; it is turned into the normal deviate z of
the same tail probability. The sum of z^2 over the blocks then has a chi-square distribution, which shows a small bias
in many blocks; the largest |z| shows a large one in a single block. Colour channels share their samples, so each is
tested by itself. The smallest of all these p-values is multiplied by their number (Bonferroni).
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

Floats = NDArray[np.float64]

# A correct estimate fails with this probability. Seeds are fixed, so a test that passes goes on passing.
ALARM = 1e-3
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
    """

    z: Floats
    p_value: float
    error: float
    noise: float

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
    # Float32 rounding, or an event too rare for either picture to tell, is no disagreement.
    allowed = 5.0 * math.sqrt(QUIET * float(variance.max())) + 1e-4 * float(np.abs(wanted).max())
    z = np.zeros(difference.shape)
    if loud.any():
        freedom = groups * (seeds - 1) * (variance[loud] / np.maximum(own[loud], 1e-6 * variance[loud])) ** 2
        z[loud] = student_to_normal(difference[loud] / np.sqrt(variance[loud]), freedom)
    if (np.abs(difference[~loud]) > allowed).any():
        return Agreement(z, 0.0, error, noise)
    channels = [c for c in range(3) if loud[..., c].any()]
    together = [chi_square_tail(float(np.sum(z[..., c] ** 2)), int(loud[..., c].sum())) for c in channels]
    alone = math.erfc(float(np.abs(z).max()) / math.sqrt(2.0)) * int(loud.sum())
    p_value = min([1.0, 2.0 * alone] + [2.0 * len(channels) * p for p in together])
    return Agreement(z, p_value, error, noise)


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


# ---------------------------------------------------------------- distributions
def chi_square_tail(x: float, n: int) -> float:
    """P(chi-square with n degrees of freedom > x): the regularised incomplete gamma function Q(n/2, x/2)."""
    a, y = 0.5 * n, 0.5 * x
    if y <= 0.0:
        return 1.0
    scale = math.exp(a * math.log(y) - y - math.lgamma(a))
    if y < a + 1.0:  # series of P
        term = total = 1.0 / a
        k = a
        while term > 1e-16 * total:
            k += 1.0
            term *= y / k
            total += term
        return max(0.0, 1.0 - scale * total)
    # Lentz's continued fraction of Q
    b = y + 1.0 - a
    c, d = 1e300, 1.0 / b
    h = d
    for k in range(1, 10_000):
        an = -k * (k - a)
        b += 2.0
        d = 1.0 / (an * d + b)
        c = b + an / c
        h *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return scale * h


def student_to_normal(t: Floats, freedom: Floats) -> Floats:
    """Normal deviates with the tail probability of Student's t with `freedom` degrees of freedom."""
    flat = [
        math.copysign(_normal_deviate(0.5 * _incomplete_beta(0.5 * n, n / (n + s * s))), s)
        for s, n in zip(np.ravel(t).tolist(), np.ravel(freedom).tolist(), strict=True)
    ]
    return np.reshape(np.asarray(flat, np.float64), np.shape(t))


def _normal_deviate(tail: float) -> float:
    """z >= 0 with P(normal > z) = tail <= 1/2."""
    return abs(NormalDist().inv_cdf(min(max(tail, 1e-300), 0.5)))


def _incomplete_beta(a: float, x: float) -> float:
    """Regularised I_x(a, 1/2), by Lentz's continued fraction on the side where it converges fast."""
    if x >= 1.0:
        return 1.0
    if a > 1e6:  # Student's t is the normal distribution there; -a log x = t^2/2
        return math.erfc(math.sqrt(-a * math.log(x)))
    if x > (a + 1.0) / (a + 2.5):
        return 1.0 - _beta_fraction(0.5, a, 1.0 - x)
    return _beta_fraction(a, 0.5, x)


def _beta_fraction(a: float, b: float, x: float) -> float:
    if x <= 0.0:
        return 0.0
    front = math.exp(
        math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    ) / a
    c, d = 1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0))
    h = d
    for m in range(1, 10_000):
        for numerator in (
            m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
        ):
            d = 1.0 / (1.0 + numerator * d)
            c = 1.0 + numerator / c
            h *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return front * h

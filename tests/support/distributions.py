"""Tail probabilities of the chi-square and of Student's distribution."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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


def chi_square_quantile(tail: float, n: int) -> float:
    """The x with `chi_square_tail(x, n)` = `tail`, by bisection."""
    low, high = 0.0, float(n)
    while chi_square_tail(high, n) > tail:
        low, high = high, 2.0 * high
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if chi_square_tail(middle, n) > tail else (low, middle)
    return 0.5 * (low + high)


def two_sided(z: float) -> float:
    """P(|normal deviate| > |z|)."""
    return math.erfc(abs(z) / math.sqrt(2.0))


def student_to_normal(t: Floats, freedom: Floats) -> Floats:
    """Normal deviates with the tail probability of Student's t with `freedom` degrees of freedom."""
    flat = [
        math.copysign(_normal_deviate(0.5 * _incomplete_beta(0.5 * n, n / (n + s * s))), s)
        for s, n in zip(np.ravel(t).tolist(), np.ravel(freedom).tolist(), strict=True)
    ]
    return np.reshape(np.asarray(flat, np.float64), np.shape(t))


def student_quantile(tail: float, freedom: float) -> float:
    """The t that Student's |t| with `freedom` degrees of freedom exceeds with the probability `tail`, by bisection."""
    low, high = 0.0, 1.0
    while _incomplete_beta(0.5 * freedom, freedom / (freedom + high * high)) > tail:
        low, high = high, 2.0 * high
    for _ in range(60):
        t = 0.5 * (low + high)
        beyond = _incomplete_beta(0.5 * freedom, freedom / (freedom + t * t))
        low, high = (t, high) if beyond > tail else (low, t)
    return 0.5 * (low + high)


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

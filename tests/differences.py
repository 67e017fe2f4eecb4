"""Central differences of single-precision functions, with the error that they may have themselves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]

# Rounding of one evaluation relative to its largest intermediate values, which are taken for ten times the result.
ROUNDING = 10 * 2.0**-23


def central_difference(function: Callable[[float], ArrayLike], step: float) -> tuple[F64, F64]:
    """The derivative of `function` at 0 and a bound of this estimate's error, elementwise.

    Differences over two steps are extrapolated (Richardson 1911); what they differ by bounds the error of the
    truncation, and where the function has a kink or a jump within the steps, that of the whole estimate.
    """
    near, far = (
        (np.asarray(function(h), float) - np.asarray(function(-h), float)) / (2 * h) for h in (step, 2 * step)
    )
    size = np.abs(np.asarray(function(0.0), float)) + step * (np.abs(near) + np.abs(far))
    return (4 * near - far) / 3, np.abs(near - far) + ROUNDING * size / step


def check_derivative(found: ArrayLike, function: Callable[[float], ArrayLike], step: float, outliers: float = 0.01,
                     sharp: float = 0.8) -> None:  # fmt: skip
    """Whether `found` is the derivative of `function` at 0 but for a share of `outliers` (jumps within the steps).

    The differences must be `sharp` enough in that share of the elements that aren't zero: their bounds below a
    twentieth of the typical derivative.
    """
    found = np.asarray(found, float)
    wanted, bound = central_difference(function, step)
    assert np.all(np.isfinite(found))
    moves = (np.abs(wanted) > bound) | (found != 0.0)
    if not np.any(moves):
        return
    typical = np.sqrt(np.mean(wanted[moves] ** 2))
    assert np.mean(bound[moves] < 0.05 * max(typical, 1e-12)) >= sharp
    wrong = np.abs(found - wanted) > bound + 1e-6 * typical
    assert np.mean(wrong[moves]) <= outliers

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
    near, far = ((np.asarray(function(h), float) - np.asarray(function(-h), float)) / (2 * h) for h in (step, 2 * step))
    size = np.abs(np.asarray(function(0.0), float)) + step * (np.abs(near) + np.abs(far))
    return (4 * near - far) / 3, np.abs(near - far) + ROUNDING * size / step


def check_derivative(found: ArrayLike, function: Callable[[float], ArrayLike], step: float,
                     outliers: float = 0.01) -> float:  # fmt: skip
    """Whether `found` is the derivative of `function` at 0 but for a share of `outliers` of the columns that move.

    The function's values are (n, k). Only elements count whose differences say anything: whose bound is below a fifth
    of their derivative, which rules out jumps within the steps. Returns their share among all that move at all; 1 if
    none does.
    """
    found = np.asarray(found, float)
    wanted, bound = central_difference(function, step)
    assert np.all(np.isfinite(found))
    moves = (np.abs(wanted) > bound) | (found != 0.0)
    decided = moves & (bound < 0.2 * np.maximum(np.abs(wanted), np.abs(found)))
    if not np.any(decided):
        return 0.0 if np.any(moves) else 1.0
    typical = np.sqrt(np.mean(wanted[decided] ** 2))
    wrong = decided & (np.abs(found - wanted) > bound + 0.01 * typical)
    assert np.sum(wrong) <= outliers * moves.shape[0] * np.sum(np.any(moves, axis=0))
    return float(np.sum(decided) / np.sum(moves))

"""Central differences of single-precision functions, with the error that they may have themselves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]

# Rounding of one evaluation relative to its result; intermediate values are taken for ten times as large.
ROUNDING, INTERMEDIATE = 2.0**-23, 10.0


def central_difference(
    function: Callable[[float], ArrayLike], step: float, intermediate: float = INTERMEDIATE
) -> tuple[F64, F64]:
    """The derivative of `function` at 0 and a bound of this estimate's error, elementwise.

    Differences over two steps are extrapolated (Richardson 1911); what they differ by bounds the error of the
    truncation, and where the function jumps within the steps, that of the whole estimate. What hardly changes central
    differences shows in two other ways. Second differences of a smooth function grow with the square of the step, those
    of a kink with the step itself. Half way between the places, a polynomial through them has the values of a smooth
    function, and other ones than a function with details as small as the step. `intermediate` is the size of the
    largest intermediate values relative to the result.
    """
    middle = np.asarray(function(0.0), float)
    ahead, behind = ([np.asarray(function(side * h), float) for h in (step, 2 * step)] for side in (1, -1))
    near, far = ((a - b) / (2 * h) for a, b, h in zip(ahead, behind, (step, 2 * step), strict=True))
    bent, wide = (a - 2 * middle + b for a, b in zip(ahead, behind, strict=True))
    kink = np.abs(4 * bent - wide)
    for (one, two), (back, far_back), side in ((ahead, behind, 1), (behind, ahead, -1)):
        between = (-5 * two + 60 * one + 90 * middle - 20 * back + 3 * far_back) / 128  # of the quartic, at half a step
        kink = np.maximum(kink, np.abs(between - np.asarray(function(side * 0.5 * step), float)))
    rounding = intermediate * ROUNDING * (np.abs(middle) + step * (np.abs(near) + np.abs(far)))
    return (4 * near - far) / 3, np.abs(near - far) + (np.maximum(kink - rounding, 0.0) + rounding) / step


def check_derivative(
    found: ArrayLike, function: Callable[[float], ArrayLike], step: float, intermediate: float = INTERMEDIATE,
    repeats: float = 0.0,
) -> float:  # fmt: skip
    """Assert that `found` is the derivative of `function` at 0, as far as differences can show.

    The function's values are (n, k). Only elements count whose differences say anything: whose bound is below a fifth
    of their derivative, which rules out kinks and jumps within the steps. `repeats` is the share of the points at which
    the function is a sawtooth of a period below the step: there differences see any slope. Returns the share of the
    elements that count among all that move at all; 1 if none does.
    """
    found = np.asarray(found, float)
    wanted, bound = central_difference(function, step, intermediate)
    assert np.all(np.isfinite(found))
    moves = (np.abs(wanted) > bound) | (found != 0.0)
    decided = moves & (bound < 0.2 * np.maximum(np.abs(wanted), np.abs(found)))
    if not np.any(decided):
        return 0.0 if np.any(moves) else 1.0
    typical = np.sqrt(np.mean(wanted[decided] ** 2))
    # A hundredth of the typical derivative: elements that are nearly zero by cancellation have lost their digits.
    wrong = decided & (np.abs(found - wanted) > bound + 0.01 * typical)
    assert np.any(wrong, axis=-1).sum() <= repeats * len(wrong), (found[wrong], wanted[wrong], bound[wrong])
    return float(np.sum(decided) / np.sum(moves))

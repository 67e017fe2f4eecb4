"""Exposure and white balance between the scene and a target: factors of its picture that a fit knows or finds.

A photograph P is compared with g I, the rendered picture I times a gain g, which is one number or one a channel. An
unknown g is not a parameter with steps of its own: in each iteration it is the best one for the current picture, so the
loss of the fit is F = min over g of L(g I, P). Since dL/dg = 0 there, dF = g L'(g I, P) dI: the gain counts as constant
(envelope theorem).

The condition is <L'(g I, P), I> = 0, a product of two estimates of the picture. If both came from the same samples,
<I, I> would contain the variance of every pixel and g would be too small, however many pixels there are. Therefore the
picture is rendered in two halves I1, I2 of independent samples, and g solves the mean of <L'(g I1, P), I2> and
<L'(g I2, P), I1>. For a quadratic loss, each is linear in g and in either half, and hence unbiased; what remains is the
variance of g, which falls with the number of pixels. The adjoint of the picture uses the mean of both halves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .targets import WHITE_BALANCE, View

F64 = NDArray[np.float64]
Picture = NDArray[Any]

# Factors around the last gain within which the next one is looked for; the last one is the largest change.
BRACKETS = (1.1, 2.0, 1024.0)
RANGE = BRACKETS[-1]
# Evaluations of the condition for losses that are not quadratic, and relative accuracy of the gain.
EVALUATIONS, ACCURACY = 60, 1e-5
# Largest part of the first values of the condition that may remain if the loss is quadratic.
REMAINDER = 1e-4

# The adjoint of the loss of a view for a rendered picture.
Adjoint = Callable[[View, Picture], Picture]


class Gains:
    """The gains of the views of a fit.

    Attributes
    ----------
    values
        (3,) gain of each view: that of its target, or the last one that was found; 1 at the start.
    """

    def __init__(self, seen: Sequence[View]) -> None:
        self._seen = seen
        self.values = [np.ones(3) if isinstance(view.gain, str) else np.array(view.gain) for view in seen]

    def find(self, adjoint: Adjoint, halves: Mapping[int, tuple[Picture, ...]]) -> list[F64]:
        """Return the gains with the best ones of the views whose pictures are given, each in its two halves."""
        out = list(self.values)
        for kind, group in groups(self._seen):
            members = [j for j in halves if j in group]
            if members:
                best = best_gain([(self._seen[j], halves[j]) for j in members], adjoint, kind, self.values[members[0]])
                for j in group:
                    out[j] = best
        return out


def groups(seen: Sequence[View]) -> list[tuple[str, list[int]]]:
    """Return the unknown gains: the kind of each, and the numbers of the views that share it."""
    out: dict[tuple[str, str | int], list[int]] = {}
    for j, view in enumerate(seen):
        if isinstance(view.gain, str):
            out.setdefault((view.gain, view.shared or j), []).append(j)
    return [(kind, members) for (kind, _), members in out.items()]


def best_gain(seen: Sequence[tuple[View, tuple[Picture, ...]]], adjoint: Adjoint, kind: str, start: F64) -> F64:
    """Return the (3,) gain at which the loss of all views together is smallest.

    Parameters
    ----------
    seen
        Views that share the gain, and two independent estimates of the picture of each.
    adjoint
        Adjoint of the loss of a view.
    kind
        "exposure": equal for all channels, or "white balance".
    start
        (3,) gain > 0 where the search begins, and which stays for a channel without light.
    """

    def condition(gain: F64) -> F64:
        total = np.zeros(3)
        for view, (first, second) in seen:
            for mine, other in ((first, second), (second, first)):
                slope = view.weight * np.asarray(adjoint(view, np.asarray(gain * mine, np.float32)), np.float64)
                total += (slope * other).sum(axis=(0, 1))
        return total if kind == WHITE_BALANCE else np.full(3, total.sum())

    low, high = start, 2.0 * start
    at_low, at_high = condition(low), condition(high)
    rising = at_high > at_low
    found = np.where(rising, low - at_low * (high - low) / np.where(rising, at_high - at_low, 1.0), start)
    found = np.clip(found, start / RANGE, start * RANGE)
    remainder = np.abs(condition(found))
    inside = (found > start / RANGE) & (found < start * RANGE)
    if (rising & inside & (remainder <= REMAINDER * np.maximum(np.abs(at_low), np.abs(at_high)))).all():
        return np.asarray(found)
    return _root(condition, start)


def _root(condition: Callable[[F64], F64], start: F64) -> F64:
    """Find where an increasing function of each gain is 0, by the Illinois method in log(gain)."""
    middle = np.log(start)
    for factor in BRACKETS:
        low, high = middle - np.log(factor), middle + np.log(factor)
        at_low, at_high = condition(np.exp(low)), condition(np.exp(high))
        known = (at_low < 0.0) & (at_high > 0.0)
        if known.all():
            break
    # A condition of one sign has its optimum at an end of the range; one that is 0 throughout has none.
    end = np.where(at_high < 0.0, high, np.where(at_low > 0.0, low, middle))
    for _ in range(EVALUATIONS):
        with np.errstate(divide="ignore", invalid="ignore"):
            cut = (low * at_high - high * at_low) / (at_high - at_low)
        # Losses such as |d| have jumps and flat parts; each step shortens the interval by a tenth at least.
        width = high - low
        middle = np.where(known, np.clip(cut, low + 0.1 * width, high - 0.1 * width), end)
        value = condition(np.exp(middle))
        below = value < 0.0
        at_low, at_high = np.where(below, value, 0.5 * at_low), np.where(below, 0.5 * at_high, value)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
        if (~known | (high - low < ACCURACY)).all():
            break
    return np.asarray(np.exp(middle))

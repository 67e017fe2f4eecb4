"""The losses of a fit's iterations, and the values that count as the best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
# Values of a fit's parameters, and the gains of its pictures.
Values = tuple[dict[str, Any], list[F64]]

# Iterations over which the loss is averaged before it is compared with the best so far: the loss of a single noisy
# picture may be small by chance.
SMOOTHED_OVER = 5
# Last iterations whose losses are used to estimate the noise of the loss.
NOISE_OVER = 20


class History:
    """What a fit remembers of its iterations.

    Attributes
    ----------
    newest
        (n,) most recent loss of each picture; NaN: it was not seen yet.
    losses
        Weighted mean of `newest` after each iteration.
    best
        Index into `losses` of the best values.
    least
        Smallest smoothed loss so far.
    best_values, best_gains
        The best values by their paths, and the gains of the pictures there.
    """

    def __init__(self, weights: Sequence[float], values: dict[str, Any], gains: list[F64]) -> None:
        self._weights = np.array(weights)
        self.newest = np.full(len(weights), np.nan)
        self.losses: list[float] = []
        self.best, self.least = 0, np.inf
        self.best_values, self.best_gains = values, gains

    def record(self, complete: bool, now: Callable[[], Values], *, parts_count: bool = False) -> None:
        """Record the loss of the current values, which `now` returns, and keep the values if they are the best.

        Parameters
        ----------
        complete
            Whether each picture was seen.
        parts_count
            Whether the latest values are the best before.
        """
        known = np.isfinite(self.newest)
        self.losses.append(float((self._weights * self.newest)[known].sum() / self._weights[known].sum()))
        if not complete and parts_count:
            self.keep(*now())
        # If losses differ by less than their noise, the latest values count as the best: the shorter steps at the end
        # average the noise of many gradients.
        if complete and self.smoothed() <= self.least + chance(len(self.losses)) * self._noise():
            self.least = min(self.least, self.smoothed())
            self.keep(*now())

    def keep(self, values: dict[str, Any], gains: list[F64]) -> None:
        """Take the values of the last loss as the best."""
        self.best, self.best_values, self.best_gains = len(self.losses) - 1, values, gains

    def smoothed(self) -> float:
        """Mean of the loss over the last few iterations."""
        return float(np.mean(self.losses[-SMOOTHED_OVER:]))

    def _noise(self) -> float:
        """Standard error of the smoothed loss, from differences of successive losses, which remove a trend."""
        steps = np.diff(self.losses[-NOISE_OVER:])
        return float(np.sqrt(0.5 * np.mean(steps**2) / SMOOTHED_OVER)) if len(steps) else 0.0

    def state(self) -> dict[str, Any]:
        """What a checkpoint stores."""
        return {
            "best_values": {path: np.asarray(value) for path, value in self.best_values.items()},
            "best": self.best,
            "least": self.least,
            "losses": np.array(self.losses),
            "newest": self.newest,
            "best_gains": np.array(self.best_gains),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `state` has returned."""
        self.best, self.least, self.losses = state["best"], state["least"], state["losses"].tolist()
        self.best_values = {path: value if value.ndim else float(value) for path, value in state["best_values"].items()}
        self.newest, self.best_gains = state["newest"], list(state["best_gains"])


def chance(iterations: int) -> float:
    """How many standard errors the least smoothed loss of a fit may lie below a value that is equally good.

    The least of n values lies at most about sqrt(2 log n) standard errors below their mean.
    """
    return 1.0 + float(np.sqrt(2.0 * np.log(max(iterations, 1))))

"""Which pictures each iteration of a fit compares, and how long its steps are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

# Factor of the step length at the end; it falls from 1 along a cosine. Short last steps average out the noise of the
# gradients, but a factor that is too small stops the fit early.
LAST_STEP = 0.05


@dataclass(frozen=True)
class Start:
    """How a frame of a film starts: as its neighbours have changed.

    Attributes
    ----------
    frame, before, after
        Indices of the frame and of its neighbours.
    part
        Weight of the change of `after`; `before` has the rest. Above 1, the change goes on beyond `after`.
    """

    frame: int
    before: int
    after: int
    part: float


@dataclass(frozen=True)
class Turn:
    """One iteration.

    Attributes
    ----------
    views
        Indices of the targets, each once.
    factor
        Factor of the length of the steps.
    progress
        Number in [0, 1] that losses with a schedule get.
    starts
        Frames that begin with this iteration; several ways to begin, of which the best one is taken.
    known
        Indices of the frames that have begun, in their order; empty: the targets are no film.
    """

    views: Sequence[int]
    factor: float
    progress: float
    starts: tuple[tuple[Start, ...], ...] = ()
    known: Sequence[int] = ()


class Schedule(Protocol):
    """The iterations of a fit.

    Attributes
    ----------
    iterations
        Their number.
    complete_after
        Number of iterations until every picture was rendered.
    """

    iterations: int
    complete_after: int

    def turn(self, k: int) -> Turn:
        """Return iteration k, counted from 0."""
        ...


def done_before(schedule: Schedule, views: int) -> NDArray[np.float64]:
    """Return the part of a fit that is done before each iteration, before the last look at all targets, and at its end.

    Targets take equal times, but iterations may have different numbers of them.
    """
    targets = [len(schedule.turn(k).views) for k in range(schedule.iterations)]
    done = np.cumsum([0.0, *targets, views])
    return np.asarray(done / done[-1])


class Cycle:
    """All pictures in turns, with steps that get shorter.

    Parameters
    ----------
    views
        Number of targets.
    per_iteration
        Number of targets of each iteration.
    iterations
        Number of iterations.
    seed
        Seed of the order of the targets.
    """

    def __init__(self, views: int, per_iteration: int, iterations: int, seed: int) -> None:
        self.iterations, self.complete_after = iterations, -(-views // per_iteration)
        self._per_iteration = per_iteration
        self._order = np.random.default_rng(seed).permutation(views)

    def turn(self, k: int) -> Turn:
        """Return iteration k, counted from 0."""
        return Turn(in_turns(self._order, k, self._per_iteration), shortened(k, self.iterations),
                    min(k / max(self.iterations - 1, 1), 1.0))  # fmt: skip


def in_turns(order: Sequence[int] | NDArray[np.int64], k: int, count: int) -> list[int]:
    """Return the k-th `count` of the entries, which follow each other in a circle."""
    return [int(order[(k * count + n) % len(order)]) for n in range(count)]


def shortened(k: int, iterations: int) -> float:
    """Return the factor of the steps of iteration k, from 1 down to `LAST_STEP` along a cosine."""
    return float(LAST_STEP + (1.0 - LAST_STEP) * 0.5 * (1.0 + np.cos(np.pi * k / iterations)))

"""A second look for a start, where a fit of poses or places has hardly come closer to its targets.

A gradient may lead away from where an object should be: a highlight in a wrong place costs twice what none costs, so
that a shiny ball leaves the light. Its coarse pictures tell, since they are compared without a path between them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..driven import Steps
from ..run import Run
from ..variables import Unknown
from .coarse import Coarse, moves_of
from .find_start import find_starts, pictures_for, plainest

# Iterations before the look, as a part of all, and the least.
AFTER, SOONEST = 0.25, 10
# Part of its first loss that a fit has left if it has hardly come closer.
HARDLY = 0.25
# What part of the present loss of coarse pictures those of another place may have.
BETTER = 0.5
# Coarse pictures, relative to those of a search before the first iteration.
MORE = 2


class SecondLook:
    """What a fit calls before each iteration.

    Parameters
    ----------
    run
        The fit, before its first iteration.
    unknowns
        Makes variables that begin with the present values of the scene.
    """

    def __init__(self, run: Run, unknowns: Callable[[], list[Unknown]]) -> None:
        self._run, self._unknowns = run, unknowns
        self._driven = [item.state() for item in run.variables]
        self._at = max(SOONEST, round(AFTER * run.iterations), run.schedule.complete_after)

    def __call__(self, k: int) -> None:
        run = self._run
        if k != self._at or k >= run.iterations or run.history.smoothed() < HARDLY * run.history.losses[0]:
            return
        moves = moves_of(run)
        coarse = Coarse(run, moves)
        here = np.zeros(moves.count)
        now = coarse.loss(here)
        generator = np.random.default_rng([run.seed, 2])
        cameras = [replace(view.camera) for view in run.seen]
        pictures = MORE * pictures_for(moves.count)
        found = find_starts(coarse.loss, moves, cameras, now, pictures, generator, self._tell(k))
        if not found or found[0].loss >= BETTER * now:  # none: no picture is finite
            coarse.take(here)
            return
        best = plainest(coarse.loss, found[0], moves)
        # Go there, where optimisers begin anew
        for variable, state in zip(run.variables, self._driven, strict=True):
            variable.restore(state)
        run.steps = Steps(run.variables)
        coarse.take(best.vector)
        for item, fresh in zip(run.unknowns, self._unknowns(), strict=True):
            if item.path in moves.parts:
                item.restore(fresh.state())
        run.notes.append(
            f"after {k} iterations, which had hardly brought the pictures closer to their targets, the fit went on "
            f"elsewhere: a search lowered the loss of coarse pictures from {now:.3g} to {best.loss:.3g}"
        )

    def _tell(self, k: int) -> Callable[[float], None]:
        """Progress does not grow during the search, but its report may cancel the fit."""
        report, done = self._run.progress, float(self._run.done_before[k])
        return lambda _: None if report is None else report(done)

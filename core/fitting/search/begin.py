"""Where a fit begins: at its start, at a better one that a search finds, or at the end of the best of several fits."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...rendering.options import Progress
from ...scene import parameters
from ..driven import Looking
from ..run import Run
from ..schedule import Cycle, Schedule
from ..stages import Stages
from ..vertices.starts import choose_starts
from .coarse import Coarse, moves_of
from .find_start import BETTER, find_starts, gradient_speaks, pictures_for
from .second_look import SecondLook

F64 = NDArray[np.float64]

# Iterations of each of several fits, as a part of the whole fit's, and the least.
TRIAL, SHORTEST = 0.25, 10
# Part of a fit's progress that a search takes, and each further fit.
SEARCHED, TRIED = 0.08, 0.1

RunOf = Callable[[Schedule, Progress | None], Run]


def choose_symmetric_start(run: Run) -> None:
    """Begin with the symmetric shapes that fit best, where symmetry leaves a choice."""
    values = {one.path: one.value for one in run.variables}

    def put(item: Any, value: F64) -> None:
        if item.path in values:
            values[item.path] = value
            run.update(run.place(values))
        else:
            parameters.put(run.work, item.path, value)
            run.update([item.path])

    if choose_starts((*run.unknowns, *run.variables), put, lambda: run.loss_of(0, range(len(run.seen)))):
        run.start = run.history.best_values = run.values()


def begin(run: Run, run_of: RunOf, stages: Stages, *, search: int | None, restarts: int,
          per_iteration: int) -> tuple[Run, list[str]]:  # fmt: skip
    """Look for a better start, if it is due.

    Parameters
    ----------
    run
        The fit at its own start, before its first iteration.
    run_of
        Makes a run that begins with the present values of the scene.
    search
        Number of coarse pictures of the search; None: enough of them if no gradient leads away from the start, else
        none before a second look (`second_look`).
    restarts
        Number of other starts that are fitted for a while.
    per_iteration
        Pictures of each iteration of these fits.

    Returns
    -------
    The run to go on with, and sentences on what was found.
    """
    moves = moves_of(run)
    can = moves.count > 0 and (run.driven is None or isinstance(run.driven, Looking))
    if not can or (search == 0 and not restarts):
        if search or restarts:
            raise ValueError("fit: search and restarts need a pose, a position, a direction or a driven number among "
                             "the parameters; leave them out")  # fmt: skip
        run.progress = stages.rest()
        return run, []
    tell = stages.part(SEARCHED) or (lambda fraction: None)
    coarse = Coarse(run, moves)
    start = np.zeros(moves.count)
    states = [item.state() for item in run.variables]
    at_start = coarse.loss(start)
    silent = search is None and not gradient_speaks(coarse.loss, moves.count, at_start)
    starts = []
    if silent or search or restarts:
        pictures = search or pictures_for(moves.count)
        generator = np.random.default_rng([run.seed, 1])
        cameras = [replace(view.camera) for view in run.seen]
        starts = find_starts(coarse.loss, moves, cameras, at_start, pictures, generator, tell)
    tell(1.0)
    others = [one for one in starts if one.vector.any()]
    if restarts and others:
        return _best_of(run, run_of, stages, coarse, [start, *(one.vector for one in others[:restarts])], states,
                        per_iteration)  # fmt: skip
    if others and others[0].loss < BETTER * at_start:
        coarse.take(others[0].vector)
        better = _continued(run, run_of(run.schedule, stages.rest()))
        return better, [f"the fit began elsewhere than the scene: a search lowered the loss of coarse pictures from "
                        f"{at_start:.3g} to {others[0].loss:.3g}"]
    coarse.take(start)
    run.progress = stages.rest()
    if search is None and not silent:
        run.before = SecondLook(run, lambda: run_of(run.schedule, None).unknowns)
    return run, (["at the start, no small move brings the pictures closer to their targets, and a search over coarse "
                  "pictures found no better start"] if silent else [])


def _best_of(run: Run, run_of: RunOf, stages: Stages, coarse: Coarse, starts: Sequence[F64], states: Sequence[Any],
             per_iteration: int) -> tuple[Run, list[str]]:  # fmt: skip
    """Fit from several starts for a while, and return a run that begins where the best one has ended."""
    steps = max(SHORTEST, round(TRIAL * run.iterations))
    ends: list[tuple[float, dict[str, Any]]] = []
    before = {item.path: run.start[item.path] for item in run.unknowns}
    for vector in starts:
        for item, state in zip(run.variables, states, strict=True):
            item.restore(state)
        coarse.take(vector, before)
        schedule = Cycle(len(run.seen), per_iteration, steps, run.seed)
        trial = _continued(run, run_of(schedule, stages.part(TRIED)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # the fit itself repeats those that matter
            trial.iterate(None)
            trial.measure_end()
        ends.append((trial.history.least, trial.history.best_values))
    best = int(np.argmin([loss for loss, _ in ends]))
    for item, state in zip(run.variables, states, strict=True):
        item.restore(state)
    run.bring_to(ends[best][1])
    listed = ", ".join(f"{loss:.3g}" for loss, _ in ends)
    which = "the scene's own start" if best == 0 else f"start {best + 1}"
    return _continued(run, run_of(run.schedule, stages.rest())), [
        f"{len(starts)} starts were fitted for {steps} iterations each, to the losses {listed}; the fit went on from "
        f"{which}"]  # fmt: skip


def _continued(before: Run, now: Run) -> Run:
    """The run from another start, which goes back to the scene's own values if it is cancelled."""
    now.start, now.placement, now.asked = before.start, before.placement, before.asked
    return now

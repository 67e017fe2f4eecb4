"""Newton steps at the end of a fit that has not arrived.

The optimisers of a fit follow noisy gradients. Where some numbers hardly change the pictures beside others, or only
together with them, these arrive first, and the short last steps leave the rest on its way. At the end, the curvature of
the loss is measured for the standard errors anyway (`normal_equations`), and with it what is ahead of each number. A
step goes there, if pictures of other random numbers than those of the measurement agree that it is better.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...rendering.options import Progress
from ..driven import Numbers, Variable
from ..stages import Stages
from ..variables import Unknown
from .coordinates import moved
from .measurement import FIRST_LOOK, Measurement, last_loss, measure, part_of_fit, picture, times

if TYPE_CHECKING:
    from ..run import Run

# Most steps of a fit, their most work relative to that of the iterations, and lengths that are tried of each.
MOST_STEPS, MOST_WORK, LENGTHS = 6, 2.0, (1.0, 0.5, 0.2)
# A step is made if the loss falls along it by this many times what noise lets it fall at the end of a fit. A first look
# has more noise: it is repeated with all samples from fewer times on.
WORTH, DOUBT = 3.0, 2.0
# A first look needs this many times the samples of an iteration. With fewer it would tell too little.
FEWEST = 4


def arrived(run: Run, progress: Progress | None) -> Measurement:
    """Make Newton steps from the best values of a run while they are worth it, and return the last measurement.

    A first look with fewer samples finds most long fits arrived, and their standard errors.
    """
    run.progress = None  # that of the iterations, which are done
    stages, share = Stages(progress), 0.25  # of the progress: each further step has half of what is left
    if times(run, FIRST_LOOK) >= FEWEST:
        found = measure(run, run.history.best_values, 0, stages.part(0.5), FIRST_LOOK)
        if found.solution is None or not (found.solution.lost.any() or _is_due(found, DOUBT)):
            return found
    else:
        share = 0.5
    found = measure(run, run.history.best_values, 0, stages.part(share))
    for step in range(1, min(MOST_STEPS, int(MOST_WORK / part_of_fit(run, len(found.places)))) + 1):
        share *= 0.5
        if not _is_due(found) or not _step(run, found, step, stages.part(0.5 * share)):
            break
        found = measure(run, run.history.best_values, step, stages.part(0.5 * share))
    return found


def _is_due(found: Measurement, worth: float = WORTH) -> bool:
    if found.solution is None:
        return False
    late = found.late(found.errors)[: len(found.places)]
    return bool(late.any()) or found.solution.gain > worth * found.solution.chance


def _step(run: Run, found: Measurement, step: int, progress: Progress | None) -> bool:
    """Make one step, unless it raises the loss; return whether it was made."""
    assert found.solution is not None
    variables: list[Unknown | Variable | Numbers] = [*run.unknowns, *run.variables]
    ahead = found.solution.ahead[: len(found.places)]
    stages = Stages(progress)
    part = 1.0 / (1 + len(LENGTHS))
    before = _loss(run, step, stages.part(part))[0]
    for length in LENGTHS:
        run.bring_to(moved(variables, found.values, found.places, length * ahead))
        after, gains = _loss(run, step, stages.part(part))
        if after < before:
            run.record_newton_step(step, gains)
            return True
    run.bring_to(found.values)
    return False


def _loss(run: Run, step: int, progress: Progress | None) -> tuple[float, list[Any]]:
    """Return the loss of the scene as it is, and the gains."""
    pictures, stages = {}, Stages(progress)
    for j, view in enumerate(run.seen):
        run.see(j)
        halves = (picture(run, j, step, kind, stages.part(0.5 / len(run.seen))) for kind in (15, 16))
        pictures[j] = tuple(halves) if isinstance(view.gain, str) else (np.mean(list(halves), axis=0),)
    gains, compared = run.compare(run.iterations, last_loss(run), pictures)
    return sum(run.seen[j].weight * value for j, (value, _) in compared.items()), gains

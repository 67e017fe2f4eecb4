"""What the pictures say about the numbers of a fit at some values: renders, derivatives and what follows from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...rendering.options import Progress
from ..driven import Numbers, Variable
from ..gains import groups
from ..losses import Loss
from ..silhouettes import moves_silhouettes
from ..stages import Stages
from ..targets import EXPOSURE, View, camera_of_gradient
from ..variables import Unknown
from .coordinates import Coordinate, coordinates
from .normal_equations import Equations, Solution, solve

if TYPE_CHECKING:
    from ..run import Run

F64 = NDArray[np.float64]
Tell = Callable[[], Progress | None]  # returns the progress of the next render

# Renders over which the end of a fit averages: optimisers follow the mean of the last gradients.
AVERAGED = 9.0
# Samples of pictures and derivatives here, in those of an iteration: about a fifth of the fit's work, of a first look
# less, and the most.
WORK, FIRST_LOOK, MOST_SAMPLES = 0.2, 0.05, 16
# A fit has not arrived if what is ahead of a number is above these multiples of its standard error, and of that of the
# estimate of what is ahead.
AHEAD, CERTAIN = 2.0, 4.0
# What is ahead of a number does not count below this part of the first step of the fit.
LEAST = 0.01


@dataclass(frozen=True)
class Measurement:
    """What is known at some values.

    Attributes
    ----------
    values
        The values.
    places, factors
        The coordinates, and the unknown gains, which are coordinates as well.
    arrays
        Paths of what has too many numbers for coordinates.
    residuals
        For each target, the picture minus the target.
    solution
        What the pictures say about the coordinates; None: there are none.
    """

    values: Mapping[str, Any]
    places: Sequence[Coordinate]
    factors: Sequence[Factor]
    arrays: Sequence[str]
    residuals: Sequence[F64]
    solution: Solution | None

    @property
    def errors(self) -> F64:
        """Standard errors of the coordinates, if those of open directions are held."""
        assert self.solution is not None
        return np.asarray(np.sqrt(np.clip(np.diag(self.solution.covariance), 0.0, None)))

    def late(self, errors: F64) -> NDArray[np.bool_]:
        """Which coordinates have not arrived, by their standard errors."""
        found = self.solution
        assert found is not None
        ahead = np.abs(found.ahead)
        least = LEAST * np.array([*(place.step for place in self.places), *(0.0 for _ in self.factors)])
        return (ahead > AHEAD * errors) & (ahead > CERTAIN * found.ahead_error) & (ahead > least)


def measure(run: Run, values: Mapping[str, Any], turn: int, progress: Progress | None,
            work: float = WORK) -> Measurement:  # fmt: skip
    """Measure at some values, which the run's scene gets.

    For each target it renders two pictures, and two derivatives by each coordinate.

    Parameters
    ----------
    turn
        Number of Newton steps (`newton_steps`) before; each has its own random numbers.
    work
        The part of the fit's work that this may take.
    """
    run.bring_to(values)
    variables: list[Unknown | Variable | Numbers] = [*run.unknowns, *run.variables]
    places, arrays = coordinates(variables, values, run.placement)
    factors = _factors(run.seen)
    equations = Equations.empty(len(places) + len(factors))
    loss = last_loss(run)
    generator = np.random.default_rng([run.seed, turn])
    of_columns = _times_of_columns(run, len(places), work)
    # Each render reports its progress as one part; the reports raise `Cancelled` if the user stops.
    stages, residuals = Stages(progress), list[F64]()

    def tell() -> Progress | None:
        return stages.part(1.0 / (len(run.seen) * (2 + 2 * len(places))))

    for j, view in enumerate(run.seen):
        run.see(j)
        gain = run.history.best_gains[j] if isinstance(view.gain, str) else np.ones(3)
        first, second = (picture(run, j, turn, 7 + half, tell(), work).astype(np.float64) * gain for half in (0, 1))
        residuals.append(0.5 * (first + second) - view.image)
        if not places and not factors:
            continue
        columns = tuple(np.stack([*(_column(run, j, one, turn, half, of_columns * run.gradient_spp, tell) * gain
                                    for one in places),
                                  *(_of_factor(view, j, one, seen) for one in factors)])
                        for half, seen in ((0, first), (1, second)))  # fmt: skip
        equations.add(view, loss, (first, second), (columns[0], columns[1]), generator)
    solution = None
    if places:
        steps = [*(one.step for one in places), *(1.0 for _ in factors)]
        # Newton steps end with the noise of these renders, other steps with that of the last gradients.
        solution = solve(equations, steps, 1.0 if turn else 2.0 * times(run, work) / AVERAGED)
    return Measurement(values, places, factors, arrays, residuals, solution)


def last_loss(run: Run) -> Loss:
    """The loss whose adjoint the last iterations use."""
    return run.loss.at(1.0) if hasattr(run.loss, "at") else run.loss


def times(run: Run, work: float = WORK) -> int:
    """Samples of a picture here, in those of an iteration."""
    return int(np.clip(work * run.iterations, 1, MOST_SAMPLES))


def _times_of_columns(run: Run, places: int, work: float = WORK) -> int:
    """Samples of a derivative by a coordinate here, in those of an iteration."""
    return int(np.clip(work * run.iterations / max(places, 1), 1, MOST_SAMPLES))


def part_of_fit(run: Run, places: int) -> float:
    """Samples of a measurement and of the loss beside it, relative to those of all iterations."""
    each = 2 * (2 * times(run) * run.spp + places * _times_of_columns(run, places) * run.gradient_spp)
    whole = run.iterations * len(run.schedule.turn(0).views) * (run.spp + run.gradient_spp)
    return len(run.seen) * each / whole


def picture(run: Run, j: int, turn: int, kind: int, tell: Progress | None, work: float = WORK) -> NDArray[np.float32]:
    """Render picture j with many samples; `kind` is that of `Run.seed_of`."""
    return run.renderer_of(j).render(spp=times(run, work) * run.spp, **run.limits_of(j), camera=run.seen[j].camera,
                                     seed=run.seed_of(run.iterations + turn, j, kind), progress=tell)


@dataclass(frozen=True)
class Factor:
    """An unknown exposure, or one channel of an unknown white balance, as a nuisance: its logarithm."""

    views: tuple[int, ...]
    channels: tuple[float, ...]
    label: str


def _factors(seen: Sequence[View]) -> list[Factor]:
    out = []
    for kind, views in groups(seen):
        of = f"the {kind} of target {views[0] + 1}"
        channels = [(1.0, 1.0, 1.0)] if kind == EXPOSURE else [tuple(row) for row in np.eye(3).tolist()]
        out += [Factor(tuple(views), one, of) for one in channels]
    return out


def _of_factor(view: View, j: int, factor: Factor, picture: F64) -> F64:
    return picture * np.array(factor.channels) if j in factor.views else np.zeros(view.image.shape)


def _column(run: Run, j: int, place: Coordinate, turn: int, half: int, samples: int, tell: Tell) -> F64:
    """Derivative of picture j by a coordinate."""
    view = run.seen[j]
    tangent = {path: value for path, value in place.tangent(j).items()
               if view.objects is None or moves_silhouettes(path)}  # fmt: skip
    if not tangent:
        return np.zeros(view.image.shape)
    renderer = run.renderer_of(j)
    image = renderer.render_forward(tangent, spp=samples, **run.limits_of(j),
                                    seed=run.seed_of(run.iterations + turn, j, 9 + half), progress=tell(),
                                    camera=camera_of_gradient(renderer, view.camera, list(tangent)))  # fmt: skip
    return image.astype(np.float64)

"""How well the pictures determine what a fit has found: standard errors, and what can be exchanged for one another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...rendering.options import Progress
from ..driven import Numbers, Variable
from ..silhouettes import moves_silhouettes
from ..stages import Stages
from ..targets import View, camera_of_gradient
from ..variables import Unknown
from .coordinates import Coordinate, coordinates
from .normal_equations import Equations, Solution, solve

if TYPE_CHECKING:
    from ..run import Run

F64 = NDArray[np.float64]
Tell = Callable[[], Progress | None]  # returns the progress of the next render

# Renders over which the end of a fit averages: optimisers follow the mean of the last gradients.
AVERAGED = 9.0
# Coordinates whose errors are correlated more closely can be exchanged for one another.
EXCHANGED = 0.98
# Parts of an open direction, relative to its largest, that are named.
TAKES_PART = 0.3
# A standard error above this part of a number's range leaves it open.
LARGE = 0.25
# A fit has not arrived if what is ahead of a number is above these multiples of its standard error, and of that of the
# estimate of what is ahead.
AHEAD, CERTAIN = 2.0, 4.0
# Samples of pictures and derivatives here, in those of an iteration: about a fifth of the fit's work, and the most.
WORK, MOST_SAMPLES = 0.2, 16
# Part of a fit's progress that this takes.
MEASURED = 0.15
# Directions in which the dependence on an array is measured: over all pictures together, and at most of each picture.
DIRECTIONS, MOST_OF_PICTURE = 16, 4


@dataclass(frozen=True)
class Uncertainty:
    """How well the pictures determine a parameter.

    Attributes
    ----------
    path
        Path of the parameter.
    names, units, values
        Of its numbers: which one it is, its unit, and its value; None for coordinates of poses. Empty for arrays.
    errors
        Standard errors: of the numbers, or an array like the parameter, whose entries are each as if all else was
        known. Infinite where the pictures do not tell; not a number where the noise of the derivatives hides it.
    open
        For each number whether the pictures leave it open: alone, or together with others (`Exchange`).
    ahead
        For each number what is about to change yet, if the fit has not arrived; else 0. The error is that of a fit that
        has.
    """

    path: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: tuple[float | None, ...]
    errors: F64
    open: tuple[bool, ...] = ()
    ahead: tuple[float, ...] = ()

    def __str__(self) -> str:
        if not self.names:
            told = self.errors[np.isfinite(self.errors)]
            if not told.size:
                return f"'{self.path}': the pictures do not determine its entries"
            part = "" if told.size == self.errors.size else f" of {told.size / self.errors.size:.0%} of its entries"
            return f"'{self.path}': standard error {np.median(told):.2g} in the median{part}, each by itself"
        numbers = []
        ahead = self.ahead or (0.0,) * len(self.names)
        for name, unit, value, error, open_, rest in zip(self.names, self.units, self.values, self.errors, self.open,
                                                         ahead, strict=True):  # fmt: skip
            amount = ("error lost in noise" if np.isnan(error) else "open" if np.isinf(error)
                      else f"± {error:.2g} {unit}".strip())  # fmt: skip
            if value is not None:
                amount = f"{value:.{_digits(value, float(error))}g} {amount}"
            weak = " (hardly determined)" if open_ and np.isfinite(error) else ""
            late = f" (not arrived: about {rest:+.2g} ahead, more iterations are needed)" if rest else ""
            numbers.append(f"{name} {amount}{weak}{late}".strip())
        return f"'{self.path}': {', '.join(numbers)}"


@dataclass(frozen=True)
class Exchange:
    """Numbers of parameters that can be exchanged for one another: together they change the pictures hardly or not.

    Attributes
    ----------
    labels
        The numbers in words.
    correlation
        Of the errors of two numbers; 1: the pictures do not change measurably at all.
    lost
        Whether this may be due to the noise of the derivatives, which more samples would reduce.
    """

    labels: tuple[str, ...]
    correlation: float = 1.0
    lost: bool = False

    def __str__(self) -> str:
        listed = f"{', '.join(self.labels[:-1])} and {self.labels[-1]}"
        if self.lost:
            return f"how well the pictures tell {listed} apart is lost in noise; a fit with more samples can tell"
        return f"{listed} can be exchanged for one another: changed together, they hardly change the pictures"


def uncertainty(run: Run, values: dict[str, Any], progress: Progress | None = None
                ) -> tuple[tuple[Uncertainty, ...], tuple[Exchange, ...]]:  # fmt: skip
    """Measure what is known at some values, which the run's scene gets.

    For each target it renders two pictures, two derivatives by each number, and four gradients of arrays for each of
    up to `MOST_OF_PICTURE` random directions.
    """
    run.bring_to(values)
    variables: list[Unknown | Variable | Numbers] = [*run.unknowns, *run.variables]
    places, arrays = coordinates(variables, values, run.placement)
    arrays = [path for path in arrays if any(path == item.path for item in run.unknowns)]  # others are not the scene's
    factors = _factors(run.seen)
    equations = Equations.empty(len(places) + len(factors))
    loss = run.loss.at(1.0) if hasattr(run.loss, "at") else run.loss
    generator = np.random.default_rng(run.seed)
    of_pictures = int(np.clip(WORK * run.iterations, 1, MOST_SAMPLES))
    of_columns = int(np.clip(WORK * run.iterations / max(len(places), 1), 1, MOST_SAMPLES))
    entries = {path: np.zeros((2, *np.shape(values[path]))) for path in arrays}
    directions = int(np.clip(DIRECTIONS // len(run.seen), 1, MOST_OF_PICTURE))
    # Each render reports its progress as one part; the reports raise `Cancelled` if the user stops.
    part = 1.0 / (len(run.seen) * (2 + 2 * len(places) + (4 * directions if entries else 0)))
    stages = Stages(progress)

    def tell() -> Progress | None:
        return stages.part(part)

    for j, view in enumerate(run.seen):
        run.see(j)
        gain = np.asarray(run.gains.values[j])
        first, second = (_picture(run, j, half, of_pictures * run.spp, tell) * gain for half in (0, 1))
        _probe(run, j, 0.5 * (first + second) - view.image, entries, directions, generator, tell)
        if not places and not factors:
            continue
        columns = tuple(np.stack([*(_column(run, j, one, half, of_columns * run.gradient_spp, tell) * gain
                                    for one in places),
                                  *(_of_factor(view, j, one, picture) for one in factors)])
                        for half, picture in ((0, first), (1, second)))  # fmt: skip
        equations.add(view, loss, (first, second), (columns[0], columns[1]), generator)
    out = [_array(path, squares, tilted, directions) for path, (squares, tilted) in entries.items()]
    if not places:
        return tuple(out), ()
    steps = [*(one.step for one in places), *(1.0 for _ in factors)]
    solution = solve(equations, steps, 2.0 * of_pictures / AVERAGED)
    errors = np.sqrt(np.clip(np.diag(solution.covariance), 0.0, None))
    labels = [*(one.label for one in places), *(factor.label for factor in factors)]
    exchanges = _exchanges(labels, solution, errors)
    # A number that an open direction moves is known only together with the others of this direction.
    taking = _taking_part(solution.open)
    errors = np.where(taking.any(axis=1), np.inf, errors)
    errors = np.where(taking[:, solution.lost].any(axis=1), np.nan, errors)
    late = (np.abs(solution.ahead) > AHEAD * errors) & (np.abs(solution.ahead) > CERTAIN * solution.ahead_error)
    found: dict[str, list[tuple[Coordinate, float, float]]] = {}
    for place, error, ahead in zip(places, errors, np.where(late, solution.ahead, 0.0), strict=False):
        found.setdefault(place.path, []).append((place, float(error), float(ahead)))
    numbers = [
        Uncertainty(path, tuple(one.name for one, *_ in of), tuple(one.unit for one, *_ in of),
                    tuple(one.value for one, *_ in of), np.array([error for _, error, _ in of]),
                    tuple(not error <= LARGE * one.way for one, error, _ in of), tuple(ahead for *_, ahead in of))
        for path, of in found.items()
    ]  # fmt: skip
    return (*numbers, *out), exchanges


@dataclass(frozen=True)
class Factor:
    """An unknown exposure, or one channel of an unknown white balance, as a nuisance: its logarithm."""

    views: tuple[int, ...]
    channels: tuple[float, ...]
    label: str


def _factors(seen: Sequence[View]) -> list[Factor]:
    groups: dict[tuple[str, str | int], list[int]] = {}
    for j, view in enumerate(seen):
        if isinstance(view.gain, str):
            groups.setdefault((view.gain, view.shared or j), []).append(j)
    out = []
    for (kind, _), views in groups.items():
        of = f"the {kind} of target {views[0] + 1}"
        channels = [(1.0, 1.0, 1.0)] if kind == "exposure" else [tuple(row) for row in np.eye(3).tolist()]
        out += [Factor(tuple(views), one, of) for one in channels]
    return out


def _of_factor(view: View, j: int, factor: Factor, picture: F64) -> F64:
    return picture * np.array(factor.channels) if j in factor.views else np.zeros(view.image.shape)


def _picture(run: Run, j: int, half: int, samples: int, tell: Tell) -> F64:
    picture = run.renderer_of(j).render(spp=samples, **run.limits_of(j), seed=run.seed_of(run.iterations, j, 7 + half),
                                        camera=run.seen[j].camera, progress=tell())  # fmt: skip
    return picture.astype(np.float64)


def _column(run: Run, j: int, place: Coordinate, half: int, samples: int, tell: Tell) -> F64:
    """Derivative of picture j by a coordinate."""
    view = run.seen[j]
    tangent = {path: value for path, value in place.tangent(j).items()
               if view.objects is None or moves_silhouettes(path)}  # fmt: skip
    if not tangent:
        return np.zeros(view.image.shape)
    renderer = run.renderer_of(j)
    image = renderer.render_forward(tangent, spp=samples, **run.limits_of(j),
                                    seed=run.seed_of(run.iterations, j, 9 + half), progress=tell(),
                                    camera=camera_of_gradient(renderer, view.camera, list(tangent)))  # fmt: skip
    return image.astype(np.float64)


def _probe(run: Run, j: int, residual: F64, entries: dict[str, F64], directions: int, generator: np.random.Generator,
           tell: Tell) -> None:  # fmt: skip
    """Add to each entry of arrays the squares of its derivatives over picture j, alone and times the residual.

    For random signs s of the pixels, the mean of (J^T s)^2 is the diagonal of J^T J.
    """
    view = run.seen[j]
    wrt = [path for path in entries if view.objects is None or moves_silhouettes(path)]
    if not wrt:
        return
    weight = np.ones(view.image.shape) if view.mask is None else np.repeat(view.mask[..., None], 3, axis=2)
    renderer = run.renderer_of(j)
    camera = camera_of_gradient(renderer, view.camera, wrt)
    for probe in range(directions):
        signs = generator.choice((-1.0, 1.0), view.image.shape)
        for kind, adjoint in enumerate((signs * weight, signs * weight * residual)):
            # Two seeds: the square of one noisy derivative would contain its variance.
            halves = [renderer.render_backward(adjoint.astype(np.float32), wrt, spp=run.gradient_spp,
                                               **run.limits_of(j), camera=camera, progress=tell(),
                                               seed=run.seed_of(run.iterations + 1 + probe, j, 9 + half))
                      for half in (0, 1)]  # fmt: skip
            for path in wrt:
                entries[path][kind] += np.where(np.isfinite(halves[0][path]), halves[0][path], 0.0) * halves[1][path]


def _array(path: str, squares: F64, tilted: F64, directions: int) -> Uncertainty:
    """Standard errors of an array's entries: the residual's mean variance where the array is seen over its squares."""
    seen = squares > 0.0
    variance = max(float(tilted.sum()), 0.0) / float(squares.sum()) if squares.sum() > 0.0 else np.inf
    errors = np.sqrt(variance * directions / np.where(seen, squares, 1.0))
    return Uncertainty(path, (), (), (), np.where(seen, errors, np.inf))


def _taking_part(directions: F64) -> NDArray[np.bool_]:
    """(n, k) which coordinates are a part of each direction that matters."""
    size = np.abs(directions)
    return np.asarray(size > TAKES_PART * size.max(axis=0, initial=0.0))


def _exchanges(labels: Sequence[str], solution: Solution, errors: F64) -> tuple[Exchange, ...]:
    out = []
    for taking, lost in zip(_taking_part(solution.open).T, solution.lost, strict=True):
        if taking.sum() > 1:
            of = [label for label, part in zip(labels, taking, strict=True) if part]
            out.append(Exchange(tuple(dict.fromkeys(of)), lost=bool(lost)))
    by = np.where(errors > 0.0, errors, 1.0)
    correlation = np.abs(solution.covariance / np.outer(by, by))
    free = ~_taking_part(solution.open).any(axis=1)
    close = np.triu(correlation, 1) > EXCHANGED
    for k, n in np.argwhere(close & np.outer(free, free)):
        out.append(Exchange((labels[k], labels[n]), float(correlation[k, n])))
    return tuple(out)


def _digits(value: float, error: float) -> int:
    """Significant digits of a value that its error leaves, and two of the error."""
    if not (np.isfinite(error) and error > 0.0 and value):
        return 4
    return int(np.clip(np.ceil(np.log10(abs(value) / error)) + 2, 2, 8))

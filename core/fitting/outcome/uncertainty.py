"""How well the pictures determine what a fit has found: standard errors, and what can be exchanged for one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...rendering.options import Progress
from ..silhouettes import moves_silhouettes
from ..stages import Stages
from ..targets import camera_of_gradient
from .coordinates import Coordinate
from .measurement import Measurement, Tell
from .normal_equations import Solution

if TYPE_CHECKING:
    from ..run import Run

F64 = NDArray[np.float64]

# Coordinates whose errors are correlated more closely can be exchanged for one another.
EXCHANGED = 0.98
# Most numbers of a parameter, and most numbers that can be exchanged, that are told one by one.
MOST_TOLD, MOST_EXCHANGED = 12, 6
# Parts of an open direction, relative to its largest, that are named.
TAKES_PART = 0.3
# A standard error above this part of a number's range leaves it open.
LARGE = 0.25
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
            return (f"'{self.path}': standard error of at least {np.median(told):.2g} in the median{part}, as if all "
                    "others were known")  # fmt: skip
        ahead = self.ahead or (0.0,) * len(self.names)
        if len(self.names) > MOST_TOLD:
            return f"'{self.path}': {self._summary(np.asarray(ahead))}"
        numbers = []
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

    def _summary(self, ahead: F64) -> str:
        """Many numbers in words, with the largest error and one example of each kind."""
        told, count, parts = np.isfinite(self.errors), len(self.names), []
        if told.any():
            worst, unit = int(np.argmax(np.where(told, self.errors, -1.0))), f" {self.units[0]}".rstrip()
            parts.append(f"standard error {np.median(self.errors[told]):.2g}{unit} in the median of {told.sum()} "
                         f"numbers, {self.errors[worst]:.2g}{unit} at most ({self.names[worst]})")  # fmt: skip
        for kind, which in (("open, alone or together with others", np.isinf(self.errors)),
                            ("lost in noise", np.isnan(self.errors)),
                            ("not there yet; more iterations are needed", ahead != 0.0)):
            if which.any():
                parts.append(f"{which.sum()} of {count} ({self.names[int(np.argmax(which))]} …) are {kind}")
        return "; ".join(parts)


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
        told, more = self.labels, len(self.labels) - MOST_EXCHANGED + 1
        if more > 1:
            told = (*told[: MOST_EXCHANGED - 1], f"{more} other numbers")
        listed = f"{', '.join(told[:-1])} and {told[-1]}"
        if self.lost:
            return f"how well the pictures tell {listed} apart is lost in noise; a fit with more samples can tell"
        return f"{listed} can be exchanged for one another: changed together, they hardly change the pictures"


def uncertainty(run: Run, measured: Measurement, progress: Progress | None = None
                ) -> tuple[tuple[Uncertainty, ...], tuple[Exchange, ...]]:  # fmt: skip
    """Say what is known at the values that were measured last.

    For each target it renders four gradients of arrays for each of up to `MOST_OF_PICTURE` random directions.
    """
    out = _arrays(run, measured, progress) if measured.arrays else []
    solution, places = measured.solution, measured.places
    if solution is None:
        return tuple(out), ()
    errors = measured.errors
    labels = [*(one.label for one in places), *(factor.label for factor in measured.factors)]
    exchanges = _exchanges(labels, solution, errors)
    # A number that an open direction moves is known only together with the others of this direction.
    taking = _taking_part(solution.open)
    errors = np.where(taking.any(axis=1), np.inf, errors)
    errors = np.where(taking[:, solution.lost].any(axis=1), np.nan, errors)
    late = measured.late(errors)
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


def _arrays(run: Run, measured: Measurement, progress: Progress | None) -> list[Uncertainty]:
    """Standard errors of arrays."""
    entries = {path: np.zeros((2, *np.shape(measured.values[path]))) for path in measured.arrays}
    directions = int(np.clip(DIRECTIONS // len(run.seen), 1, MOST_OF_PICTURE))
    generator, stages = np.random.default_rng(run.seed), Stages(progress)

    def tell() -> Progress | None:
        return stages.part(0.25 / (len(run.seen) * directions))

    for j, residual in enumerate(measured.residuals):
        run.see(j)
        _probe(run, j, residual, entries, directions, generator, tell)
    return [_array(path, squares, tilted, directions) for path, (squares, tilted) in entries.items()]


def _probe(run: Run, j: int, residual: F64, entries: dict[str, F64], directions: int, generator: np.random.Generator,
           tell: Tell) -> None:  # fmt: skip
    """Add to each entry of arrays the squares of its derivatives over picture j, alone and times the residual.

    For random signs s of the pixels, the mean of (J^T s)^2 is the diagonal of J^T J.
    """
    view = run.seen[j]
    driven = [item.path for item in run.variables if item.path in entries]
    moving = run.placement.paths[j] if driven and run.placement is not None else ()
    own = [path for path in entries if path not in driven]
    wrt = [path for path in dict.fromkeys((*own, *moving)) if view.objects is None or moves_silhouettes(path)]
    if not wrt:
        return
    weight = np.ones(view.image.shape) if view.mask is None else np.repeat(view.mask[..., None], 3, axis=2)
    renderer = run.renderer_of(j)
    camera = camera_of_gradient(renderer, view.camera, wrt)
    for probe in range(directions):
        signs = generator.choice((-1.0, 1.0), view.image.shape)
        for kind, adjoint in enumerate((signs * weight, signs * weight * residual)):
            # Two seeds: the square of one noisy derivative would contain its variance.
            halves = []
            for half in (0, 1):
                found = renderer.render_backward(adjoint.astype(np.float32), wrt, spp=run.gradient_spp,
                                                 **run.limits_of(j), camera=camera, progress=tell(),
                                                 seed=run.seed_of(run.iterations + probe, j, 13 + half))  # fmt: skip
                if driven and run.placement is not None:
                    found = found | run.placement.pull(found, j)
                halves.append(found)
            for path in entries:
                if path in halves[0]:
                    product = np.asarray(halves[0][path]) * np.asarray(halves[1][path])
                    entries[path][kind] += np.where(np.isfinite(product), product, 0.0)


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

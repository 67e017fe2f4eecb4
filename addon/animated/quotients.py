"""Difference quotients of the exported arrays by one property, with steps that are found and checked automatically."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from edgegrad.scene.changes import StructureChange

from ..export import Export
from ..problem import Problem
from .arrays import F64, Arrays, Key, Sizes, moved, value_of
from .data_path import Place

# Relative change of the arrays by a step that balances the rounding of float32, which falls with the step, against
# the curvature, which grows with its square; changes between the two others are accepted.
GOOD_CHANGE, LEAST_CHANGE, MOST_CHANGE = 4e-3, 5e-4, 3e-2
MOST_TRIES = 8
# Largest difference, relative to the quotient, of the quotients with a step and with half of it.
TOLERANCE = 2e-3
# First steps: of angles (radians), relative to the range of bounded values, and relative to the value of others.
FIRST_ANGLE, FIRST_OF_RANGE, FIRST_RELATIVE = 0.05, 0.01, 0.02
NARROW_RANGE = 20.0
# A property whose largest step changes all arrays by less changes nothing.
NOTHING = 1e-9

Quotient = dict[Key, F64]


@dataclass(frozen=True)
class Step:
    """A checked step of a property.

    Attributes
    ----------
    size
        Step of the difference quotients.
    change
        Relative change of the arrays by that step.
    error
        Relative difference of the quotients with this step and with half of it.
    """

    size: float
    change: float
    error: float


class NoEffect(Problem):
    """Raised for a property that changes nothing that is exported."""


@dataclass
class Prober:
    """Exports the scene at values of its properties.

    Attributes
    ----------
    export
        Exports the scene as it is now.
    base
        The export at the present values.
    """

    export: Callable[[], Export]
    base: Export

    def __post_init__(self) -> None:
        self.sizes = Sizes(self.base)

    def quotient(self, place: Place, h: float) -> Quotient:
        """Return the difference quotients of all arrays that a step of `h` to both sides moves.

        At a limit of the property, the step to that side is shorter or has no length; then the quotients are those of
        the parabola through three values.

        Raises
        ------
        StructureChange
            If more than float arrays change.
        """
        middle = place.read()
        try:
            above, above_arrays = self._at(place, middle + h, middle)
            below, below_arrays = self._at(place, middle - h, middle)
            a, b = above - middle, middle - below
            if min(a, b) < 0.25 * h:  # at a limit: both points on the other side
                side = 2.0 if a > b else -2.0
                far, far_arrays = self._at(place, middle + side * h, middle)
                near, near_arrays = (above, above_arrays) if a > b else (below, below_arrays)
                points = [(near - middle, near_arrays), (far - middle, far_arrays)]
            else:
                points = [(a, above_arrays), (-b, below_arrays)]
        finally:
            place.write(middle)
        (p, p_arrays), (q, q_arrays) = points
        if p == 0.0 or q == 0.0 or p == q:
            raise NoEffect(f"property '{place.name}': can't be changed from {middle:.6g}")
        # Derivative at 0 of the parabola through (0, f0), (p, fp) and (q, fq).
        wp, wq = -q / (p * (p - q)), p / (q * (p - q))
        out: Quotient = {}
        for key in dict.fromkeys((*p_arrays, *q_arrays)):
            value = value_of(self.base, key)
            dp = p_arrays[key] - value if key in p_arrays else 0.0
            dq = q_arrays[key] - value if key in q_arrays else 0.0
            out[key] = np.asarray(wp * dp + wq * dq, np.float64)
        return out

    def step(self, place: Place, first: float | None = None) -> tuple[Step, Quotient]:
        """Find a step of the property, from `first` on; return it, and the quotients.

        Raises
        ------
        Problem
            If the property changes nothing (`NoEffect`), if it changes the topology at any step, or if no step has
            a small error; names the property.
        """
        h, large = self._first(place) if first is None else first, False
        structure: StructureChange | None = None
        best: tuple[Step, Quotient] | None = None
        quotient: Quotient = {}
        for tried in range(MOST_TRIES):
            try:
                quotient = self.quotient(place, h)
            except NoEffect:
                if not tried:
                    raise
                break  # larger steps are cut by the property's limits
            except StructureChange as found_change:
                structure, h, large = found_change, h / 8.0, True
                continue
            change = self._change(quotient, h)
            if structure is not None and change < LEAST_CHANGE:
                break  # a fit's steps are larger, and would change the structure
            if change <= NOTHING:
                if large:
                    break
                h *= 16.0
                continue
            if not LEAST_CHANGE <= change <= MOST_CHANGE and not (large and change < LEAST_CHANGE):
                h *= float(np.clip(GOOD_CHANGE / change, 1e-3, 1e3))
                continue
            found = self._checked(place, h, change, quotient)
            if best is None or found[0].error < best[0].error:
                best = found
            if found[0].error < TOLERANCE:
                return best
            h, large = h / 4.0, True
        where = f"property '{place.name}'"
        if best is not None and best[0].error < 10.0 * TOLERANCE:
            return best
        if structure is not None and best is None:
            raise Problem(f"{where}: can't be fitted, since with any step {structure}; apply what makes the topology "
                          "depend on it, or choose another property") from None  # fmt: skip
        if best is not None:
            raise Problem(f"{where}: can't be fitted, since what it moves jumps: two steps give derivatives that "
                          f"differ by {best[0].error:.0%}; start from another value")  # fmt: skip
        raise NoEffect(f"{where}: changes nothing that is rendered")

    def _checked(self, place: Place, h: float, change: float, quotient: Quotient) -> tuple[Step, Quotient]:
        half = self.quotient(place, 0.5 * h)
        error = scale = 0.0
        for key in dict.fromkeys((*quotient, *half)):
            known = quotient[key] if key in quotient else half[key]
            a, b = quotient.get(key, np.zeros_like(known)), half.get(key, np.zeros_like(known))
            error += self.sizes.squares(key, a - b)
            scale += self.sizes.squares(key, a)
        return Step(h, change, float(np.sqrt(error / scale)) if scale > 0.0 else np.inf), quotient

    def _at(self, place: Place, value: float, middle: float) -> tuple[float, Arrays]:
        """Set the value; return what it has become, and the arrays that differ from the base."""
        now = place.write(value)
        if now == middle:
            return now, {}
        return now, moved(self.base, self.export())

    def _change(self, quotient: Quotient, h: float) -> float:
        return max((self.sizes.change(key, value * h) for key, value in quotient.items()), default=0.0)

    @staticmethod
    def _first(place: Place) -> float:
        value = place.read()
        _, _, soft_low, soft_high = place.limits()
        if place.is_angle():
            return FIRST_ANGLE
        if soft_high - soft_low <= NARROW_RANGE:
            return FIRST_OF_RANGE * (soft_high - soft_low)
        return max(FIRST_RELATIVE * abs(value), 5e-3)

"""Animatable properties as parameters of a fit: their numbers, limits and steps."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from edgegrad.fitting.driven import Numbers

from ..problem import Problem
from ..write_back.held import Held
from . import data_path, refusals
from .arrays import F64
from .data_path import Place
from .quotients import NoEffect, Prober, Quotient, Step

# First step of a fit: relative change of the arrays. No larger than this part of the range of a bounded property.
FIRST_CHANGE, MOST_OF_RANGE = 0.02, 0.1


@dataclass(frozen=True)
class Wanted:
    """A property that is to be fitted.

    Attributes
    ----------
    path
        Whole path, such as 'objects["Cube"].location'; all numbers of an array, or one with its index.
    low, high
        Limits besides Blender's own; None: none.
    step
        First step, in the unit of the property; None: from the effect on the exported arrays.
    keyed
        Whether each frame of a film has its own value, even if there is no keyframe yet.
    """

    path: str
    low: float | None = None
    high: float | None = None
    step: float | None = None
    keyed: bool = False

    @staticmethod
    def parse(text: str, keyed: bool = False) -> Wanted:
        """Read 'PATH' or 'PATH in LOW:HIGH'."""
        path, separator, limits = text.rpartition(" in ")
        if not separator or any(sign in limits for sign in "\"']"):  # a name may contain " in "
            return Wanted(text.strip(), keyed=keyed)
        low, colon, high = limits.partition(":")
        try:
            bounds = [float(one) if one.strip() else None for one in (low, high)]
        except ValueError:
            bounds = []
        if not colon or len(bounds) != 2 or any(one is not None and math.isnan(one) for one in bounds):
            raise Problem(f"parameter '{text}': its limits must have the form LOW:HIGH, such as -1:1")
        return Wanted(path.strip(), bounds[0], bounds[1], keyed=keyed)


@dataclass
class Parameter:
    """A property, or several numbers of one, with the checked step of each.

    Attributes
    ----------
    wanted
        What was asked for.
    places
        The numbers that have an effect.
    steps
        Of each place.
    start
        Values of the places at the beginning.
    keyed
        Whether each frame of a film has its own values.
    """

    wanted: Wanted
    places: list[Place]
    steps: list[Step] = field(default_factory=list)
    start: F64 = field(default_factory=lambda: np.zeros(0))
    keyed: bool = False
    _held: list[Held] = field(default_factory=list)
    _names: list[str] = field(default_factory=list)

    @property
    def path(self) -> str:
        """Its name in a fit."""
        return self.wanted.path

    @property
    def names(self) -> list[str]:
        """Whole paths of the places, by the names that datablocks had when the fit began or have now."""
        return self._names

    def hold(self) -> None:
        """Remember the datablocks of the places, so that `renew` finds them again."""
        self._held = [Held.of(data_path.collection_of(place.owner), place.owner) for place in self.places]
        self._names = [place.name for place in self.places]

    def renew(self) -> None:
        """Find the datablocks of the places again, after a change of their names or an undo.

        Raises
        ------
        Problem
            If one was removed; names it.
        """
        self.places = [replace(place, owner=held.get()) for place, held in zip(self.places, self._held, strict=True)]
        self._names = [place.name for place in self.places]

    def read(self) -> F64:
        """Return the present values."""
        return np.array([place.read() for place in self.places])

    def write(self, values: F64) -> None:
        """Set the values, where they differ."""
        data_path.restored(self.places, values)

    def variable(self) -> Numbers:
        """Make the variable of a fit."""
        low, high = np.array([self._limits(place) for place in self.places]).T
        steps = [self._first_step(place, step) for place, step in zip(self.places, self.steps, strict=True)]
        return Numbers(self.path, self.start.copy(), np.array(steps), low, high)

    def _limits(self, place: Place) -> tuple[float, float]:
        low, high, _, _ = place.limits()
        low = max(low, -math.inf if self.wanted.low is None else self.wanted.low)
        high = min(high, math.inf if self.wanted.high is None else self.wanted.high)
        value = place.read()
        if not low <= value <= high:
            raise Problem(f"property '{place.name}': is {value:.6g}, outside of its limits {low:g} to {high:g}; move "
                          "it between them")  # fmt: skip
        return low, high

    def _first_step(self, place: Place, step: Step) -> float:
        if self.wanted.step is not None:
            return self.wanted.step
        low, high = self._limits(place)
        return min(FIRST_CHANGE / step.change * step.size, MOST_OF_RANGE * (high - low))


def found(wanted: Iterable[Wanted], film: bool = False) -> list[Parameter]:
    """Resolve and check properties; those of a film may be keyed.

    Raises
    ------
    Problem
        For one that does not exist, is given twice, or cannot be set.
    """
    out: list[Parameter] = []
    seen: set[str] = set()
    for one in wanted:
        places = data_path.find(one.path)
        for place in places:
            refusals.check(place, film)
            if place.name in seen:
                raise Problem(f"property '{place.name}': is given twice; leave out one of them")
            seen.add(place.name)
        if one.keyed and not film:
            raise Problem(f"property '{places[0].name}': is to be keyed, but the fit has no frames; give them "
                          "(--frames FIRST:LAST)")  # fmt: skip
        keyed = film and (one.keyed or any(refusals.is_keyed(place) for place in places))
        out.append(Parameter(one, places, keyed=keyed))
    return out


def analyse(parameter: Parameter, prober: Prober, notes: list[str]) -> list[Quotient]:
    """Find the steps of a property; drop its numbers without an effect, and name them in `notes`.

    Returns
    -------
    The quotients of the places that stay.
    """
    kept, steps, quotients = [], [], []
    for place in parameter.places:
        try:
            step, quotient = prober.step(place)
        except NoEffect as reason:
            notes.append(f"{reason}; it is left out")
            continue
        kept.append(place)
        steps.append(step)
        quotients.append(quotient)
    parameter.places, parameter.steps = kept, steps
    parameter.start = parameter.read()
    parameter.hold()
    return quotients

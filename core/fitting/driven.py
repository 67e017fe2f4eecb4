"""Variables outside of the scene that move its parameters: values of another program that makes the scene.

A fit sets them, asks for the parameters of the scene that follow, and pulls the gradient by these parameters back with
the derivative that belongs to them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .optimisers import Adam
from .rigid_variables import BETA2

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class Placement:
    """What follows from some values of driven variables.

    Attributes
    ----------
    values
        The variables, as they are now: another program may round or clip what it is given.
    parameters
        Maps parameter paths of the scene to their values, for all that some variable moves, except of the camera.
    cameras
        For each picture: fields of its camera, and their values.
    paths
        For each picture: paths of the parameters whose gradient `pull` needs.
    pull
        Maps a gradient of one picture by its `paths`, and the number of the picture, to that by the variables.
    """

    values: dict[str, F64]
    parameters: Mapping[str, Any]
    cameras: Sequence[Mapping[str, Any]]
    paths: Sequence[Sequence[str]]
    pull: Callable[[Mapping[str, F64], int], dict[str, F64]]


class Variable(Protocol):
    """One driven variable; `fitting.variables.Unknown` with a value."""

    path: str
    step: float
    value: F64

    def take_step(self, gradient: F64, factor: float) -> Any:
        """Make one step, of `factor` times the step length, and return the next value."""
        ...


class Driven(Protocol):
    """Driven variables, and what follows from them."""

    @property
    def variables(self) -> Sequence[Variable]:
        """The variables, the same objects at each call."""
        ...

    def place(self, values: Mapping[str, F64]) -> Placement:
        """Set the variables, and return what follows."""
        ...


@dataclass
class Numbers:
    """A driven variable of independent numbers within limits: Adam.

    Attributes
    ----------
    path
        Name of the variable.
    value
        Its value.
    steps
        First steps, of the shape of the value.
    low, high
        Limits, of the shape of the value.
    """

    path: str
    value: F64
    steps: F64
    low: F64
    high: F64
    step: float = field(init=False)

    def __post_init__(self) -> None:
        self.step = float(np.max(self.steps))
        self._optimiser = Adam(1.0, beta2=BETA2)

    def take_step(self, gradient: F64, factor: float) -> Any:
        # In units of their steps, all numbers are alike.
        change = self._optimiser.update(np.zeros_like(self.value), gradient * self.steps, factor)
        self.value = np.clip(self.value + self.steps * change, self.low, self.high)
        return self.value

"""Variables outside of the scene that move its parameters: values of another program that makes the scene.

A fit sets them, asks for the parameters of the scene that follow, and pulls the gradient by these parameters back with
the derivative that belongs to them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from .checkpoints.resumable import Resumable, State
from .optimisers import Adam, AdamMatrix
from .rigid_variables import BETA2
from .variables import Unknown

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
    own
        For each picture: parameter paths of the scene, except of the camera, and the values that only this picture
        has; all have the same paths. Empty: all pictures show the same scene. What belongs to pictures that were not
        asked for is empty.
    push
        The transpose of `pull`: maps a variable's path, the number of one of its numbers, and a picture to the
        derivative of the picture's parameters by that number. None: not known.
    """

    values: dict[str, F64]
    parameters: Mapping[str, Any]
    cameras: Sequence[Mapping[str, Any]]
    paths: Sequence[Sequence[str]]
    pull: Callable[[Mapping[str, F64], int], dict[str, F64]]
    own: Sequence[Mapping[str, Any]] = ()
    push: Callable[[str, int, int], Mapping[str, Any]] | None = None


class Variable(Unknown, Protocol):
    """A driven variable with an optimiser of its own."""

    value: F64


class Driven(Protocol):
    """Driven variables, and what follows from them."""

    @property
    def variables(self) -> Sequence[Numbers | Variable]:
        """The variables, the same objects at each call."""
        ...

    def place(self, values: Mapping[str, F64], views: Sequence[int] | None = None) -> Placement:
        """Set the variables, and return what follows for some of the pictures; None: for all."""
        ...

    def state(self) -> State:
        """Return all that the last call of `place` depended on besides its values (`Resumable`)."""
        ...

    def restore(self, state: State) -> None:
        """Take over what `state` has returned, so that the same call of `place` gives the same again."""
        ...


@runtime_checkable
class Looking(Protocol):
    """Driven variables that can be tried out."""

    def look(self, values: Mapping[str, F64]) -> Placement | None:
        """Return what would follow from some values, without derivatives; None: values that can't be set.

        It changes neither the variables nor the state.
        """
        ...


@dataclass
class Numbers(Resumable):
    """A driven variable of numbers within limits, whose steps `Steps` makes together with those of all others.

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

    changing: ClassVar[tuple[str, ...]] = ("value",)

    @property
    def step(self) -> float:
        """The largest first step."""
        return float(np.max(self.steps))


# More numbers have no common matrix, since each gradient tells it one direction, and old ones are forgotten.
MOST_TOGETHER = 24


def joint_step(optimiser: Adam | AdamMatrix, factor: float, parts: Sequence[tuple[F64, ...]]) -> list[F64]:
    """Return the next values of numbers that have one optimiser, each given by gradient, value, step and limits."""
    # Numbers at a limit that their gradient pushes against stay there, and do not bend the others' steps.
    joined = np.concatenate([
        np.where(((value <= low) & (by > 0.0)) | ((value >= high) & (by < 0.0)), 0.0, by * steps).ravel()
        for by, value, steps, low, high in parts
    ])
    change = optimiser.update(np.zeros_like(joined), joined, factor)
    ends = np.cumsum([value.size for _, value, *_ in parts])
    return [np.clip(value + steps * change[end - value.size : end].reshape(value.shape), low, high)
            for end, (_, value, steps, low, high) in zip(ends, parts, strict=True)]  # fmt: skip


class Steps(Resumable):
    """The steps of all driven variables.

    Numbers, each in units of its first step, have one optimiser: a camera that moves back while its lens gets longer
    hardly changes its picture, and neither do bones of a chain that bend against each other. Only the common matrix of
    their gradients shows such directions (`AdamMatrix`).
    """

    changing = ("_optimiser",)

    def __init__(self, variables: Sequence[Numbers | Variable]) -> None:
        self._variables = variables
        self._numbers = [one for one in variables if isinstance(one, Numbers)]
        count = sum(one.value.size for one in self._numbers)
        self._optimiser = AdamMatrix(1.0) if count <= MOST_TOGETHER else Adam(1.0, beta2=BETA2)

    def take(self, gradient: Mapping[str, F64], factor: float) -> dict[str, F64]:
        """Make one step of all variables, and return their next values."""
        out = {one.path: np.asarray(one.take_step(gradient[one.path], factor))
               for one in self._variables if not isinstance(one, Numbers)}  # fmt: skip
        if not self._numbers:
            return out
        parts = [(gradient[one.path], one.value, one.steps, one.low, one.high) for one in self._numbers]
        following = joint_step(self._optimiser, factor, parts)
        return out | dict(zip([one.path for one in self._numbers], following, strict=True))

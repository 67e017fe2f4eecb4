"""What a fit tells its callback after each iteration, and how the answer ends the fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import choice, flag
from .driven import Numbers, Variable
from .variables import Unknown

F64 = NDArray[np.float64]

# How a callback may end a fit.
ON_CANCEL = ("restore", "best")


@dataclass(frozen=True)
class FitStep:
    """State of a fit that its callback receives after each iteration.

    Attributes
    ----------
    iteration, iterations
        Number of iterations done, at least 1, and their total number.
    loss
        Loss at the values of this iteration, before its step. With several pictures: weighted mean of the most
        recent loss of each.
    smoothed
        Mean of the loss over the last few iterations.
    best
        Iteration, counted from 1, with the best values so far.
    seconds
        Seconds since the fit began.
    values
        Maps a parameter path to the value after the step. Read-only.
    view, picture
        Index of the last target of this iteration, and its picture at the values before the step, with its gain if
        that is unknown. Read-only.
    target
        What this picture is compared with: the target in the picture's size, over the world, without a known gain.
        Read-only.
    gradient
        Maps a parameter path to the gradient of the loss at the values before the step. Read-only.
    effects
        Maps a parameter path to the effect of its first step: the sum of the products of gradient and step length at
        the start.
    """

    iteration: int
    iterations: int
    loss: float
    smoothed: float
    best: int
    seconds: float
    values: Mapping[str, Any]
    view: int
    picture: NDArray[np.float32]
    target: NDArray[np.float32]
    gradient: Mapping[str, F64]
    effects: Mapping[str, float]


Callback = Callable[[FitStep], bool | str | None]


def ending(answer: bool | str | None) -> str | None:
    """Say how the callback's answer stops the fit; None: it does not."""
    if isinstance(answer, str):
        return choice("fit", "what the callback returns", answer, ON_CANCEL)
    return "callback" if answer is not None and not flag("fit", "what the callback returns", answer) else None


def effect(item: Unknown | Variable | Numbers, gradient: F64) -> float:
    """First-order change of the loss if each number of a variable moves by its first step, down the gradient."""
    steps = item.steps if isinstance(item, Numbers) else item.step
    return float(np.abs(gradient * steps).sum())

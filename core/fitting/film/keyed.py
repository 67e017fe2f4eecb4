"""Numbers with a value of their own in each frame of a film, their steps, and the prior over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..checkpoints.resumable import Resumable, State
from ..driven import MOST_TOGETHER, Numbers, joint_step
from ..losses import Loss
from ..optimisers import Adam, AdamMatrix
from ..rigid_variables import BETA2
from ..schedule import Start, Turn
from ..targets import View

F64 = NDArray[np.float64]


@dataclass
class KeyedNumbers(Numbers):
    """Numbers with a value in each frame; value, steps and limits have the shape (frames, n).

    Attributes
    ----------
    at_start
        The values at the beginning.
    """

    at_start: F64 = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        self.at_start = self.value.copy()

    def started(self, value: F64, starts: Sequence[Start]) -> F64:
        """Return the values with new ones of the frames that begin.

        The change since the beginning is that of the neighbours, so that a motion that was keyed before stays.
        """
        out, change = value.copy(), value - self.at_start
        for one in starts:
            moved = (1.0 - one.part) * change[one.before] + one.part * change[one.after]
            out[one.frame] = self.at_start[one.frame] + moved
        return np.clip(out, self.low, self.high)


class KeyedSteps(Resumable):
    """The steps of all keyed numbers: one optimiser for each frame (`driven.Steps` says why one for all numbers)."""

    def __init__(self, variables: Sequence[KeyedNumbers]) -> None:
        self._variables = variables
        frames = len(variables[0].value) if variables else 0
        count = sum(one.value.shape[1] for one in variables)
        self._optimisers = [AdamMatrix(1.0) if count <= MOST_TOGETHER else Adam(1.0, beta2=BETA2)
                            for _ in range(frames)]  # fmt: skip

    def state(self) -> State:
        """Return what steps change."""
        return {str(k): one.state() for k, one in enumerate(self._optimisers)}

    def restore(self, state: State) -> None:
        """Take over what `state` has returned."""
        for k, one in enumerate(self._optimisers):
            one.restore(state[str(k)])

    def take(self, gradient: Mapping[str, F64], frames: Sequence[int], factor: float) -> dict[str, F64]:
        """Make one step of some frames, and return the next values."""
        out = {one.path: one.value.copy() for one in self._variables}
        for k in frames:
            parts = [(gradient[one.path][k], one.value[k], one.steps[k], one.low[k], one.high[k])
                     for one in self._variables]  # fmt: skip
            for one, following in zip(self._variables, joint_step(self._optimisers[k], factor, parts), strict=True):
                out[one.path][k] = following
        return out


def prior_gradient(one: KeyedNumbers, times: Sequence[int], known: Sequence[int], weight: float) -> F64:
    """Return the gradient of the prior over time by the values.

    The prior is `weight` times the sum of squared second differences by the frame number, at all known frames with
    known neighbours, in units of the first steps.
    """
    out = np.zeros_like(one.value)
    if len(known) < 3 or weight == 0.0:
        return out
    at = np.asarray(known)
    scale = one.steps[at]
    value, time = one.value[at] / scale, np.asarray(times, np.float64)[at]
    before, after = (time[1:-1] - time[:-2])[:, None], (time[2:] - time[1:-1])[:, None]
    left, right = 2.0 / (before * (before + after)), 2.0 / (after * (before + after))
    second = left * value[:-2] - (left + right) * value[1:-1] + right * value[2:]
    slope = np.zeros_like(value)
    slope[:-2] += left * second
    slope[1:-1] -= (left + right) * second
    slope[2:] += right * second
    out[at] = 2.0 * weight * slope / scale
    return out


class KeyedFrames:
    """The keyed numbers of a running fit.

    Parameters
    ----------
    variables
        The keyed numbers.
    times
        Frame numbers.
    of_views
        Index of each target's frame.
    smoothness
        Weight of the prior over time (`Film`).

    Attributes
    ----------
    steps
        The steps of the numbers.
    """

    def __init__(self, variables: Sequence[KeyedNumbers], times: Sequence[int], of_views: Sequence[int],
                 smoothness: float) -> None:  # fmt: skip
        self._variables, self._times, self._of_views = variables, times, of_views
        self._smoothness = self._weight = smoothness
        self.steps = KeyedSteps(variables)

    def scale(self, seen: Sequence[View], loss: Loss) -> None:
        """Multiply the weight of the prior by the mean loss of pictures that have one colour, that of their target."""
        found = [float(loss(np.broadcast_to(view.image.mean(axis=(0, 1)), view.image.shape).astype(np.float32),
                            view.image, view.mask)[0]) for view in seen]  # fmt: skip
        self._weight = self._smoothness * float(np.mean(found))

    def take(self, gradient: Mapping[str, F64], turn: Turn) -> dict[str, F64]:
        """Make the step of an iteration, and return the next values.

        `gradient` is that of the mean loss of the iteration's pictures.
        """
        if not self._variables:
            return {}
        shown = [self._of_views[j] for j in turn.views]
        frames = sorted(set(shown))
        # The gradient of a frame's own loss, the mean over its pictures
        share = np.zeros((len(self._times), 1))
        for frame in frames:
            share[frame] = len(shown) / shown.count(frame)
        whole = {one.path: share * gradient[one.path] + prior_gradient(one, self._times, turn.known, self._weight)
                 for one in self._variables}  # fmt: skip
        return self.steps.take(whole, frames, turn.factor)

    def begun(self, values: Mapping[str, F64], turn: Turn) -> list[dict[str, F64]]:
        """Return the values with which an iteration may begin; the first are those that it begins with by default."""
        ways = [{one.path: one.started(values[one.path], starts) for one in self._variables} for starts in turn.starts]
        return [{**values, **way} for way in ways] or [dict(values)]

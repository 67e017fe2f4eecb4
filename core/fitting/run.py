"""A fit while it runs: renders, differentiates and steps, and keeps the best values."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import choice, flag, function, numeric, shown
from ..planning.scene_plan import Plan, plan
from ..rendering.one_shot import CAUSTIC_SAMPLES
from ..rendering.options import Progress
from ..rendering.renderer import Renderer
from ..scene import parameters
from ..scene.scene import Scene
from .losses import Loss
from .targets import View
from .variables import Unknown
from .zero_gradients import why_untouched

F64 = NDArray[np.float64]

# The step's length falls from 1 to LAST_STEP along a cosine, so that the end averages out the noise.
LAST_STEP = 0.05
# A step is the best so far by the mean loss of this many iterations: one lucky noisy picture is not progress.
SMOOTHED_OVER = 5
# Iterations whose losses tell how noisy they are.
NOISE_OVER = 20
ON_CANCEL = ("restore", "best")


@dataclass(frozen=True)
class FitStep:
    """What a fit's callback is told after each iteration.

    Attributes
    ----------
    iteration, iterations
        Iterations done, from 1 on, and to do in all.
    loss
        Loss at this iteration's values, before its step; of several pictures the weighted mean, each
        with its newest value.
    smoothed
        Mean of the loss over the last iterations.
    best
        Iteration (from 1 on) whose values would be kept so far.
    seconds
        Since the fit began.
    values
        Parameter path to the value after the step; not to be written to.
    """

    iteration: int
    iterations: int
    loss: float
    smoothed: float
    best: int
    seconds: float
    values: Mapping[str, Any]


Callback = Callable[[FitStep], bool | str | None]


class Run:
    """The state of a fit."""

    def __init__(
        self, work: Scene, renderer: Renderer, seen: list[View], unknowns: list[Unknown], loss: Loss, *,
        iterations: int, per_iteration: int, spp: int, gradient_spp: int, limits: dict[str, Any], seed: int,
        started: float, progress: Progress | None,
    ) -> None:
        self.work, self.renderer, self.seen, self.unknowns, self.loss = work, renderer, seen, unknowns, loss
        self.iterations, self.per_iteration = iterations, per_iteration
        self.spp, self.gradient_spp, self.limits = spp, gradient_spp, limits
        self.seed, self.started, self.progress = seed, started, progress
        self.start = self._values()
        self.best_values, self.best, self.least = self.start, 0, np.inf
        self.losses: list[float] = []
        self.newest = np.full(len(seen), np.nan)  # each picture's loss when it was last rendered
        self.touched = {u.path: np.zeros(np.shape(self.start[u.path]), bool) for u in unknowns}
        self.order = np.random.default_rng(seed).permutation(len(seen))

    def iterate(self, callback: Callback | None) -> str | None:
        """All iterations; returns how it was stopped, or None."""
        full_turn = -(-len(self.seen) // self.per_iteration)  # iterations until every picture was seen
        for k in range(self.iterations):
            gradient = self._gradient(k)
            self._record(k >= full_turn - 1)
            factor = LAST_STEP + (1.0 - LAST_STEP) * 0.5 * (1.0 + np.cos(np.pi * k / self.iterations))
            for item in self.unknowns:
                parameters.put(self.work, item.path, item.take_step(gradient[item.path], factor))
            self.renderer.update([item.path for item in self.unknowns])
            if k == full_turn - 1:
                self._warn_of_untouched()
            if callback is not None:
                answer = callback(self._report(k + 1))
                if isinstance(answer, str):
                    return choice("fit", "what the callback returns", answer, ON_CANCEL)
                if answer is not None and not flag("fit", "what the callback returns", answer):
                    return "as asked"
        return None

    def measure_end(self) -> None:
        """The loss after the last step, with the pictures of the last turn rendered anew."""
        for j in range(len(self.seen)):
            self._value(self.iterations, j, 1.0)
        self._record(True)

    def _gradient(self, k: int) -> dict[str, F64]:
        """Gradient of the loss at iteration k over its pictures; also keeps their losses."""
        count = len(self.seen)
        first = k * self.per_iteration
        total = {item.path: np.zeros(np.shape(self.start[item.path])) for item in self.unknowns}
        wrt = list(total)
        for n in range(self.per_iteration):
            j = int(self.order[(first + n) % count])
            done = (k + n / self.per_iteration) / (self.iterations + 1)
            adjoint = self._value(k, j, done)
            if not adjoint.any():
                continue
            part = self.renderer.render_backward(
                adjoint, wrt, spp=self.gradient_spp, **self.limits, seed=self._seed(k, j, 1),
                camera=self.seen[j].camera, progress=self._part(done, 0.5 / self.per_iteration, 0.5),
            )
            for path in wrt:
                total[path] += part[path] / self.per_iteration
        for path, value in total.items():
            bad = np.argwhere(~np.isfinite(value))
            if len(bad):
                at = f" at {tuple(int(i) for i in bad[0])}" if value.ndim else ""
                raise FloatingPointError(f"fit: the gradient of '{path}' is not finite{at} in iteration {k + 1}")
            self.touched[path] |= value != 0.0
        return total

    def _value(self, k: int, j: int, done: float) -> NDArray[np.float32]:
        """Render picture j, note its loss, and return the adjoint of this iteration's form of the loss."""
        view = self.seen[j]
        image = self.renderer.render(
            spp=self.spp, **self.limits, seed=self._seed(k, j, 0), camera=view.camera,
            progress=self._part(done, 0.0, 0.5),
        )
        if not np.isfinite(image).all():
            raise FloatingPointError(f"fit: the picture of target {j} is not finite in iteration {k + 1}")
        value, adjoint = _checked_loss(self.loss(image, view.image, view.mask), image)
        if not (np.isfinite(value) and np.isfinite(adjoint).all()):
            raise FloatingPointError(f"fit: the loss of target {j} is not finite in iteration {k + 1}")
        self.newest[j] = value
        at = getattr(self.loss, "at", None)
        if at is not None:
            loss = function("fit", "what loss.at returns", at(min(k / max(self.iterations - 1, 1), 1.0)))
            adjoint = _checked_loss(loss(image, view.image, view.mask), image)[1]
        return np.asarray(view.weight * adjoint, np.float32)

    def _record(self, complete: bool) -> None:
        """Note the loss of the current values; keep them if they are the best."""
        weight = np.array([view.weight for view in self.seen])
        known = np.isfinite(self.newest)
        self.losses.append(float((weight * self.newest)[known].sum() / weight[known].sum()))
        # Of values that only noise tells apart the latest are the best: shrinking steps average the noise of many.
        if complete and self.smoothed() <= self.least + self._noise():
            self.least, self.best = min(self.least, self.smoothed()), len(self.losses) - 1
            self.best_values = self._values()

    def smoothed(self) -> float:
        return float(np.mean(self.losses[-SMOOTHED_OVER:]))

    def _noise(self) -> float:
        """Standard error of the smoothed loss, from the differences of successive losses, which no trend hides."""
        steps = np.diff(self.losses[-NOISE_OVER:])
        return float(np.sqrt(0.5 * np.mean(steps**2) / SMOOTHED_OVER)) if len(steps) else 0.0

    def _values(self) -> dict[str, Any]:
        return {item.path: parameters.get(self.work, item.path) for item in self.unknowns}

    def _report(self, iteration: int) -> FitStep:
        return FitStep(
            iteration, self.iterations, self.losses[-1], self.smoothed(), self.best + 1,
            time.monotonic() - self.started, self._values(),
        )

    def _seed(self, k: int, j: int, kind: int) -> int:
        """Independent seeds for every iteration, picture, and kind (0: picture, 1: derivative)."""
        return int(np.random.SeedSequence([self.seed, k, j, kind]).generate_state(1)[0])

    def _part(self, done: float, offset: float, share: float) -> Progress | None:
        """The progress of one render as part of the whole fit's."""
        report = self.progress
        if report is None:
            return None
        scale = 1.0 / (self.per_iteration * (self.iterations + 1))
        return lambda fraction: report(min(done + (offset + share * fraction) * scale, 1.0))

    @cached_property
    def plan(self) -> Plan:
        """What derivatives by the fitted parameters consist of."""
        return plan(self.work, [item.path for item in self.unknowns], max_depth=self.limits["max_depth"],
                    measure=CAUSTIC_SAMPLES)

    def _warn_of_untouched(self) -> None:
        for path, touched in self.touched.items():
            if not touched.any():
                reason = why_untouched(self.work, self.newest, path, self.plan)
                warnings.warn(
                    f"fit: no gradient for '{path}', because {reason}",
                    RuntimeWarning,
                    stacklevel=4,
                )


def _checked_loss(found: Any, image: NDArray[np.float32]) -> tuple[float, NDArray[Any]]:
    """What a loss has returned, if it has the form (value, adjoint); finite or not."""
    if not isinstance(found, tuple) or len(found) != 2:
        raise ValueError(f"fit: loss must return (value, adjoint), not {shown(found)}")
    value = numeric("fit", "the value that loss returns", found[0])
    adjoint = numeric("fit", "the adjoint that loss returns", found[1])
    if value.ndim or adjoint.shape != image.shape:
        raise ValueError(f"fit: loss must return a number and an array of the shape {image.shape}, not arrays of the "
                         f"shapes {value.shape} and {adjoint.shape}")
    return float(value), adjoint

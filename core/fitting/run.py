"""The loop of a fit.

Each iteration renders the picture of each target, evaluates the loss and its adjoint picture, pulls the adjoint back to
a gradient by the parameters (`Renderer.render_backward`), and makes one step of each optimiser. Pictures and gradients
are Monte Carlo estimates, so the loop shortens its steps towards the end and compares losses that are averaged over a
few iterations.
"""

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
from ..scene.camera import Camera
from ..scene.scene import Scene
from .driven import Driven, Placement, Steps
from .field_variables import Coefficients
from .losses import Loss
from .targets import View
from .topological_steps import TopologicalStep, topology_is_due
from .variables import Unknown
from .zero_gradients import why_untouched

F64 = NDArray[np.float64]

# Factor of the step length at the end; it falls from 1 along a cosine. Short last steps average out the noise of the
# gradients, but a factor that is too small stops the fit early.
LAST_STEP = 0.05
# Iterations over which the loss is averaged before it is compared with the best so far: the loss of a single noisy
# picture may be small by chance.
SMOOTHED_OVER = 5
# Last iterations whose losses are used to estimate the noise of the loss.
NOISE_OVER = 20
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
    """The state of a running fit."""

    def __init__(
        self, work: Scene, renderer: Renderer, seen: list[View], unknowns: list[Unknown], loss: Loss, *,
        iterations: int, per_iteration: int, spp: int, gradient_spp: int, limits: dict[str, Any], seed: int,
        started: float, progress: Progress | None, driven: Driven | None = None, placement: Placement | None = None,
    ) -> None:
        self.work, self.renderer, self.seen, self.unknowns, self.loss = work, renderer, seen, unknowns, loss
        self.iterations, self.per_iteration = iterations, per_iteration
        self.spp, self.gradient_spp, self.limits = spp, gradient_spp, limits
        self.seed, self.started, self.progress = seed, started, progress
        self.driven, self.placement = driven, placement
        self.steps = Steps(() if driven is None else driven.variables)
        self.first_gradient: dict[str, F64] = {}  # by the driven variables, at the start
        self.start = self._values()
        self.best_values, self.best, self.least = self.start, 0, np.inf
        self.losses: list[float] = []
        self.newest = np.full(len(seen), np.nan)  # most recent loss of each picture
        self.touched = {path: np.zeros(np.shape(value), bool) for path, value in self.start.items()}
        self.order = np.random.default_rng(seed).permutation(len(seen))

    def iterate(self, callback: Callback | None) -> str | None:
        """Run all iterations.

        Returns
        -------
        None, or how the callback stopped the fit: "restore", "best", or "callback" if `on_cancel` decides.
        """
        full_turn = -(-len(self.seen) // self.per_iteration)  # iterations until every picture was rendered
        for k in range(self.iterations):
            gradient = self._gradient(k)
            self._record(k >= full_turn - 1)
            factor = LAST_STEP + (1.0 - LAST_STEP) * 0.5 * (1.0 + np.cos(np.pi * k / self.iterations))
            for item in self.unknowns:
                parameters.put(self.work, item.path, item.take_step(gradient[item.path], factor))
            changed = [item.path for item in self.unknowns]
            if self.driven is not None:
                changed += self.place(self.steps.take(gradient, factor))
            self.renderer.update(changed)
            self._change_topology(k, full_turn)
            if k == full_turn - 1:
                self._warn_of_untouched()
            if callback is not None:
                answer = callback(self._report(k + 1))
                if isinstance(answer, str):
                    return choice("fit", "what the callback returns", answer, ON_CANCEL)
                if answer is not None and not flag("fit", "what the callback returns", answer):
                    return "callback"
        return None

    def _change_topology(self, k: int, full_turn: int) -> None:
        """Let the distance fields open holes and get parts, if it is time for it."""
        for item in self.unknowns:
            if not isinstance(item, Coefficients):
                continue
            last = item.options.topology_every > 0 and k == self.iterations - 1
            if not last and not topology_is_due(item.options.topology_every, k, full_turn, self.iterations):
                continue

            def render(j: int, twin: int) -> NDArray[np.float32]:
                return self.renderer.render(spp=self.spp, **self.limits, seed=self._seed(k, j, 2 + twin),
                                            camera=self.seen[j].camera)

            step = TopologicalStep(item, self.work, self.renderer, self.seen, self.loss, render)
            if last:
                step.simplify()
            else:
                step.take()

    def place(self, values: Mapping[str, F64]) -> list[str]:
        """Set the driven variables and the scene's parameters that follow; return the paths of the latter."""
        assert self.driven is not None
        self.placement = placed = self.driven.place(values)
        for item in self.driven.variables:
            item.value = placed.values[item.path]
        for view, fields in zip(self.seen, placed.cameras, strict=True):
            for name, value in fields.items():
                setattr(view.camera, name, value)
        for path, value in placed.parameters.items():
            parameters.put(self.work, path, value)
        return list(placed.parameters)

    def measure_end(self) -> None:
        """Render all pictures once more and record the loss after the last step."""
        for j in range(len(self.seen)):
            self._value(self.iterations, j, 1.0)
        self._record(True)

    def _gradient(self, k: int) -> dict[str, F64]:
        """Return the gradient of the loss over the pictures of iteration k, and record their losses."""
        count = len(self.seen)
        first = k * self.per_iteration
        total = {path: np.zeros(np.shape(value)) for path, value in self.start.items()}
        own = [item.path for item in self.unknowns]
        for n in range(self.per_iteration):
            j = int(self.order[(first + n) % count])
            done = (k + n / self.per_iteration) / (self.iterations + 1)
            adjoint = self._value(k, j, done)
            moving = () if self.placement is None else self.placement.paths[j]
            wrt = list(dict.fromkeys((*own, *moving)))
            if not adjoint.any() or not wrt:
                continue
            part = self.renderer.render_backward(
                adjoint, wrt, spp=self.gradient_spp, **self.limits, seed=self._seed(k, j, 1),
                camera=self._camera_of_gradient(j, wrt),
                progress=self._part(done, 0.5 / self.per_iteration, 0.5),
            )
            pulled = {} if self.placement is None else self.placement.pull(part, j)
            for path, value in ({path: part[path] for path in own} | pulled).items():
                total[path] += value / self.per_iteration
        for path, value in total.items():
            bad = np.argwhere(~np.isfinite(value))
            if len(bad):
                at = f" at {tuple(int(i) for i in bad[0])}" if value.ndim else ""
                raise FloatingPointError(f"fit: the gradient of '{path}' is not finite{at} in iteration {k + 1}")
            self.touched[path] |= value != 0.0
        if k == 0 and self.driven is not None:
            self.first_gradient = {item.path: total[item.path] for item in self.driven.variables}
        return total

    def _camera_of_gradient(self, j: int, wrt: list[str]) -> Camera | None:
        """Camera argument of a gradient of picture j. Derivatives by a camera are those by the scene's own."""
        camera = self.seen[j].camera
        if not any(path.startswith("camera.") for path in wrt):
            return camera
        if self.work.camera is not camera:
            self.work.camera = camera
        self.renderer.update(["camera.to_world"])
        return None

    def _value(self, k: int, j: int, done: float) -> NDArray[np.float32]:
        """Render picture j, record its loss, and return the adjoint picture of this iteration.

        The recorded loss is the same function in all iterations. The adjoint is that of `loss.at(progress)`, if the
        loss has a schedule.
        """
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
        """Record the loss of the current values, and keep the values if they are the best."""
        weight = np.array([view.weight for view in self.seen])
        known = np.isfinite(self.newest)
        self.losses.append(float((weight * self.newest)[known].sum() / weight[known].sum()))
        # If losses differ by less than their noise, the latest values count as the best: the shorter steps at the end
        # average the noise of many gradients.
        if complete and self.smoothed() <= self.least + self._noise():
            self.least, self.best = min(self.least, self.smoothed()), len(self.losses) - 1
            self.best_values = self._values()

    def smoothed(self) -> float:
        """Mean of the loss over the last few iterations."""
        return float(np.mean(self.losses[-SMOOTHED_OVER:]))

    def _noise(self) -> float:
        """Standard error of the smoothed loss, from differences of successive losses, which remove a trend."""
        steps = np.diff(self.losses[-NOISE_OVER:])
        return float(np.sqrt(0.5 * np.mean(steps**2) / SMOOTHED_OVER)) if len(steps) else 0.0

    def _values(self) -> dict[str, Any]:
        out = {item.path: parameters.get(self.work, item.path) for item in self.unknowns}
        if self.driven is not None:
            out |= {item.path: item.value for item in self.driven.variables}
        return out

    def _report(self, iteration: int) -> FitStep:
        return FitStep(
            iteration, self.iterations, self.losses[-1], self.smoothed(), self.best + 1,
            time.monotonic() - self.started, self._values(),
        )

    def _seed(self, k: int, j: int, kind: int) -> int:
        """Seed of iteration k, picture j and kind (0: picture, 1: derivative); all seeds are independent."""
        return int(np.random.SeedSequence([self.seed, k, j, kind]).generate_state(1)[0])

    def _part(self, done: float, offset: float, fraction: float) -> Progress | None:
        """Map the progress of one render to the progress of the whole fit."""
        report = self.progress
        if report is None:
            return None
        scale = 1.0 / (self.per_iteration * (self.iterations + 1))
        return lambda part: report(min(done + (offset + fraction * part) * scale, 1.0))

    @cached_property
    def plan(self) -> Plan:
        """The plan of the derivatives with respect to the fitted parameters."""
        paths = dict.fromkeys(item.path for item in self.unknowns)
        for of_view in () if self.placement is None else self.placement.paths:
            paths |= dict.fromkeys(of_view)
        return plan(self.renderer, list(paths), max_depth=self.limits["max_depth"], measure=CAUSTIC_SAMPLES)

    def _warn_of_untouched(self) -> None:
        for path, touched in self.touched.items():
            if not touched.any():
                driven = self.driven is not None and any(path == item.path for item in self.driven.variables)
                reason = ("nothing that the cameras see depends on it" if driven
                          else why_untouched(self.work, self.newest, path, self.plan))  # fmt: skip
                warnings.warn(
                    f"fit: no gradient for '{path}', because {reason}",
                    RuntimeWarning,
                    stacklevel=4,
                )


def _checked_loss(found: Any, image: NDArray[np.float32]) -> tuple[float, NDArray[Any]]:
    """Return what a loss has returned, if it has the form (value, adjoint); the numbers may be non-finite."""
    if not isinstance(found, tuple) or len(found) != 2:
        raise ValueError(f"fit: loss must return (value, adjoint), not {shown(found)}")
    value = numeric("fit", "the value that loss returns", found[0])
    adjoint = numeric("fit", "the adjoint that loss returns", found[1])
    if value.ndim or adjoint.shape != image.shape:
        raise ValueError(f"fit: loss must return a number and an array of the shape {image.shape}, not arrays of the "
                         f"shapes {value.shape} and {adjoint.shape}")
    return float(value), adjoint

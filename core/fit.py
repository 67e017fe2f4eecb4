"""Fitting a scene to pictures: the loop that renders, differentiates and steps."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import narrow_derivatives, parameters
from ._check import number, whole
from .bounces import MAX_DEPTH, Bounces
from .losses import Loss, Pyramid
from .renderer import MAX_DERIVATIVE_DEPTH, Cancelled, Progress, Renderer, engine_class
from .scene import Scene
from .table_derivatives import asked_tables, wanted_tables
from .tables import flatten
from .targets import Targets, View, views
from .unknowns import Unknown, unknown
from .untouched import why_untouched

F64 = NDArray[np.float64]

# The step's length falls from 1 to LAST_STEP along a cosine, so that the end averages out the noise.
LAST_STEP = 0.05
# A step is the best so far by the mean loss of this many iterations: one lucky noisy picture is not progress.
SMOOTHED_OVER = 5
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
        Iteration (from 1 on) with the least smoothed loss so far.
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


@dataclass(frozen=True)
class FitResult:
    """What a fit found.

    Attributes
    ----------
    values
        Parameter path to the value that the scene has now.
    losses
        Loss before each step and, unless cancelled, after the last one.
    best
        Index into `losses` of the values with the least smoothed loss; those are kept.
    seconds
        Of the whole fit.
    cancelled
        Whether the callback or the progress function stopped it.
    untouched
        Parameter path to the share of its entries whose gradient was 0 in every iteration: nothing in
        the pictures depended on them (they moved only as their neighbours took them along).
    """

    values: dict[str, Any]
    losses: list[float]
    best: int
    seconds: float
    cancelled: bool
    untouched: dict[str, float]


Callback = Callable[[FitStep], bool | str | None]


def fit(
    scene: Scene,
    targets: Targets,
    wrt: Sequence[str],
    *,
    iterations: int = 200,
    spp: int = 16,
    gradient_spp: int | None = None,
    max_depth: int = 2,
    bounces: Bounces | None = None,
    loss: Loss | None = None,
    smoothness: float | None = None,
    slide: float | None = None,
    step_sizes: Mapping[str, float] | None = None,
    views_per_iteration: int | None = None,
    seed: int = 0,
    threads: int = 0,
    engine: str = "auto",
    on_cancel: str = "restore",
    callback: Callback | None = None,
    progress: Progress | None = None,
) -> FitResult:
    """Move parameters of the scene until its pictures look like the targets.

    The scene is changed once, at the end: while it runs a copy is fitted, so whatever happens before
    (an error, a cancel, Ctrl-C) leaves the scene as it was.

    Parameters
    ----------
    scene
        Where to start, and where the result is written.
    targets
        One or more pictures with their cameras (`Target`); a bare (H, W, 3) array is a picture seen by
        the scene's camera.
    wrt
        Parameter paths that may move.
    iterations
        Steps to make.
    spp, gradient_spp
        Samples per pixel of the pictures and of their derivatives (None: as `spp`); the two use
        independent seeds, without which the gradient would be biased.
    max_depth, bounces
        Path segments, and most scatterings of each kind, as for `edgegrad.render`.
    loss
        A loss of `edgegrad.losses` or any function of its form; None: `Pyramid()`. A loss with a
        method ``at(part done)`` is asked for each iteration's form (the pyramid goes from coarse to
        fine); the loss that is reported and compared stays the same throughout.
    smoothness
        lambda of the vertices' preconditioning, see `LargeSteps`; None: by the number of vertices;
        0: none.
    slide
        Share in [0, 1] of the vertices' motion along their surface that is kept (1: all). Such motion
        changes no shape except at open borders and material borders, but spreads vertices unevenly.
        None: 0.2 for closed meshes, 1 for those with open borders.
    step_sizes
        Parameter path to the length of its first step: for vertices that of the vertex that moves most,
        as a fraction of their mesh's bounding box diagonal; of positions as a fraction of the scene's; of
        directions radians; of poses both; else in the parameter's unit. Those not named get a default: 0.02
        for all of these, 0.03 for colours and shares, 3 % of the value for powers, radiances and sizes.
        Later steps follow the gradient and shrink towards the end.
    views_per_iteration
        Pictures that each iteration renders, all of them in turn; None: all.
    seed
        Equal seeds give equal results, for any number of threads.
    threads, engine
        As for `edgegrad.Renderer`.
    on_cancel
        What a cancelled fit leaves: "restore", the scene as it was, or "best", the best step so far.
    callback
        Called after each iteration. Returning False or raising `Cancelled` stops the fit as
        `on_cancel` says; returning "restore" or "best" stops it that way.
    progress
        Called with the fraction of the whole fit several times per iteration; raising `Cancelled`
        stops it as `on_cancel` says.

    Returns
    -------
    The result; every value stays in its range, directions keep their lengths, poses stay rigid motions of
    where they started.

    Raises
    ------
    ValueError
        Before anything is rendered, for a wrong scene, target, path or option, naming it.
    FloatingPointError
        If a gradient or loss is not finite, naming the parameter or target.

    Warns
    -----
    RuntimeWarning
        If no picture depends on a parameter.
    """
    started = time.monotonic()
    scene.validate()
    work = _copy(scene)
    narrow = engine_class(engine).narrow
    paths = _checked_paths(work, wrt, narrow)
    seen = views(work, targets, engine)
    iterations = whole("fit", "iterations", iterations, 1, 1_000_000)
    spp = whole("fit", "spp", spp, 1, 1 << 24)
    samples = spp if gradient_spp is None else whole("fit", "gradient_spp", gradient_spp, 1, 1 << 24)
    max_depth = whole("fit", "max_depth", max_depth, 1, MAX_DERIVATIVE_DEPTH if narrow else MAX_DEPTH)
    if bounces is not None:
        bounces.validate()
    per_iteration = len(seen)
    if views_per_iteration is not None:
        per_iteration = whole("fit", "views_per_iteration", views_per_iteration, 1, len(seen))
    seed = whole("fit", "seed", seed, 0, 0xFFFFFFFF)
    if on_cancel not in ON_CANCEL:
        raise ValueError(f"fit: on_cancel must be 'restore' or 'best', not {on_cancel!r}")
    if smoothness is not None:
        smoothness = number("fit", "smoothness", smoothness, least=0.0)
    if slide is not None and not 0.0 <= number("fit", "slide", slide) <= 1.0:
        raise ValueError(f"fit: slide must be between 0 and 1, not {slide:g}")
    steps = _checked_steps(paths, step_sizes)
    unknowns = [unknown(work, path, steps.get(path), smoothness, slide) for path in paths]
    loss = Pyramid() if loss is None else loss

    run = _Run(
        work, Renderer(work, threads=threads, engine=engine), seen, unknowns, loss,
        iterations=iterations, per_iteration=per_iteration, spp=spp, gradient_spp=samples,
        limits={"max_depth": max_depth, "bounces": bounces}, seed=seed, started=started, progress=progress,
    )
    stop = None
    try:
        stop = run.iterate(callback)
        if stop is None:
            run.measure_end()
    except Cancelled:
        stop = on_cancel
    stop = on_cancel if stop == "as asked" else stop
    kept = run.start if stop == "restore" else run.best_values
    if stop != "restore":
        for path, value in kept.items():
            parameters.put(scene, path, value)
    return FitResult(
        {path: np.copy(value) if np.ndim(value) else value for path, value in kept.items()},
        run.losses, run.best, time.monotonic() - started, stop is not None,
        {path: float(np.mean(~touched)) for path, touched in run.touched.items()},
    )


class _Run:
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
        self.best_values, self.best, self.best_loss = self.start, 0, np.inf
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
                if answer is False:
                    return "as asked"
                if answer in ON_CANCEL:
                    return str(answer)
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
        value, adjoint = self.loss(image, view.image, view.mask)
        if not (np.isfinite(value) and np.isfinite(adjoint).all()):
            raise FloatingPointError(f"fit: the loss of target {j} is not finite in iteration {k + 1}")
        self.newest[j] = value
        at = getattr(self.loss, "at", None)
        if at is not None:
            adjoint = at(min(k / max(self.iterations - 1, 1), 1.0))(image, view.image, view.mask)[1]
        return np.asarray(view.weight * adjoint, np.float32)

    def _record(self, complete: bool) -> None:
        """Note the loss of the current values; keep them if they are the best."""
        weight = np.array([view.weight for view in self.seen])
        known = np.isfinite(self.newest)
        self.losses.append(float((weight * self.newest)[known].sum() / weight[known].sum()))
        if complete and self.smoothed() <= self.best_loss:
            self.best_loss, self.best = self.smoothed(), len(self.losses) - 1
            self.best_values = self._values()

    def smoothed(self) -> float:
        return float(np.mean(self.losses[-SMOOTHED_OVER:]))

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

    def _warn_of_untouched(self) -> None:
        for path, touched in self.touched.items():
            if not touched.any():
                warnings.warn(
                    f"fit: no gradient for '{path}', because {why_untouched(self.work, self.newest, path)}",
                    RuntimeWarning,
                    stacklevel=4,
                )


def _checked_paths(work: Scene, wrt: Sequence[str], narrow: bool) -> list[str]:
    if isinstance(wrt, str):
        raise ValueError("fit: wrt must be a list of parameter paths, not one string")
    paths = list(wrt)
    if not paths:
        raise ValueError("fit: wrt is empty; name at least one parameter path")
    for path in paths:
        if paths.count(path) > 1:
            raise ValueError(f"fit: wrt names '{path}' more than once")
    wanted_tables(work, asked_tables(work, flatten(work), paths), paths)  # raises for each that has no derivative
    if narrow:
        narrow_derivatives.check(paths)
    return paths


def _checked_steps(paths: list[str], step_sizes: Mapping[str, float] | None) -> dict[str, float]:
    steps = {}
    for path, step in (step_sizes or {}).items():
        if path not in paths:
            raise ValueError(f"fit: step_sizes names '{path}', which is not in wrt")
        steps[path] = number("fit", f"step size of '{path}'", step, above=0.0)
    return steps


def _copy(scene: Scene) -> Scene:
    """A scene with its own objects that shares the arrays, which `parameters.put` replaces and never writes to."""
    return Scene(
        replace(scene.camera),
        {name: replace(mesh) for name, mesh in scene.meshes.items()},
        {name: replace(material) for name, material in scene.materials.items()},
        {name: replace(light) for name, light in scene.lights.items()},
        replace(scene.world),
        {name: replace(image) for name, image in scene.images.items()},
    )

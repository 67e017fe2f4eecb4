"""Fitting a scene to pictures."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._check import choice, function, mapping, names, number, whole
from .._fields import optional
from ..derivatives.table_derivatives import requested_tables, with_requested
from ..reference import diffuse_tables
from ..rendering.engine import Progress, engine_class
from ..rendering.options import MOST_THREADS, checked_bounces, checked_progress
from ..rendering.renderer import MAX_DERIVATIVE_DEPTH, Cancelled, Renderer
from ..scene import parameters
from ..scene.bounces import MAX_DEPTH, Bounces
from ..scene.scene import Scene, validated
from ..tables.tables import flatten
from .large_steps import MOST_SMOOTHNESS
from .losses import Loss, Pyramid
from .run import ON_CANCEL, Callback, Run
from .targets import Targets, views
from .variables import unknown
from .zero_gradients import untouched_part


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
        Index into `losses` of the values that are kept: with the least smoothed loss, and the latest of those
        that only noise tells apart.
    seconds
        Of the whole fit.
    cancelled
        Whether the callback or the progress function stopped it.
    untouched
        Parameter path to the share of its entries whose gradient was 0 in every iteration: nothing in
        the pictures depended on them (they moved only as their neighbours took them along).
    notes
        Sentences: what the derivatives leave out though it may not be zero (`Plan.missing`), and of which
        parameters a part has no gradient, and why.
    """

    values: dict[str, Any]
    losses: list[float]
    best: int
    seconds: float
    cancelled: bool
    untouched: dict[str, float]
    notes: tuple[str, ...]


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
    spp
        The quality of each iteration: samples per pixel of its pictures and of their derivatives. 4 to 16 do for
        most fits, as the steps average over iterations; more make steps surer, and slower in proportion.
    gradient_spp
        Samples per pixel of the derivatives alone; None: `spp`. Pictures and derivatives have independent seeds,
        without which the gradient would be biased.
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
        directions radians; of poses both together; else in the parameter's unit. Those not named get a default: 0.02
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
    validated(scene)
    work = _copy(scene)
    narrow = engine_class(engine).narrow
    paths = _checked_paths(work, wrt, narrow)
    seen = views(work, targets, engine)
    iterations = whole("fit", "iterations", iterations, 1, 1_000_000)
    spp = whole("fit", "spp", spp, 1, 1 << 24)
    samples = spp if gradient_spp is None else whole("fit", "gradient_spp", gradient_spp, 1, 1 << 24)
    max_depth = whole("fit", "max_depth", max_depth, 1, MAX_DERIVATIVE_DEPTH if narrow else MAX_DEPTH)
    bounces = checked_bounces("fit", bounces)
    per_iteration = len(seen)
    if views_per_iteration is not None:
        per_iteration = whole("fit", "views_per_iteration", views_per_iteration, 1, len(seen))
    seed = whole("fit", "seed", seed, 0, 0xFFFFFFFF)
    choice("fit", "on_cancel", on_cancel, ON_CANCEL)
    threads = whole("fit", "threads", threads, 0, MOST_THREADS)
    callback, progress = optional(function)("fit", "callback", callback), checked_progress("fit", progress)
    loss = Pyramid() if loss is None else function("fit", "loss", loss)
    if smoothness is not None:
        smoothness = number("fit", "smoothness", smoothness, least=0.0, greatest=MOST_SMOOTHNESS)
    if slide is not None:
        slide = number("fit", "slide", slide, least=0.0, greatest=1.0)
    steps = _checked_steps(paths, step_sizes)
    unknowns = [unknown(work, path, steps.get(path), smoothness, slide) for path in paths]

    renderer = Renderer(work, threads=threads, engine=engine, learn=True, wrt=paths)
    renderer.watched = False  # nobody else has the copy
    run = Run(
        work, renderer, seen, unknowns, loss,
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
    missing = run.plan.missing
    cameras = [view.camera for view in seen]
    parts = [untouched_part(work, cameras, path, touched) for path, touched in run.touched.items()]
    kept = run.start if stop == "restore" else run.best_values
    if stop != "restore":
        for path, value in kept.items():
            parameters.put(scene, path, value)
    return FitResult(
        {path: np.copy(value) if np.ndim(value) else value for path, value in kept.items()},
        run.losses, run.best, time.monotonic() - started, stop is not None,
        {path: float(np.mean(~touched)) for path, touched in run.touched.items()},
        (*(f"not computed: {sentence}" for sentence in missing), *(part for part in parts if part is not None)),
    )


def _checked_paths(work: Scene, wrt: Sequence[str], narrow: bool) -> list[str]:
    paths = list(names("fit", "wrt", wrt, "parameter paths"))
    if not paths:
        raise ValueError("fit: wrt is empty; name at least one parameter path")
    for path, count in Counter(paths).items():
        if count > 1:
            raise ValueError(f"fit: wrt names '{path}' more than once")
    requested_tables(work, with_requested(work, flatten(work), paths), paths)  # raises for each that has no derivative
    if narrow:
        diffuse_tables.check(paths)
    return paths


def _checked_steps(paths: list[str], step_sizes: Mapping[str, float] | None) -> dict[str, float]:
    steps = {}
    for path, step in mapping("fit", "step_sizes", {} if step_sizes is None else step_sizes).items():
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

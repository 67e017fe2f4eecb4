"""`edgegrad.fit`: gradient-based fitting of scene parameters to pictures.

This module checks the arguments, makes one variable for each parameter (`variables`) and one view for each target
(`targets`), runs the loop (`run`) on a copy of the scene, and writes the best values back.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .._check import choice, flag, function, instance, mapping, names, number, whole
from .._fields import optional
from ..derivatives.table_derivatives import requested_tables, with_requested
from ..reference import diffuse_tables
from ..rendering.engine import engine_class
from ..rendering.options import MOST_THREADS, Progress, checked_bounces, checked_field_edges, checked_progress
from ..rendering.renderer import MAX_DERIVATIVE_DEPTH, Cancelled, Renderer
from ..scene import parameters
from ..scene.bounces import MAX_DEPTH, Bounces
from ..scene.scene import Scene, validated
from ..tables.tables import flatten
from . import fingerprint
from .checkpoint_file import check_checkpoint
from .checkpoints import Checkpoints
from .driven import Driven, Placement
from .fields.schedule import FieldSteps
from .film.checked_film import check_film
from .film.film import Film
from .film.film_schedule import FilmSchedule
from .film.keyed import KeyedFrames, KeyedNumbers
from .film.keyed_parameters import KeyedParameters
from .fit_step import ON_CANCEL, Callback
from .large_steps import MOST_SMOOTHNESS
from .losses import Loss, Pyramid
from .outcome.findings import findings, open_depths
from .outcome.result import FitResult
from .outcome.uncertainty import MEASURED, Exchange, Uncertainty
from .outcome.uncertainty import uncertainty as measured_uncertainty
from .outcome.zero_gradients import untouched_part
from .run import Run
from .schedule import Cycle, Schedule
from .search.begin import begin, choose_symmetric_start
from .silhouettes import Silhouettes
from .stages import Stages
from .targets import Targets, views
from .variables import Unknown, unknown
from .vertices.rules import VertexRules, checked_rules
from .vertices.variables import Vertices


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
    vertex_rules: Mapping[str, VertexRules] | None = None,
    field_steps: FieldSteps | None = None,
    field_edges: str = "outlines",
    step_sizes: Mapping[str, float] | None = None,
    views_per_iteration: int | None = None,
    seed: int = 0,
    threads: int = 0,
    engine: str = "auto",
    on_cancel: str = "restore",
    callback: Callback | None = None,
    progress: Progress | None = None,
    driven: Driven | None = None,
    film: Film | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 25,
    resume: bool = False,
    uncertainty: bool = False,
    search: int | None = None,
    restarts: int = 0,
) -> FitResult:
    """Change parameters of the scene until its pictures match the targets.

    The fit works on a copy and changes the scene once, at the end. An error, a cancellation or Ctrl-C before that
    leaves the scene unchanged.

    Parameters
    ----------
    scene
        The initial scene; the result is written to it.
    targets
        One or more pictures with their cameras (`Target`). A bare (H, W, 3) array is a picture of the scene's
        camera.
    wrt
        Paths of the parameters to fit.
    iterations
        Number of steps.
    spp
        Samples per pixel of the pictures and derivatives of each iteration. 4 to 16 suffice for most fits, since
        the optimiser averages over iterations. More samples reduce the noise of a step; time is proportional.
    gradient_spp
        Samples per pixel of the derivatives, if they differ from those of the pictures; None: `spp`.
    max_depth, bounces
        Largest number of path segments, and bounce limits by kind, as for `edgegrad.render`.
    loss
        A loss of `edgegrad.losses` or any function with the same signature; None: `Pyramid()`. If the loss has a
        method ``at(progress)``, each iteration uses the adjoint of the loss that it returns (the pyramid goes from
        coarse to fine). Reported and compared values always come from the loss itself.
    smoothness
        lambda of the preconditioner of vertices, see `LargeSteps`; None: it falls from a value for the number of
        vertices to a small one, so that detail follows large moves; 0: no preconditioning.
    slide
        Factor in [0, 1] for the tangential motion of vertices (1: unchanged). Tangential motion does not change the
        shape, except at open borders and material borders, but it makes the spacing of vertices uneven.
        None: 0.5 for closed meshes, 1 for meshes with open borders.
    vertex_rules
        Maps a parameter path of vertices to what they may do (`VertexRules`): weights, locked axes, symmetry.
    field_steps
        How the coefficients and attributes of distance fields change (`FieldSteps`); None: its defaults.
    field_edges
        What estimates how outlines of distance fields change the pictures, as for `edgegrad.render_backward`.
    step_sizes
        Maps a parameter path to the length of its first step. Vertices: the largest displacement of a vertex, as a
        fraction of the diagonal of the mesh's bounding box. Coefficients of fields: the largest change, in cells, up to
        0.5. Positions: a fraction of the diagonal of the scene's bounding box. Directions: radians. Poses: a rotation
        in radians, and a translation of the same number of diagonals (of the mesh or the field's box; for cameras and
        lights, of the scene). Other parameters: the unit of the parameter. Defaults are 0.02 for vertices, positions,
        directions and poses; 0.25 for fields; 0.03 for colours and weights; 3 % of the value for powers, radiances and
        sizes. Later steps follow the gradient and become shorter towards the end.
    views_per_iteration
        Number of pictures that each iteration renders; successive iterations cycle through all pictures. None: all.
    seed
        Seed of the random numbers. Equal seeds give equal results, for any number of threads.
    threads, engine
        As for `edgegrad.Renderer`.
    on_cancel
        State of the scene after a cancelled fit: "restore" leaves it unchanged, "best" writes the best values so
        far.
    callback
        Called with a `FitStep` after each iteration. If it returns False or raises `Cancelled`, the fit stops and
        `on_cancel` applies. If it returns "restore" or "best", the fit stops and the returned word applies.
    progress
        Called with the completed fraction of the fit several times per iteration. If it raises `Cancelled`, the
        fit stops and `on_cancel` applies.
    driven
        Variables outside of the scene that move its parameters (`edgegrad.fitting.driven`); they are fitted together
        with `wrt`, which may then be empty, and which must not have a parameter that they move.
    film
        The frames of the targets, and the parameters with a value in each frame (`Film`). `iterations` are then the
        steps of the first frame; frames that start from their neighbours make fewer.
    checkpoint
        A file (.npz) that keeps the state of the fit; it is replaced as a whole, after every `checkpoint_every`
        iterations and at the end. None: none is written.
    checkpoint_every
        Number of iterations between checkpoints.
    resume
        Whether to go on from `checkpoint`, if there is such a file. Scene, targets and options must be those with which
        the fit began; the result then has the same bits as that of a fit without an interruption.
    uncertainty
        Whether to measure how well the pictures determine the result (`FitResult.uncertainty`). For each target, this
        renders two pictures, and two derivatives by each number of colours, values and poses. Films have none.
    search
        Number of coarse pictures of random poses, positions and directions (and of driven numbers), from the best of
        which the fit begins if they are much closer to the targets. None: enough of them if no small move of the start
        brings the pictures closer, as for an object that is out of view; 0: none.
    restarts
        Number of other starts from the search that are fitted for a quarter of the iterations each, besides the
        scene's own. The fit then goes on from the best.

    Returns
    -------
    The result. Every value is within its range, directions have their initial lengths, and poses differ from the
    initial ones by rigid motions.

    Raises
    ------
    ValueError
        For a wrong scene, target, path or option, before anything is rendered; names it. Also for a checkpoint that is
        damaged or belongs to another fit.
    OSError
        If no checkpoint can be written at its path.
    FloatingPointError
        If a gradient or loss is not finite; names the parameter or target.

    Warns
    -----
    RuntimeWarning
        If no picture depends on a parameter; names the parameter and the likely reason. Also if a checkpoint can't be
        written while the fit runs.
    """
    started = time.monotonic()
    validated(scene)
    work = copied(scene)
    narrow = engine_class(engine).narrow
    paths = _checked_paths(work, wrt, narrow, driven is not None or film is not None)
    seen = views(work, targets, engine)
    own_frames = None
    if film is not None:
        check_film(film, work, seen, paths, driven)
        if film.keyed:
            _checked_paths(work, film.keyed, narrow, False)
            own_frames = KeyedParameters(work, film)
        driven = own_frames if driven is None else driven
    placement = moving = None
    if driven is not None:
        seen = [replace(view, camera=replace(view.camera)) for view in seen]  # their cameras may be moved
        placement = driven.place({item.path: item.value for item in driven.variables})
        moving = _checked_placement(placement, paths)
    iterations = whole("fit", "iterations", iterations, 1, 1_000_000)
    spp = whole("fit", "spp", spp, 1, 1 << 24)
    samples = spp if gradient_spp is None else whole("fit", "gradient_spp", gradient_spp, 1, 1 << 24)
    max_depth = whole("fit", "max_depth", max_depth, 1, MAX_DERIVATIVE_DEPTH if narrow else MAX_DEPTH)
    bounces = checked_bounces("fit", bounces)
    per_iteration = views_per_iteration
    if per_iteration is not None:
        per_iteration = whole("fit", "views_per_iteration", per_iteration, 1, len(seen))
    seed = whole("fit", "seed", seed, 0, 0xFFFFFFFF)
    schedule: Schedule = Cycle(len(seen), per_iteration or len(seen), iterations, seed)
    keyed = None
    if film is not None:
        schedule = FilmSchedule(film.of_views, film.first_every, iterations, per_iteration, seed)
        numbers = [] if driven is None else [one for one in driven.variables if isinstance(one, KeyedNumbers)]
        keyed = KeyedFrames(numbers, film.times, film.of_views, film.smoothness)
    choice("fit", "on_cancel", on_cancel, ON_CANCEL)
    uncertain = flag("fit", "uncertainty", uncertainty) and film is None
    threads = whole("fit", "threads", threads, 0, MOST_THREADS)
    callback, progress = optional(function)("fit", "callback", callback), checked_progress("fit", progress)
    loss = Pyramid() if loss is None else function("fit", "loss", loss)
    if smoothness is not None:
        smoothness = number("fit", "smoothness", smoothness, least=0.0, greatest=MOST_SMOOTHNESS)
    if slide is not None:
        slide = number("fit", "slide", slide, least=0.0, greatest=1.0)
    if field_steps is not None:
        instance("fit", "field_steps", field_steps, FieldSteps)
    field_edges = checked_field_edges(field_edges)
    steps = _checked_steps(paths, step_sizes)
    rules = checked_rules(paths, vertex_rules)
    search = None if search is None else whole("fit", "search", search, 0, 1_000_000)
    restarts = whole("fit", "restarts", restarts, 0, 100)
    if film is not None and (search or restarts):
        raise ValueError("fit: search and restarts are not for films; find the first frame's pose by a fit of its own")

    def made(schedule: Schedule) -> list[Unknown]:
        unknowns = [unknown(work, path, steps.get(path), smoothness, slide, schedule.iterations, field_steps,
                            rules.get(path)) for path in paths]  # fmt: skip
        for item in unknowns:
            if isinstance(item, Vertices):
                parameters.put(work, item.path, item.value)  # which symmetry may have changed
        return unknowns

    first = made(schedule)  # checks options of single variables before anything is rendered
    # No other code can change the copy
    requested = [*paths, *(moving or ())]
    renderer = Renderer(work, threads=threads, engine=engine, learn=True, wrt=requested, watched=False)
    of = [view.objects for view in seen if view.objects is not None]
    silhouettes = Silhouettes(work, of, requested, threads, engine) if of else None
    resume = flag("fit", "resume", resume)
    checkpoints = None
    if checkpoint is not None:
        check_checkpoint(checkpoint)
        every = whole("fit", "checkpoint_every", checkpoint_every, 1, 1_000_000)
        options = {"wrt": paths, "iterations": iterations, "spp": spp, "gradient_spp": samples, "max_depth": max_depth,
                   "bounces": bounces, "smoothness": smoothness, "slide": slide, "field_steps": field_steps,
                   "field_edges": field_edges,
                   "step_sizes": steps, "vertex_rules": fingerprint.digest(rules),
                   "views_per_iteration": per_iteration or len(seen), "seed": seed, "film": film, "search": search,
                   "restarts": restarts}  # fmt: skip
        checkpoints = Checkpoints(
            Path(checkpoint), every,
            fingerprint.of_scene(work) | fingerprint.of_views(seen) | {"the loss": fingerprint.digest(loss)}
            | fingerprint.of_driven(driven) | fingerprint.of_placement(placement),
            {name: str(value) for name, value in options.items()},
            renderer.kernels,
        )
    elif resume:
        raise ValueError("fit: resume needs a checkpoint; name its file")

    def run_of(schedule: Schedule, progress: Progress | None, unknowns: list[Unknown] | None = None) -> Run:
        """Make a run from the present values of the scene."""
        return Run(
            work, renderer, seen, made(schedule) if unknowns is None else unknowns, loss,
            schedule=schedule, spp=spp, gradient_spp=samples,
            limits={"max_depth": max_depth, "bounces": bounces}, seed=seed, started=started, progress=progress,
            driven=driven, placement=placement, silhouettes=silhouettes, keyed=keyed, field_edges=field_edges,
        )

    stages = Stages(progress, MEASURED if uncertain else 0.0)
    run = run_of(schedule, stages.rest() if film is not None else None, first)
    begun: list[str] = []
    known: tuple[Uncertainty, ...] = ()
    exchanges: tuple[Exchange, ...] = ()
    stop = None
    try:
        choose_symmetric_start(run)
        if film is None:
            run, begun = begin(run, run_of, stages, search=search, restarts=restarts,
                               per_iteration=per_iteration or len(seen))
        if checkpoints is not None:
            checkpoints.attach(run, resume)
        stop = run.iterate(callback)
        if stop is None:
            run.measure_end()
            if uncertain:
                known, exchanges = measured_uncertainty(run, run.best_values, stages.part(MEASURED))
    except Cancelled:
        stop = on_cancel
    stop = on_cancel if stop == "callback" else stop
    cameras = [view.camera for view in seen]
    parts = [untouched_part(work, cameras, path, run.touched[path]) for path in paths]
    kept = run.start if stop == "restore" else run.best_values
    if stop != "restore":
        for path in paths:
            parameters.put(scene, path, kept[path])
        if driven is not None:
            for path in run.place({item.path: kept[item.path] for item in driven.variables}):
                parameters.put(scene, path, parameters.get(work, path))
    variables = [*run.unknowns, *run.variables]
    found = findings(run.touched, kept, variables)
    if own_frames is not None:
        kept = kept | {item.path: own_frames.values(item.path, kept[item.path]) for item in own_frames.variables}
    return FitResult(
        {path: np.copy(value) if np.ndim(value) else value for path, value in kept.items()},
        run.losses, run.best, time.monotonic() - run.started, stop is not None,
        {path: float(np.mean(~touched)) for path, touched in run.touched.items()},
        (*(() if checkpoints is None else checkpoints.notes),
         *begun,
         *(f"not computed: {sentence}" for sentence in run.missing),
         *open_depths(variables, cameras),
         *(part for part in parts if part is not None)),
        run.first_gradient,
        tuple(np.copy(gain) for gain in run.best_gains),
        found,
        known,
        exchanges,
    )


def _checked_placement(placement: Placement, paths: list[str]) -> list[str]:
    """Return all parameters of the scene that driven variables move; none of them may be fitted by itself."""
    found = list(dict.fromkeys(path for of_view in placement.paths for path in of_view))
    own = {path for of_view in placement.own for path in of_view}
    for path in paths:
        if path in own and path not in found:
            raise ValueError(f"fit: '{path}' differs from frame to frame, so it can't have one fitted value; "
                             "key it, or leave it out")
        if path in placement.parameters or path in found:
            raise ValueError(f"fit: '{path}' is fitted by itself and moved by driven variables; leave one of them out")
    return found


def _checked_paths(work: Scene, wrt: Sequence[str], narrow: bool, may_be_empty: bool) -> list[str]:
    paths = list(names("fit", "wrt", wrt, "parameter paths"))
    if not paths and may_be_empty:
        return []
    if not paths:
        raise ValueError("fit: wrt is empty; name at least one parameter path")
    for path, count in Counter(paths).items():
        if count > 1:
            raise ValueError(f"fit: wrt names '{path}' more than once")
    requested_tables(work, with_requested(work, flatten(work), paths), paths)  # raises for paths without derivatives
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


def copied(scene: Scene) -> Scene:
    """Copy the objects of a scene. The arrays are shared: `parameters.put` replaces arrays and never writes to them."""
    return Scene(
        replace(scene.camera),
        {name: replace(mesh) for name, mesh in scene.meshes.items()},
        {name: replace(material) for name, material in scene.materials.items()},
        {name: replace(light) for name, light in scene.lights.items()},
        replace(scene.world),
        {name: replace(image) for name, image in scene.images.items()},
        {name: replace(one) for name, one in scene.fields.items()},
    )

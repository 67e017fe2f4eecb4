"""`edgegrad.fit`: gradient-based fitting of scene parameters to pictures.

`options` and `preparation` check the arguments and make one variable for each parameter (`variables`) and one view for
each target (`targets`). This module runs the loop (`run`) on a copy of the scene and writes the best values back.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..rendering.options import Progress
from ..rendering.renderer import Cancelled
from ..scene import parameters
from ..scene.bounces import Bounces
from ..scene.scene import Scene
from .driven import Driven
from .fields.schedule import FieldSteps
from .film.film import Film
from .fit_step import Callback
from .losses import Loss, Pyramid
from .options import FitOptions
from .outcome.findings import findings, open_depths
from .outcome.newton_steps import arrived
from .outcome.result import FitResult
from .outcome.uncertainty import MEASURED, Exchange, Uncertainty
from .outcome.uncertainty import uncertainty as measured_uncertainty
from .outcome.zero_gradients import untouched_part
from .preparation import Preparation
from .run import Run
from .search.begin import begin, choose_symmetric_start
from .stages import Stages
from .targets import Targets
from .vertices.rules import VertexRules


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
        renders two pictures, and two derivatives by each number of colours, values and poses. If the result has not
        arrived where this measurement says, up to six Newton steps go there, with at most twice the work of the
        iterations. Films have none.
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
    options = FitOptions(
        iterations=iterations, spp=spp, gradient_spp=spp if gradient_spp is None else gradient_spp, max_depth=max_depth,
        bounces=bounces, loss=Pyramid() if loss is None else loss, smoothness=smoothness, slide=slide,
        field_steps=field_steps, field_edges=field_edges, views_per_iteration=views_per_iteration, seed=seed,
        threads=threads, on_cancel=on_cancel, callback=callback, progress=progress, checkpoint=checkpoint,
        checkpoint_every=checkpoint_every, resume=resume, uncertainty=uncertainty, search=search, restarts=restarts,
    )  # fmt: skip
    prepared = Preparation(scene, targets, wrt, options, engine=engine, vertex_rules=vertex_rules,
                           step_sizes=step_sizes, driven=driven, film=film, started=started)  # fmt: skip
    checkpoints = prepared.checkpoints()
    uncertain = options.uncertainty and film is None
    stages = Stages(options.progress, MEASURED if uncertain else 0.0)
    run = prepared.run(prepared.schedule, None if film is None else stages.rest(), prepared.first)
    begun: list[str] = []
    known: tuple[Uncertainty, ...] = ()
    exchanges: tuple[Exchange, ...] = ()
    try:
        choose_symmetric_start(run)
        if film is None:
            run, begun = begin(run, prepared.run, stages, search=options.search, restarts=options.restarts,
                               per_iteration=prepared.per_iteration)  # fmt: skip
        if checkpoints is not None:
            checkpoints.attach(run, options.resume)
        stop = run.iterate(options.callback)
        if stop is None:
            run.measure_end()
            if uncertain:
                measured = arrived(run, stages.part(0.7 * MEASURED))
                known, exchanges = measured_uncertainty(run, measured, stages.part(0.3 * MEASURED))
    except Cancelled:
        stop = options.on_cancel
    stop = options.on_cancel if stop == "callback" else stop
    kept = run.start if stop == "restore" else run.history.best_values
    if stop != "restore":
        _write_to(scene, prepared, run, kept)
    variables = [*run.unknowns, *run.variables]
    cameras = [view.camera for view in prepared.seen]
    untouched = [untouched_part(prepared.work, cameras, path, run.touched[path]) for path in prepared.paths]
    notes = (
        *(() if checkpoints is None else checkpoints.notes),
        *begun,
        *run.notes,
        *(f"not computed: {sentence}" for sentence in run.missing),
        *open_depths(variables, cameras),
        *(sentence for sentence in untouched if sentence is not None),
    )
    values = kept
    if (keyed := prepared.own_frames) is not None:
        values = kept | {item.path: keyed.values(item.path, kept[item.path]) for item in keyed.variables}
    return FitResult(
        values={path: np.copy(value) if np.ndim(value) else value for path, value in values.items()},
        losses=run.history.losses,
        best=run.history.best,
        seconds=time.monotonic() - started,
        cancelled=stop is not None,
        untouched={path: float(np.mean(~touched)) for path, touched in run.touched.items()},
        notes=notes,
        first_gradient=run.first_gradient,
        gains=tuple(np.copy(gain) for gain in run.history.best_gains),
        findings=findings(run.touched, kept, variables),
        uncertainty=known,
        exchanges=exchanges,
    )


def _write_to(scene: Scene, prepared: Preparation, run: Run, values: Mapping[str, Any]) -> None:
    """Put fitted values into the user's scene, and whatever driven variables move with them."""
    for path in prepared.paths:
        parameters.put(scene, path, values[path])
    for path in run.place({item.path: values[item.path] for item in run.variables}) if run.driven is not None else ():
        parameters.put(scene, path, parameters.get(prepared.work, path))

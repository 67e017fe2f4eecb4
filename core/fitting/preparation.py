"""What the runs of one fit share: a copy of the scene, its parameters and views, checked, and their renderer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from .._check import mapping, names, number
from ..derivatives.table_derivatives import ParameterMap, with_requested
from ..reference import diffuse_tables
from ..rendering.engine import engine_class
from ..rendering.options import Progress
from ..rendering.renderer import MAX_DERIVATIVE_DEPTH, Renderer
from ..scene import parameters
from ..scene.bounces import MAX_DEPTH
from ..scene.scene import Scene, validated
from ..tables.tables import flatten
from .checkpoints import fingerprint
from .checkpoints.checkpoints import Checkpoints
from .driven import Driven, Placement
from .film.checked_film import check_film
from .film.film import Film
from .film.film_schedule import FilmSchedule
from .film.keyed import KeyedFrames, KeyedNumbers
from .film.keyed_parameters import KeyedParameters
from .options import FitOptions
from .run import Run
from .schedule import Cycle, Schedule
from .silhouettes import Silhouettes
from .targets import Targets, views
from .variables import Unknown, unknown
from .vertices.rules import VertexRules, checked_rules
from .vertices.variables import Vertices


class Preparation:
    """One fit before its first iteration.

    Attributes
    ----------
    work
        The copy of the scene that the fit changes.
    paths
        The parameters of the scene that are fitted.
    seen
        The target pictures with their cameras.
    own_frames
        The scene's parameters with a value in each frame of a film; None: there are none.
    schedule
        Which pictures each iteration renders.
    first
        The variables of the parameters, at their start.
    """

    def __init__(
        self, scene: Scene, targets: Targets, wrt: Sequence[str], options: FitOptions, *, engine: str,
        vertex_rules: Mapping[str, VertexRules] | None, step_sizes: Mapping[str, float] | None,
        driven: Driven | None, film: Film | None, started: float,
    ) -> None:  # fmt: skip
        validated(scene)
        self.work = work = copied(scene)
        self.options, self._film, self._started = options, film, started
        narrow = engine_class(engine).narrow
        self.paths = _checked_paths(work, wrt, narrow, driven is not None or film is not None)
        self.seen = views(work, targets, engine)
        self.own_frames = None
        if film is not None:
            check_film(film, work, self.seen, self.paths, driven)
            if film.keyed:
                _checked_paths(work, film.keyed, narrow, False)
                self.own_frames = KeyedParameters(work, film)
            driven = self.own_frames if driven is None else driven
        self._driven, self._placement, moving = driven, None, []
        if driven is not None:
            self.seen = [replace(view, camera=replace(view.camera)) for view in self.seen]  # may be moved
            self._placement = driven.place({item.path: item.value for item in driven.variables})
            moving = _checked_placement(self._placement, self.paths)
        options.check_for(len(self.seen), MAX_DERIVATIVE_DEPTH if narrow else MAX_DEPTH, film is not None)
        self._steps = _checked_steps(self.paths, step_sizes)
        self._rules = checked_rules(self.paths, vertex_rules)
        self.schedule, self._keyed = self._schedule()
        self.first = self.unknowns(self.schedule)  # checks options of single variables before anything is rendered
        requested = [*self.paths, *moving]
        # No other code can change the copy
        self.renderer = Renderer(work, threads=options.threads, engine=engine, learn=True, wrt=requested, watched=False)
        of = [view.objects for view in self.seen if view.objects is not None]
        self._silhouettes = Silhouettes(work, of, requested, options.threads, engine) if of else None

    @property
    def per_iteration(self) -> int:
        """Number of pictures that each iteration renders, where all take turns."""
        return self.options.views_per_iteration or len(self.seen)

    def _schedule(self) -> tuple[Schedule, KeyedFrames | None]:
        options, film, driven = self.options, self._film, self._driven
        if film is None:
            return Cycle(len(self.seen), self.per_iteration, options.iterations, options.seed), None
        numbers = [] if driven is None else [one for one in driven.variables if isinstance(one, KeyedNumbers)]
        schedule = FilmSchedule(film.of_views, film.first_every, options.iterations, options.views_per_iteration,
                                options.seed)  # fmt: skip
        return schedule, KeyedFrames(numbers, film.times, film.of_views, film.smoothness)

    def unknowns(self, schedule: Schedule) -> list[Unknown]:
        """Make the variables of the scene's parameters, from its present values."""
        options, work = self.options, self.work
        made = [unknown(work, path, self._steps.get(path), options.smoothness, options.slide, schedule.iterations,
                        options.field_steps, self._rules.get(path)) for path in self.paths]  # fmt: skip
        for item in made:
            if isinstance(item, Vertices):
                parameters.put(work, item.path, item.value)  # which symmetry may have changed
        return made

    def run(self, schedule: Schedule, progress: Progress | None, unknowns: list[Unknown] | None = None) -> Run:
        """Make a run that begins with the present values of the scene."""
        options = self.options
        return Run(
            self.work, self.renderer, self.seen, self.unknowns(schedule) if unknowns is None else unknowns,
            options.loss, schedule=schedule, spp=options.spp, gradient_spp=options.gradient_spp,
            limits={"max_depth": options.max_depth, "bounces": options.bounces}, seed=options.seed,
            started=self._started, progress=progress, driven=self._driven, placement=self._placement,
            silhouettes=self._silhouettes, keyed=self._keyed, field_edges=options.field_edges,
        )  # fmt: skip

    def checkpoints(self) -> Checkpoints | None:
        """Return what stores the fit's state in its file, if one is named."""
        o = self.options
        if o.checkpoint is None:
            return None
        told = {"wrt": self.paths, "iterations": o.iterations, "spp": o.spp, "gradient_spp": o.gradient_spp,
                "max_depth": o.max_depth, "bounces": o.bounces, "smoothness": o.smoothness, "slide": o.slide,
                "field_steps": o.field_steps, "field_edges": o.field_edges, "step_sizes": self._steps,
                "vertex_rules": fingerprint.digest(self._rules), "views_per_iteration": self.per_iteration,
                "seed": o.seed, "film": self._film, "search": o.search, "restarts": o.restarts}  # fmt: skip
        return Checkpoints(
            Path(o.checkpoint), o.checkpoint_every,
            fingerprint.of_scene(self.work) | fingerprint.of_views(self.seen)
            | {"the loss": fingerprint.digest(o.loss)}
            | fingerprint.of_driven(self._driven) | fingerprint.of_placement(self._placement),
            {name: str(value) for name, value in told.items()},
            self.renderer.kernels,
        )  # fmt: skip


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
    ParameterMap(work, with_requested(work, flatten(work), paths), paths)  # raises for paths without derivatives
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

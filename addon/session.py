"""One fit of Blender's data in three steps: `prepare` reads them, `run` does not access them, `write` changes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from pathlib import Path
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad.fitting.outcome.findings import OPEN
from edgegrad.scene import parameters as values

from . import parameters
from .animated.driver import Driver, control_variable
from .animated.film_driver import FilmDriver, Shot, frames_kept
from .animated.parameter import Wanted
from .animated.relay import Relay
from .animated.stored import remember_sensitivities
from .differentiable import export_differentiable, let_normals_follow, not_computed
from .export import Export
from .field_fit import FieldRequest, Replacement, replace_by_field
from .preferences import threads
from .problem import Problem
from .targets.film import FrameRange, frame_of
from .targets.pictures import Picture, gain_note, read_picture
from .vertex_options import VertexOptions
from .write_back import kept
from .write_back.destinations import Destination, PropertyValue, VerticesOf
from .write_back.keys import KeysOf


@dataclass
class Request:
    """Parameters and options of a fit.

    Attributes
    ----------
    pictures, names
        The targets, and the parameters to fit.
    iterations, samples, seed
        Number of steps, samples per pixel of each step, and seed; equal seeds give equal results.
    smoothness
        Preconditioning of vertices (`edgegrad.fit`); None: chosen from the number of vertices.
    vertex_step
        Largest displacement of a vertex in the first step, as a fraction of the object's size; None: the default.
    slide
        Factor in [0, 1] for the tangential motion of vertices (`edgegrad.fit`); None: the default.
    views_per_iteration
        Number of pictures per step, cycling through all; None: all.
    in_place
        Whether to write vertices into the mesh itself, instead of a new shape key.
    animated
        Animatable properties to fit.
    loss
        Name of the loss (`edgegrad.losses.named`).
    field
        An object to fit as a distance field; None: there is none.
    film
        The frames of a film; None: the targets show the current frame.
    vertex_options
        By object: what its vertices may do.
    search, restarts
        Coarse pictures of a search for a start (None: if no gradient leads away from it), and number of other starts
        that are fitted for a while (`edgegrad.fit`).
    uncertainty
        Whether to measure how well the pictures determine the result.
    """

    pictures: list[Picture]
    names: parameters.Names
    iterations: int = 200
    samples: int = 16
    seed: int = 0
    smoothness: float | None = None
    vertex_step: float | None = None
    slide: float | None = None
    views_per_iteration: int | None = None
    in_place: bool = False
    animated: tuple[Wanted, ...] = ()
    loss: str = "pyramid"
    field: FieldRequest | None = None
    film: FrameRange | None = None
    vertex_options: Mapping[str, VertexOptions] = dataclass_field(default_factory=dict)
    search: int | None = None
    restarts: int = 0
    uncertainty: bool = True


@dataclass
class Session:
    """A prepared fit. `run` may be called in another thread, since it does not access Blender's data.

    Attributes
    ----------
    notes
        Sentences on how targets were read, sentences that name terms of the derivative which are not computed although
        they may be non-zero (`edgegrad.plan`), and properties that were left out.
    before, destinations
        By parameter: its value at the beginning, and where its result goes.
    driver, relay
        Owner of the animatable properties, and the same for a fit in another thread; None: there are none.
    unwritten
        After `write`: a sentence on each value that could not be written.
    gain_notes
        After the fit: sentences on the exposure and white balance that it has found.
    findings
        After the fit: sentences on properties about which the pictures say nothing, on limits that hold values, and on
        how well the pictures determine the others.
    threads
        Number of threads of the fit; 0: one per core.
    field
        The field that replaces an object in the exported scene; None: there is none.
    rules
        What the vertices of a parameter may do.
    """

    request: Request
    export: Export
    targets: list[edgegrad.Target]
    wrt: list[str]
    notes: list[str] = dataclass_field(default_factory=list)
    before: dict[str, Any] = dataclass_field(default_factory=dict)
    destinations: dict[str, Destination] = dataclass_field(default_factory=dict)
    driver: Driver | None = None
    relay: Relay | None = None
    unwritten: list[str] = dataclass_field(default_factory=list)
    gain_notes: list[str] = dataclass_field(default_factory=list)
    findings: list[str] = dataclass_field(default_factory=list)
    threads: int = 0
    field: Replacement | None = None
    rules: dict[str, edgegrad.VertexRules] = dataclass_field(default_factory=dict)

    @classmethod
    def prepare(cls, context: Any, request: Request) -> Session:
        """Read Blender's data and the target files, without a change.

        Raises
        ------
        Problem, ValueError
            For wrong data; the message is one sentence that names the object.
        """
        scene = context.scene
        if not request.pictures:
            raise Problem("there is no target; add a camera and its target picture")
        if request.film is not None:
            request = replace(request, pictures=request.film.pictures(request.pictures, scene.frame_current))
        for number, picture in enumerate(request.pictures, 1):
            if not picture.camera:
                raise Problem(f"target {number}: has no camera; choose one")
        cameras = [find_camera(scene, picture.camera) for picture in request.pictures]
        film = request.film is not None
        names, controls = request.names.with_controls(scene, request.in_place, bool(request.animated) or film)
        if film and (controls or request.field is not None):
            named = controls[0] if request.field is None else request.field.object
            raise Problem(f"object '{named}': its shape can't be fitted to a film; fit it to one picture, then "
                          "its motion to the film")  # fmt: skip
        if request.field is not None and (request.animated or controls):
            raise Problem(f"object '{request.field.object}': can't be fitted as a field together with animatable "
                          "properties or with vertices below modifiers; fit them one after the other")
        with frames_kept(scene):
            if request.film is not None:  # the frame that all others are compared with
                scene.frame_set(min(frame_of(one) for one in request.pictures))
            export = export_differentiable(scene, cameras)
        replaced = None if request.field is None else replace_by_field(scene, export, request.field)
        driver: Driver | None = None
        if film:
            distinct = list(dict.fromkeys(cameras))
            driver = FilmDriver(scene, distinct, request.animated,
                                [Shot(frame_of(one), distinct.index(camera))
                                 for one, camera in zip(request.pictures, cameras, strict=True)])  # fmt: skip
        elif request.animated or controls:
            driver = Driver(scene, cameras, request.animated, controls, lambda control: control_variable(
                control, request.vertex_step, request.smoothness,
                _options(request, control.object).rules(control.object, np.eye(4))))  # fmt: skip
        for name in () if driver is None else driver.without_normals:
            export.scene.meshes[name].normals = None
        wrt = names.paths(export, may_be_empty=driver is not None or replaced is not None)
        targets, notes = list[edgegrad.Target](), let_normals_follow(export, wrt)
        if replaced is not None:
            wrt += [replaced.path, *replaced.attributes]
            notes += replaced.notes
        for picture, camera, view in zip(request.pictures, cameras, export.views, strict=True):
            target, found = read_picture(scene, picture, camera, view, export)
            targets.append(target)
            notes += found
        export.scene.validate()
        before = {path: np.array(values.get(export.scene, path), np.float64) for path in wrt}
        places: dict[str, Destination] = {} if replaced is None else {replaced.path: replaced}
        of_field = () if replaced is None else replaced.attributes  # the new object has them
        places |= {path: parameters.destination(export, path, request.in_place) for path in wrt
                   if path not in places and path not in of_field}  # fmt: skip
        if driver is not None:
            before |= {one.path: one.value.copy() for one in driver.variables}
            before |= {one.path: one.read() for one in driver.controls}
            places |= {one.path: KeysOf(one, tuple(driver.times)) if isinstance(driver, FilmDriver) and one.keyed
                       else PropertyValue(one) for one in driver.parameters}  # fmt: skip
            places |= {one.path: VerticesOf.of(one.object, np.eye(4), request.in_place) for one in driver.controls}
        rules: dict[str, edgegrad.VertexRules] = {}
        for path in wrt:
            place = places.get(path)
            if isinstance(place, VerticesOf):
                ob = place.object.get()
                one = _options(request, ob).rules(ob, place.matrix)
                rules |= {} if one is None else {path: one}
        notes += [*not_computed(export, wrt), *([] if driver is None else driver.notes)]
        relay = None if driver is None else Relay(driver)
        return cls(request, export, targets, wrt, notes, before, places, driver, relay, threads=threads(),
                   field=replaced, rules=rules)

    @property
    def late_notes(self) -> list[str]:
        """Notes on what could not be written, and those made while the fit ran: on properties and gains."""
        made = [] if self.driver is None else [note for note in self.driver.notes if note not in self.notes]
        return [*self.unwritten, *made, *self.gain_notes, *self.findings]

    def serve(self, seconds: float = 0.0) -> None:
        """Evaluate Blender for a fit in another thread that waits for it, as `Relay.serve`."""
        if self.relay is not None:
            self.relay.serve(seconds)

    def run(
        self,
        callback: Callable[[edgegrad.FitStep], bool | str | None] | None = None,
        progress: Callable[[float], None] | None = None,
        on_cancel: str = "restore",
        checkpoint: Path | None = None,
        checkpoint_every: int = 25,
        resume: bool = False,
    ) -> edgegrad.FitResult:
        """Run `edgegrad.fit` on the exported scene; Blender's data stay unchanged. All arguments are those of it."""
        steps = {path: self.request.vertex_step for path in self.wrt
                 if path.endswith(".vertices") and self.request.vertex_step is not None}  # fmt: skip
        result = edgegrad.fit(
            self.export.scene,
            self.targets,
            wrt=self.wrt,
            iterations=self.request.iterations,
            spp=self.request.samples,
            max_depth=self.export.settings.max_depth,
            bounces=self.export.settings.bounces,
            loss=edgegrad.losses.named(self.request.loss),
            seed=self.request.seed,
            threads=self.threads,
            smoothness=self.request.smoothness,
            slide=self.request.slide,
            vertex_rules=self.rules,
            field_steps=None if self.field is None else self.field.steps,
            step_sizes=steps,
            views_per_iteration=self.request.views_per_iteration,
            on_cancel=on_cancel,
            callback=self._callback(callback),
            progress=progress,
            driven=self.relay,
            film=None if self.request.film is None else edgegrad.Film(
                [frame_of(one) for one in self.request.pictures], (), self.request.film.smoothness,
                self.request.film.first_every),
            checkpoint=checkpoint,
            checkpoint_every=checkpoint_every,
            resume=resume,
            search=self.request.search,
            restarts=self.request.restarts,
            uncertainty=self.request.uncertainty,
        )
        self.gain_notes = [gain_note(picture, gain)
                           for picture, gain in zip(self.request.pictures, result.gains, strict=True)
                           if isinstance(picture.gain, str)]  # fmt: skip
        # The engine's own parameters without a gradient are in the result's notes, with the reason.
        self.findings = [str(one) for one in result.findings if one.kind != OPEN or one.path not in self.wrt]
        self.findings += [str(one) for one in (*result.uncertainty, *result.exchanges)]
        return result

    def _callback(
        self, callback: Callable[[edgegrad.FitStep], bool | str | None] | None
    ) -> Callable[[edgegrad.FitStep], bool | str | None] | None:
        """Return the callback that tells the field of each step, too."""
        replaced = self.field
        if replaced is None:
            return callback

        def tell(step: edgegrad.FitStep) -> bool | str | None:
            replaced.tell(step)
            return None if callback is None else callback(step)

        return tell

    def scene_of(self, values: Mapping[str, Any], view: int) -> edgegrad.Scene:
        """Return the exported scene; of a film, as a target shows it with some values of the driven variables."""
        if isinstance(self.driver, FilmDriver):
            own = {one.path: np.asarray(values[one.path]) for one in self.driver.variables}
            return self.driver.export_frame(own, view).scene
        return self.export.scene

    def write(self, result: edgegrad.FitResult) -> bool:
        """Write a result into Blender's data; return whether anything was written.

        Whether each value can be written is checked first. Those that can't are kept in the text block
        `write_back.kept.TEXT`, and `unwritten` says why.
        """
        changed = [one for one in self._results(result) if not np.array_equal(one[1], one[2])]
        refused: dict[int, str] = {}
        for k, (place, _, _) in enumerate(changed):
            try:
                place.check()
            except Problem as problem:
                refused[k] = str(problem)
        for k, (place, before, after) in enumerate(changed):
            if k not in refused:
                try:
                    place.write(before, after)
                except (Problem, RuntimeError) as error:
                    refused[k] = str(error)
        kept.keep([place.entry(before, after) for k, (place, before, after) in enumerate(changed) if k in refused])
        self.unwritten = [f"{reason}; its result is kept in the text '{kept.TEXT}', from which 'Write Kept Result' "
                          "writes it" for reason in refused.values()]  # fmt: skip
        if self.driver is not None:
            remember_sensitivities(self.driver.scene, self.driver.sensitivities(result.first_gradient))
        bpy.context.view_layer.update()
        return len(refused) < len(changed)

    def _results(self, result: edgegrad.FitResult) -> Iterator[tuple[Destination, Any, Any]]:
        """Yield the destination of each parameter, and its values before and after the fit."""
        if self.field is not None:
            self.field.take(result.values)
        for path, place in self.destinations.items():
            yield place, self.before[path], result.values[path]


def _options(request: Request, ob: Any) -> VertexOptions:
    return request.vertex_options.get(ob.name, VertexOptions())


def find_camera(scene: Any, name: str) -> Any:
    """Return the camera object of this name in the scene.

    Raises
    ------
    Problem
        If there is none.
    """
    ob = scene.objects.get(name)
    if ob is None or ob.type != "CAMERA":
        known = ", ".join(f"'{known.name}'" for known in scene.objects if known.type == "CAMERA") or "none"
        raise Problem(f"camera '{name}': there is no such camera in scene '{scene.name}' (known: {known})")
    return ob

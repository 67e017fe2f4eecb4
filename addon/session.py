"""One fit of Blender's data in three steps: `prepare` reads them, `run` does not access them, `write` changes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import images
from edgegrad.scene import parameters as values

from . import parameters
from .animated.driver import Driver, control_variable
from .animated.parameter import Wanted
from .animated.relay import Relay
from .animated.stored import remember_sensitivities
from .differentiable import export_differentiable, not_computed
from .export import Export
from .problem import Problem
from .view_transforms import AUTO, view_of
from .write_back import kept
from .write_back.destinations import Destination, PropertyValue, VerticesOf


@dataclass
class Picture:
    """A target.

    Attributes
    ----------
    camera, image
        Name of the camera, and file of the picture.
    mask
        File of the mask, whose black pixels are ignored; empty: none.
    view
        View transform that is undone in the picture (`view_transforms.view_of`).
    """

    camera: str
    image: str
    mask: str = ""
    view: str = AUTO


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
    """

    request: Request
    export: Export
    targets: list[edgegrad.Target]
    wrt: list[str]
    notes: list[str] = field(default_factory=list)
    before: dict[str, Any] = field(default_factory=dict)
    destinations: dict[str, Destination] = field(default_factory=dict)
    driver: Driver | None = None
    relay: Relay | None = None
    unwritten: list[str] = field(default_factory=list)

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
        for number, picture in enumerate(request.pictures, 1):
            if not picture.camera:
                raise Problem(f"target {number}: has no camera; choose one")
        cameras = [find_camera(scene, picture.camera) for picture in request.pictures]
        names, controls = request.names.with_controls(scene, request.in_place, bool(request.animated))
        export = export_differentiable(scene, cameras)
        driver = None
        if request.animated or controls:
            driver = Driver(scene, cameras, request.animated, controls, lambda control: control_variable(
                control, request.vertex_step, request.smoothness))  # fmt: skip
            for name in driver.without_normals:
                export.scene.meshes[name].normals = None
        wrt = names.paths(export, may_be_empty=driver is not None)
        targets, notes = [], []
        for picture, camera, view in zip(request.pictures, cameras, export.views, strict=True):
            if not picture.image.strip():
                raise Problem(f"target of camera '{camera.name}': has no picture; choose one")
            transform, note = view_of(scene, absolute(picture.image), picture.view)
            notes += [note] if note else []
            found = images.read_target(absolute(picture.image), transform)
            _check_size(picture.image, found.image, view, camera.name)
            mask = found.weight
            if picture.mask:
                chosen = images.read_image(absolute(picture.mask))[..., :3].mean(axis=2)
                _check_size(picture.mask, chosen, view, camera.name)
                mask = chosen if mask is None else mask * chosen
            targets.append(edgegrad.Target(found.image, camera=view, mask=mask))
        export.scene.validate()
        before = {path: np.array(values.get(export.scene, path), np.float64) for path in wrt}
        places = {path: parameters.destination(export, path, request.in_place) for path in wrt}
        if driver is not None:
            before |= {one.path: one.read() for one in driver.parameters}
            before |= {one.path: one.read() for one in driver.controls}
            places |= {one.path: PropertyValue(one) for one in driver.parameters}
            places |= {one.path: VerticesOf.of(one.object, np.eye(4), request.in_place) for one in driver.controls}
        notes += [*not_computed(export, wrt), *([] if driver is None else driver.notes)]
        relay = None if driver is None else Relay(driver)
        return cls(request, export, targets, wrt, notes, before, places, driver, relay)

    @property
    def late_notes(self) -> list[str]:
        """Notes on properties that were made while the fit ran, and on what could not be written."""
        made = [] if self.driver is None else [note for note in self.driver.notes if note not in self.notes]
        return [*self.unwritten, *made]

    def serve(self) -> None:
        """Evaluate Blender for a fit in another thread that waits for it; for the main thread."""
        if self.relay is not None:
            self.relay.serve()

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
        return edgegrad.fit(
            self.export.scene,
            self.targets,
            wrt=self.wrt,
            iterations=self.request.iterations,
            spp=self.request.samples,
            max_depth=self.export.settings.max_depth,
            bounces=self.export.settings.bounces,
            seed=self.request.seed,
            smoothness=self.request.smoothness,
            slide=self.request.slide,
            step_sizes=steps,
            views_per_iteration=self.request.views_per_iteration,
            on_cancel=on_cancel,
            callback=callback,
            progress=progress,
            driven=self.relay,
            checkpoint=checkpoint,
            checkpoint_every=checkpoint_every,
            resume=resume,
        )

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
        for path, place in self.destinations.items():
            yield place, self.before[path], result.values[path]


def camera_names(scene: Any) -> list[str]:
    """Return the names of the camera objects in the scene."""
    return [ob.name for ob in scene.objects if ob.type == "CAMERA"]


def find_camera(scene: Any, name: str) -> Any:
    """Return the camera object of this name in the scene.

    Raises
    ------
    Problem
        If there is none.
    """
    ob = scene.objects.get(name)
    if ob is None or ob.type != "CAMERA":
        known = ", ".join(f"'{known}'" for known in camera_names(scene)) or "none"
        raise Problem(f"camera '{name}': there is no such camera in scene '{scene.name}' (known: {known})")
    return ob


def absolute(path: str) -> Path:
    """Resolve a path; // at the beginning means the folder of the .blend, as everywhere in Blender."""
    if not path.strip():
        raise Problem("a file has no name; choose one")
    return Path(bpy.path.abspath(path))


def _check_size(path: str, image: NDArray[Any], view: edgegrad.Camera, camera: str) -> None:
    height, width = image.shape[:2]
    rendered = view.size
    if (height, width) != rendered:
        raise Problem(f"image '{path}': is {width} x {height} pixels, but camera '{camera}' renders "
                      f"{rendered[1]} x {rendered[0]}; make the scene's resolution equal to the picture's")  # fmt: skip

"""One fit of Blender's data in three steps: `prepare` reads them, `run` does not access them, `write` changes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import images
from edgegrad.scene import parameters as values

from . import parameters, write_back
from .animated.driver import Driver, control_variable
from .animated.parameter import Wanted
from .animated.relay import Relay
from .animated.stored import remember_sensitivities
from .differentiable import export_differentiable, not_computed
from .export import Export
from .problem import Problem
from .view_transforms import AUTO, view_of


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
    weight
        Weight of this picture among the targets.
    """

    camera: str
    image: str
    mask: str = ""
    view: str = AUTO
    weight: float = 1.0


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
    driver, relay
        Owner of the animatable properties, and the same for a fit in another thread; None: there are none.
    """

    request: Request
    export: Export
    targets: list[edgegrad.Target]
    wrt: list[str]
    notes: list[str] = field(default_factory=list)
    before: dict[str, Any] = field(default_factory=dict)
    driver: Driver | None = None
    relay: Relay | None = None

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
            transform, note = view_of(scene, absolute(picture.image), picture.view)
            notes += [note] if note else []
            found = images.read_target(absolute(picture.image), transform)
            _check_size(picture.image, found.image, view, camera.name)
            mask = found.weight
            if picture.mask:
                chosen = images.read_image(absolute(picture.mask))[..., :3].mean(axis=2)
                _check_size(picture.mask, chosen, view, camera.name)
                mask = chosen if mask is None else mask * chosen
            targets.append(edgegrad.Target(found.image, camera=view, mask=mask, weight=picture.weight))
        export.scene.validate()
        before = {path: np.array(values.get(export.scene, path), np.float64) for path in wrt}
        notes += [*not_computed(export, wrt), *([] if driver is None else driver.notes)]
        return cls(request, export, targets, wrt, notes, before, driver, None if driver is None else Relay(driver))

    @property
    def late_notes(self) -> list[str]:
        """Notes on properties that were made while the fit ran."""
        return [] if self.driver is None else [note for note in self.driver.notes if note not in self.notes]

    def serve(self) -> None:
        """Evaluate Blender for a fit in another thread that waits for it; for the main thread."""
        if self.relay is not None:
            self.relay.serve()

    def run(
        self,
        callback: Callable[[edgegrad.FitStep], bool | str | None] | None = None,
        progress: Callable[[float], None] | None = None,
        on_cancel: str = "restore",
    ) -> edgegrad.FitResult:
        """Run `edgegrad.fit` on the exported scene; Blender's data stay unchanged."""
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
        )

    def write(self, result: edgegrad.FitResult) -> bool:
        """Write a result into Blender's data; return whether anything was written."""
        kept = [path for path in self.wrt if not np.array_equal(result.values[path], self.before[path])]
        for path in kept:
            parameters.write(self.export, path, self.before[path], result.values[path], self.request.in_place)
        moved = False
        if self.driver is not None:
            values = {one.path: result.values[one.path] for one in self.driver.variables}
            moved = any(not np.array_equal(one.read(), values[one.path]) for one in self.driver.parameters)
            self.driver.write(values)
            for control in self.driver.controls:
                before, after = control.read(), values[control.path]
                if not np.array_equal(before, after):
                    write_back.write_vertices(control.object, np.eye(4), before, after, self.request.in_place)
                    moved = True
            remember_sensitivities(self.driver.scene, self.driver.sensitivities(result.first_gradient))
        bpy.context.view_layer.update()
        return bool(kept) or moved


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
        raise Problem("a target has no picture; choose one")
    return Path(bpy.path.abspath(path))


def _check_size(path: str, image: NDArray[Any], view: edgegrad.Camera, camera: str) -> None:
    height, width = image.shape[:2]
    rendered = view.size
    if (height, width) != rendered:
        raise Problem(f"image '{path}': is {width} x {height} pixels, but camera '{camera}' renders "
                      f"{rendered[1]} x {rendered[0]}; make the scene's resolution equal to the picture's")  # fmt: skip

"""Evaluation of a Blender scene as a render sees it.

Blender evaluates a scene with the settings of renders (subdivision levels, modifiers, visibility) only for a render
engine. Therefore a render with a private engine is started, and the work runs in the callback of this engine. The
user's scene is rendered, not a copy of it, since a copy has neither the cache of its rigid bodies nor its name, which
drivers and handlers use.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import bpy

from .problem import Problem

T = TypeVar("T")

ENGINE = "EDGEGRAD_EXPORT"
RESULT = "Render Result"
# Slot of the image RESULT that receives the empty picture of the private engine.
SLOT = "Edgegrad"
# Blender's names of jobs to ours.
_JOBS = {"RENDER": "Blender's render", "OBJECT_BAKE": "Blender's bake"}


@dataclass(frozen=True)
class Evaluation:
    """A scene evaluated for a render; valid only during the call of `evaluate`.

    Attributes
    ----------
    scene
        Blender's scene (original).
    camera
        The camera object (original) of the render: the given one, or the active one at this frame; None: the view of an
        editor.
    depsgraph
        Dependency graph of a render, or of an editor.
    unread_layers
        Names of further view layers that a render would render.
    """

    scene: Any
    camera: Any
    depsgraph: Any
    unread_layers: tuple[str, ...] = ()


class _Engine(bpy.types.RenderEngine):
    """Calls the work instead of rendering."""

    bl_idname = ENGINE
    bl_label = "Edgegrad (export)"

    work: Callable[[Any], None] | None = None

    def render(self, depsgraph: Any) -> None:
        """Call the work with the dependency graph of the render."""
        assert _Engine.work is not None
        _Engine.work(depsgraph)


def active_camera(scene: Any) -> Any:
    """Return the scene's active camera; raise `Problem` if it has none."""
    if scene.camera is None:
        raise Problem(f"scene '{scene.name}': has no camera; add one and make it active")
    return scene.camera


def occupied_by() -> str:
    """Name Blender's render or bake in a thread, beside which a scene can't be evaluated; empty: there is none."""
    return next((name for job, name in _JOBS.items() if bpy.app.is_job_running(job)), "")


def evaluate(scene: Any, work: Callable[[Evaluation], T], camera: Any = None) -> T:
    """Return `work(evaluation)` for the scene at its current frame, evaluated as a render evaluates it.

    Unfinished changes of edit modes are evaluated too; the modes stay as they are.

    Parameters
    ----------
    camera
        Camera object; None: the active camera.

    Raises
    ------
    Problem
        If there is no camera, or if Blender cannot evaluate the scene for a render. Exceptions of `work` are raised
        unchanged.
    """
    if camera is None:  # markers may bind another one to the frame
        active_camera(scene)
    occupied = occupied_by()
    if occupied:
        raise Problem(f"scene '{scene.name}': can't be read during {occupied}; wait for its end, or cancel it")
    bpy.ops.ed.flush_edits()
    layer, unread = _rendered_layers(scene)
    settings = _Settings(scene, layer)
    results: list[T] = []
    errors: list[BaseException] = []

    def run(depsgraph: Any) -> None:
        # Blender prints exceptions of callbacks and goes on, so they are kept until the callback has returned.
        try:
            with settings.swapped():
                # The swap has tagged the scene. If `work` moves an object before the next update, Blender updates both
                # at once, and the object's modifiers are left out.
                depsgraph.update()
                results.append(work(Evaluation(scene, camera or scene.camera, depsgraph, unread)))
        except BaseException as error:
            errors.append(error)

    reason = "Blender gives no reason"
    with _engine(scene, run), kept_result(), _active_camera(scene, camera), settings.swapped():
        try:
            bpy.ops.render.render(scene=scene.name)
        except RuntimeError as error:
            reason = str(error).strip()
    if errors:
        raise errors[0]
    if not results:
        raise Problem(f"scene '{scene.name}': can't be evaluated for a render ({reason})")
    return results[0]


def evaluate_alone(ob: Any, scene: Any, work: Callable[[Evaluation], T]) -> T:
    """Return `work(evaluation)` for one object of the scene; only what it depends on is evaluated with it."""
    lens, alone = bpy.data.cameras.new("Edgegrad"), bpy.data.scenes.new("Edgegrad")
    camera = bpy.data.objects.new("Edgegrad", lens)
    try:
        alone.frame_current, alone.frame_subframe = scene.frame_current, scene.frame_subframe
        for name in ("use_simplify", "simplify_subdivision_render"):
            setattr(alone.render, name, getattr(scene.render, name))
        alone.collection.objects.link(ob)
        return evaluate(alone, work, camera)
    finally:
        bpy.data.batch_remove([alone, camera, lens])


def _rendered_layers(scene: Any) -> tuple[Any, tuple[str, ...]]:
    """The view layer whose picture Blender shows after a render, and the names of other layers that it renders."""
    used = [layer for layer in scene.view_layers if layer.use]
    window = bpy.context.view_layer
    active = window if window is not None and scene.view_layers.get(window.name) == window else scene.view_layers[0]
    if not used or (scene.render.use_single_layer and not bpy.app.background):
        return active, ()
    return used[0], tuple(layer.name for layer in used[1:])


@contextmanager
def _engine(scene: Any, run: Callable[[Any], None]) -> Iterator[None]:
    """Make the private engine the scene's; it is registered only now, so that it is never among the user's engines."""
    _Engine.work = run
    bpy.utils.register_class(_Engine)
    before = scene.render.engine
    scene.render.engine = ENGINE
    try:
        yield
    finally:
        scene.render.engine = before
        bpy.utils.unregister_class(_Engine)
        _Engine.work = None


@contextmanager
def kept_result() -> Iterator[None]:
    """Keep the user's last render: the empty picture goes into a slot of its own, or is removed."""
    image = bpy.data.images.get(RESULT)
    if image is None:
        try:
            yield
        finally:
            made = bpy.data.images.get(RESULT)
            if made is not None:
                bpy.data.images.remove(made)
        return
    slots = image.render_slots
    shown = slots.active_index
    names = [slot.name for slot in slots]
    if SLOT not in names:
        slots.new(name=SLOT)
        names.append(SLOT)
    slots.active_index = names.index(SLOT)
    try:
        yield
    finally:
        slots.active_index = shown


@contextmanager
def _active_camera(scene: Any, camera: Any) -> Iterator[None]:
    """Make a camera (None: none) the active one; timeline markers may also change it during the render."""
    before = scene.camera
    if camera is not None:
        scene.camera = camera
    try:
        yield
    finally:
        if scene.camera != before:
            scene.camera = before


class _Settings:
    """Values of the scene's settings with which Blender renders only one view layer, and nothing after it.

    The user's values are in place while the work runs, which reads them.
    """

    def __init__(self, scene: Any, layer: Any) -> None:
        render = scene.render
        values = [(render, name, False)
                  for name in ("use_compositing", "use_sequencer", "use_freestyle", "use_multiview",
                               "use_persistent_data", "use_single_layer")]  # fmt: skip
        values += [(other, "use", other == layer) for other in scene.view_layers]
        # Blender itself draws grease pencil into the pictures of all engines, which needs a graphics card.
        values.append((layer, "use_grease_pencil", False))
        self._held = [[owner, name, value] for owner, name, value in values if getattr(owner, name, value) != value]

    @contextmanager
    def swapped(self) -> Iterator[None]:
        """Exchange the values in the scene and the held ones for the block."""
        self._swap()
        try:
            yield
        finally:
            self._swap()

    def _swap(self) -> None:
        for entry in self._held:
            owner, name, value = entry
            entry[2] = getattr(owner, name)
            setattr(owner, name, value)

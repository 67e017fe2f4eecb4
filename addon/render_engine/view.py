"""A rendered view: what its editor shows is exported on Blender's main thread and rendered in a thread of its own."""

from __future__ import annotations

import time
import weakref
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad.scene.changes import StructureChange, changes

from ..evaluation import Evaluation
from ..export.exported import Export
from ..export.scene import export_evaluated
from ..operators._common import EXPECTED
from ..preferences import first_seconds, threads
from ..problem import sentence
from .drawing import Picture
from .view_camera import Seen, camera_of_view, through_camera
from .view_memory import ViewMemory
from .view_thread import Request, Shown, ViewThread
from .yielding import rest

# How long a redraw waits for a picture of what has changed, seconds. To draw the old picture instead costs a whole
# redraw of the window, and the new one waits for it.
PATIENCE = 0.1
# How often new pictures are looked for, seconds.
POLL_SECONDS = 1.0 / 60.0

_views: weakref.WeakSet[View] = weakref.WeakSet()


class View:
    """A 3D view that is rendered.

    Parameters
    ----------
    engine
        Blender's engine of the view, which owns this object.
    """

    def __init__(self, engine: Any) -> None:
        self._engine = weakref.ref(engine)
        self._thread = ViewThread()
        self._memory = ViewMemory()
        self._export: Export | None = None
        self._transparent = False
        self._error: str | None = None
        self._exported_for: edgegrad.Camera | None = None
        self._stale: set[str] | None = None  # objects that have changed since the last export; None: all may have
        self._postponed = False  # an export
        self._blind = False  # the camera could not be rendered when it was looked for last
        self._exported = 0.0, 0.0  # when the last export ended, and its seconds
        self._request: Request | None = None
        self._view: edgegrad.Camera | None = None  # when it was drawn last
        self._drawn: tuple[Shown | None, str | None] = None, None
        self._picture = Picture()
        _views.add(self)
        if not bpy.app.timers.is_registered(_poll):
            bpy.app.timers.register(_poll, first_interval=POLL_SECONDS)

    def stop(self) -> None:
        """End the thread."""
        _views.discard(self)
        self._thread.stop()

    def update(self, context: Any, depsgraph: Any) -> None:
        """Export what Blender has changed, at once or in a later draw."""
        if self._stale is not None:
            self._stale |= _changed_objects(depsgraph)
        self._postponed = not self._may_export
        seen = None if self._postponed else self._look(context, depsgraph)
        if seen is not None:
            self._export_for(seen.camera, depsgraph)

    @property
    def _may_export(self) -> bool:
        """Whether the view has rested long enough since the last export."""
        ended, seconds = self._exported
        return self._export is None or time.monotonic() >= ended + rest(seconds)

    def _look(self, context: Any, depsgraph: Any) -> Seen | None:
        """What the view shows; None and an error if its camera can't be rendered."""
        try:
            return _seen(context, depsgraph)
        except EXPECTED as error:
            self._export, self._error, self._request, self._blind = None, sentence(str(error)), None, True
            return None

    def _export_for(self, camera: edgegrad.Camera, depsgraph: Any) -> None:
        scene, before, stale = depsgraph.scene, self._export, None if self._export is None else self._stale
        began = time.monotonic()
        self._exported_for, self._postponed, self._blind, self._stale = camera, False, False, set()
        self._memory.expect(lambda name: stale is None or name in stale)
        try:
            # Bakes take long, and run operators, which drawing must not.
            out = export_evaluated(Evaluation(scene, None, depsgraph), (), bake=0, memory=self._memory, view=camera)
            self._memory.end()
            out.scene.validate()
        except EXPECTED as error:
            self._export, self._error, self._request = None, sentence(str(error)), None
            return
        self._error = None
        transparent = bool(scene.render.film_transparent)
        same = before is not None and self._transparent == transparent and _is_same(before, out)
        self._transparent = transparent
        if not same:
            self._export = out
        ended = time.monotonic()
        self._exported = ended, ended - began

    def draw(self, context: Any, depsgraph: Any) -> None:
        """Ask for a picture of the view, and draw the last one."""
        seen, engine = self._look(context, depsgraph), self._engine()
        if seen is None:
            if engine is not None:
                engine.update_stats("", self._error)
            return
        camera = seen.camera
        # Materials may depend on the view
        moved = (self._exported_for is not None and _is_equal(camera, self._view)
                 and not _is_equal(camera, self._exported_for))  # fmt: skip
        if moved or self._blind or (self._postponed and self._may_export):
            self._export_for(camera, depsgraph)
        self._view = camera
        request = self._request
        if self._export is None:
            if engine is not None and self._error:
                engine.update_stats("", self._error)
            return
        settings = depsgraph.scene.edgegrad_render
        wanted = Request(self._export.scene, self._export.settings, seen, self._transparent,
                         settings.preview_samples, settings.seed, threads(), first_seconds())  # fmt: skip
        if request is None or not _is_equal_request(request, wanted):
            self._request = request = wanted
            self._thread.post(request)
            self._thread.wait(request, PATIENCE)
        self._drawn = shown, _ = self._thread.shown, self._thread.error
        if shown is not None:
            self._picture.draw(engine, depsgraph.scene, shown, context.region.width, context.region.height)
        if engine is not None:
            engine.update_stats("", self._status(request))

    def _status(self, request: Request) -> str:
        if self._thread.error is not None:
            return sentence(self._thread.error)
        shown = self._thread.shown
        done = shown.samples if shown is not None and shown.request is request else 0
        return f"Sample {done} of {request.samples}"

    def redraw_if_new(self) -> None:
        """Have Blender draw the view if it has news, or if a postponed export is due."""
        shown, error = self._drawn
        if (self._thread.shown is not shown or self._thread.error != error
                or (self._postponed and self._may_export)):  # fmt: skip
            engine = self._engine()
            if engine is not None:
                engine.tag_redraw()


def _poll() -> float | None:
    for view in list(_views):
        try:
            view.redraw_if_new()
        except ReferenceError:  # Blender has freed the engine
            view.stop()
    return POLL_SECONDS if len(_views) else None


def stop_all() -> None:
    """End the threads of all views."""
    for view in list(_views):
        view.stop()
    if bpy.app.timers.is_registered(_poll):
        bpy.app.timers.unregister(_poll)


def _seen(context: Any, depsgraph: Any) -> Seen:
    """What the view that is drawn shows."""
    region, space, scene = context.region, context.region_data, depsgraph.scene
    pixel = max(1, int(_pixel_size(context, scene)))
    view, projection = (np.array(matrix, np.float64) for matrix in (space.view_matrix, space.window_matrix))
    width, height = max(region.width // pixel, 1), max(region.height // pixel, 1)
    ob = context.space_data.camera or scene.camera
    if space.view_perspective != "CAMERA" or ob is None or ob.type != "CAMERA":
        return Seen(camera_of_view(view, projection, width, height))
    return through_camera(ob.evaluated_get(depsgraph), scene, view, projection, width, height)


def _pixel_size(context: Any, scene: Any) -> float:
    size = scene.render.preview_pixel_size
    return float(context.preferences.system.pixel_size if size == "AUTO" else size)


def _changed_objects(depsgraph: Any) -> set[str]:
    """Names of the objects whose geometry Blender has evaluated anew."""
    names: set[str] = set()
    data: set[str] = set()
    for update in depsgraph.updates:
        if not update.is_updated_geometry:
            continue
        changed = update.id.original
        (names if isinstance(changed, bpy.types.Object) else data).add(changed.name)
    if data:
        names |= {ob.name for ob in depsgraph.scene.objects if ob.data is not None and ob.data.name in data}
    return names


def _is_same(before: Export, after: Export) -> bool:
    """Whether two exports have the same picture."""
    try:
        found = changes(before.scene, after.scene)
    except StructureChange:
        return False
    # The view has a camera of its own.
    return before.settings == after.settings and all(path.startswith("camera.") for path in found)


def _is_equal(one: edgegrad.Camera | None, other: edgegrad.Camera | None) -> bool:
    if one is None or other is None:
        return one is other
    return all(np.array_equal(value, getattr(other, name)) for name, value in vars(one).items())


def _is_equal_request(one: Request, other: Request) -> bool:
    return (one.scene is other.scene and one.settings == other.settings
            and _is_equal(one.seen.camera, other.seen.camera)
            and (one.seen.place, one.film_transparent, one.samples, one.seed, one.threads) ==
            (other.seen.place, other.film_transparent, other.samples, other.seed, other.threads))  # fmt: skip

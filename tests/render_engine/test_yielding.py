"""Rendered views rest while a job runs."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad_addon.export import export_scene
from edgegrad_addon.render_engine import view, view_thread, yielding
from edgegrad_addon.render_engine.view_camera import Seen
from edgegrad_addon.render_engine.view_thread import Request, ViewThread
from edgegrad_addon.status import STATUS

FOR_EVER = 1e9
SECONDS = 60.0  # after which a thread is taken for hanging


pytestmark = pytest.mark.usefixtures("scene")


def test_views_rest_while_a_job_runs(monkeypatch: Any) -> None:
    assert yielding.rest(0.1) == 0.0
    monkeypatch.setattr(STATUS, "job", SimpleNamespace(paused=False))
    assert yielding.rest(0.1) >= 1.0, "the view takes more than a tenth of the fit's time"
    monkeypatch.setattr(STATUS, "job", SimpleNamespace(paused=True))
    assert yielding.rest(0.1) == 0.0


def test_a_view_that_rests_shows_the_first_picture_of_each_request(scene: Any, monkeypatch: Any) -> None:
    export, asked = export_scene(scene), []
    length = {"seconds": FOR_EVER}

    def rest(seconds: float) -> float:
        asked.append(seconds)
        return length["seconds"]

    monkeypatch.setattr(view_thread, "rest", rest)
    thread = ViewThread()
    thread._seconds = 1.0  # for a sample of a pixel: the view begins with fewer pixels
    for fov in (1.0, 1.2):  # the second request ends the rest after the first
        camera = edgegrad.Camera(export.scene.camera.to_world, width=30, height=20, fov_x=fov)
        wanted = Request(export.scene, export.settings, Seen(camera), False, 8, 0)
        thread.post(wanted)
        thread.wait(wanted, SECONDS)
        asked.clear()
        end = time.monotonic() + SECONDS
        while len(asked) < 3 and time.monotonic() < end:  # it asks again and again whether it still has to rest
            time.sleep(0.01)
        assert thread.shown is not None and thread.shown.request is wanted and thread.shown.samples == 1
    length["seconds"] = 0.0  # the job has ended
    end = time.monotonic() + SECONDS
    while thread.shown.samples < 8 and time.monotonic() < end:
        time.sleep(0.01)
    assert thread.shown.samples == 8
    thread.stop()


class Shown:
    """A rendered view without a window, and the objects whose meshes it has read."""

    def __init__(self, monkeypatch: Any) -> None:
        self.exports: list[list[str]] = []
        self._read: list[str] = []
        plain_read, plain_export = view.ViewMemory.read, view.export_evaluated

        def read(memory: Any, name: str, mesh: Any) -> Any:
            if memory._stale(name):
                self._read.append(name)
            return plain_read(memory, name, mesh)

        def export(*arguments: Any, **options: Any) -> Any:
            self._read.clear()
            out = plain_export(*arguments, **options)
            self.exports.append(sorted(set(self._read)))
            return out

        monkeypatch.setattr(view.ViewMemory, "read", read)
        monkeypatch.setattr(view, "export_evaluated", export)
        monkeypatch.setattr(view, "_seen", lambda *_: Seen(edgegrad.Camera(np.eye(4), width=8, height=8)))
        monkeypatch.setattr(view.Picture, "draw", lambda *_: None)
        self.redrawn = 0
        self.view = view.View(self)
        self.context = SimpleNamespace(region=SimpleNamespace(width=8, height=8))

    # As Blender's engine
    def update_stats(self, *_: str) -> None:
        pass

    def tag_redraw(self) -> None:
        self.redrawn += 1

    def update(self) -> None:
        def note(scene: Any, depsgraph: Any) -> None:
            self.view.update(self.context, depsgraph)

        bpy.app.handlers.depsgraph_update_post.append(note)
        bpy.context.view_layer.update()
        bpy.app.handlers.depsgraph_update_post.remove(note)

    def draw(self) -> None:
        self.view.draw(self.context, bpy.context.evaluated_depsgraph_get())
        request = self.view._request
        while self.view._thread.shown is None or self.view._thread.shown.request is not request:
            time.sleep(0.01)
        self.view.draw(self.context, bpy.context.evaluated_depsgraph_get())
        self.redrawn = 0


def test_what_has_changed_is_exported_when_the_view_has_rested(scene: Any, monkeypatch: Any) -> None:
    shown = Shown(monkeypatch)
    bpy.data.objects["Cube"].location.x = 0.1
    shown.update()
    assert shown.exports == [["Cube", "Plane"]]
    monkeypatch.setattr(view, "rest", lambda seconds: FOR_EVER)
    for name in ("Cube", "Plane"):
        bpy.data.meshes[name].vertices[0].co.x -= 1.0
        bpy.data.meshes[name].update()
        shown.update()
    shown.draw()
    shown.view.redraw_if_new()
    assert len(shown.exports) == 1 and shown.redrawn == 0
    monkeypatch.setattr(view, "rest", lambda seconds: 0.0)
    shown.view.redraw_if_new()
    assert shown.redrawn == 1
    shown.draw()
    assert shown.exports[1:] == [["Cube", "Plane"]], "the changes of both are exported, once"
    shown.view.redraw_if_new()
    assert shown.redrawn == 0
    shown.view.stop()

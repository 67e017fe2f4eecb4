"""Preferences: threads, first pictures of rendered views, and the states of fits that Blender's end has interrupted."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
import edgegrad_addon
from edgegrad import images
from edgegrad_addon import preferences
from edgegrad_addon.export import export_scene
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.render_engine.view_camera import Seen
from edgegrad_addon.render_engine.view_thread import Request, ViewThread
from edgegrad_addon.running import kept_state
from edgegrad_addon.running.fit_job import FitJob
from edgegrad_addon.running.job import RESTORE
from edgegrad_addon.session import Picture, Session
from edgegrad_addon.session import Request as FitRequest
from tests.support.scenes import blender_scenes as bs

ITERATIONS = 30


@pytest.fixture(name="chosen")
def _chosen(tmp_path: Path) -> Iterator[Any]:
    """The add-on's preferences, with a folder for checkpoints, and a small scene with a target."""
    bs.empty(12)
    edgegrad_addon.register()
    addon = bpy.context.preferences.addons.new()
    addon.module = edgegrad_addon.__name__
    bs.camera((0, 0, 6), name="Front")
    bs.light("POINT", "Lamp")
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")))
    images.write_image(tmp_path / "target.exr", np.full((12, 12, 3), 0.2, np.float32))
    (tmp_path / "states").mkdir()
    addon.preferences.checkpoints = str(tmp_path / "states")
    yield addon.preferences
    bpy.context.preferences.addons.remove(addon)
    edgegrad_addon.unregister()


def prepared(tmp_path: Path, iterations: int = ITERATIONS) -> FitJob:
    asked = FitRequest([Picture("Front", str(tmp_path / "target.exr"))], Names(base_color=("Clay",)),
                       iterations=iterations, samples=2)  # fmt: skip
    kept = kept_state.file_for(bpy.context.scene)
    job = FitJob(Session.prepare(bpy.context, asked), tmp_path / "difference.png", kept)
    assert job.checkpoint is not None
    return job


def run(job: FitJob, end_after: int = 0, reason: str = "") -> FitJob:
    """Run a fit to its end, or end it with a reason after some iterations."""
    plain = job._tell

    def tell(step: edgegrad.FitStep) -> str | None:
        if step.iteration == end_after:
            job.end(RESTORE, reason)
        return plain(step)

    job._tell = tell  # type: ignore[method-assign]
    job.start().wait()
    assert job.error is None, job.error
    return job


def test_an_interrupted_fit_goes_on_to_the_same_result(chosen: Any, tmp_path: Path) -> None:
    whole = run(prepared(tmp_path))
    assert whole.checkpoint is not None and not whole.checkpoint.exists() and whole.notes == []
    cut = run(prepared(tmp_path), 26, "its window was closed")
    assert cut.checkpoint == whole.checkpoint and whole.checkpoint.exists()
    rest = run(prepared(tmp_path))
    assert rest.began == 26 and "after iteration 26" in rest.notes[0] and not whole.checkpoint.exists()
    assert len(rest.losses) == ITERATIONS - 26 and rest.result.losses == whole.result.losses
    for path, value in whole.result.values.items():
        assert np.array_equal(rest.result.values[path], value), path


def test_the_user_ends_a_fit_for_good(chosen: Any, tmp_path: Path) -> None:
    job = run(prepared(tmp_path), 5)
    assert job.checkpoint is not None and not job.checkpoint.exists()


@pytest.mark.parametrize("damaged", [True, False])
def test_the_state_of_another_fit_is_replaced(damaged: bool, chosen: Any, tmp_path: Path) -> None:
    other = run(prepared(tmp_path, 40), 26, "its window was closed")
    assert other.checkpoint is not None
    if damaged:
        other.checkpoint.write_bytes(b"no state")
    job = run(prepared(tmp_path))
    assert job.began == 0 and len(job.losses) == ITERATIONS and not other.checkpoint.exists()


def test_files_of_states_differ_by_scene(chosen: Any) -> None:
    first = kept_state.file_for(bpy.context.scene)
    assert first == kept_state.file_for(bpy.context.scene) and first != kept_state.file_for(bpy.data.scenes.new("A/B"))
    chosen.checkpoints = ""
    assert kept_state.file_for(bpy.context.scene) is None
    chosen.checkpoints = "/no/such/folder"
    with pytest.raises(Problem, match="folder for checkpoints, '/no/such/folder', does not exist"):
        kept_state.file_for(bpy.context.scene)


def test_renders_and_views_have_the_chosen_threads(chosen: Any, monkeypatch: Any) -> None:
    made: list[int] = []
    plain = edgegrad.Renderer.__init__

    def noted(self: Any, *arguments: Any, **options: Any) -> None:
        made.append(options.get("threads", 0))
        plain(self, *arguments, **options)

    monkeypatch.setattr(edgegrad.Renderer, "__init__", noted)
    chosen.threads = 3
    scene = bpy.context.scene
    scene.render.engine, scene.edgegrad_render.samples = "EDGEGRAD", 1
    scene.view_layers[0].use_pass_z = scene.render.film_transparent = True
    bpy.ops.render.render()
    assert made.count(3) == 3, made  # the picture, its alpha, and the depth
    # A view takes other threads at once, for its transparency, too.
    export = export_scene(scene)
    made.clear()
    thread = ViewThread()
    for count in (2, 1):
        request = Request(export.scene, export.settings, Seen(export.scene.camera), True, 1, 0, count)
        thread.post(request)
        thread.wait(request, 60.0)
    thread.stop()
    assert made == [2, 2, 1, 1]


def test_first_pictures_are_as_quick_as_chosen(chosen: Any) -> None:
    found = []
    for name in preferences.PREVIEWS:
        chosen.preview = name
        found.append(preferences.first_seconds())
    assert found == sorted(found) and len(set(found)) == len(found)

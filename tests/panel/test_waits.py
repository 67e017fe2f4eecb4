"""A fit of properties beside a render in Blender: it waits, says so, and can be ended."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon import evaluation
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.animated.relay import Relay
from edgegrad_addon.panel import fit as panel
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.running import current
from edgegrad_addon.running.fit_job import FitJob
from edgegrad_addon.running.job import RESTORE
from edgegrad_addon.session import Picture, Request, Session


@pytest.fixture
def renders(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The kinds of jobs that Blender runs; a test changes the list."""
    kinds: list[str] = []
    app = SimpleNamespace(is_job_running=lambda kind: kind in kinds)
    monkeypatch.setattr(evaluation, "bpy", SimpleNamespace(app=app, ops=bpy.ops, data=bpy.data, context=bpy.context,
                                                           utils=bpy.utils, types=bpy.types))  # fmt: skip
    return kinds


@pytest.fixture(name="job")
def _job(scene: Any, picture: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FitJob]:
    scene.render.resolution_x, scene.render.resolution_y = 20, 10
    wanted = (Wanted('objects["Lamp"].location'),)
    request = Request([Picture("Front", picture)], Names(), iterations=3, samples=1, animated=wanted, uncertainty=False)
    job = FitJob(Session.prepare(bpy.context, request), tmp_path / "difference.png")
    monkeypatch.setattr(current.STATUS, "job", job)
    job.start()
    yield job
    job.end(RESTORE)
    job.wait()


def polled(until: Callable[[], bool]) -> None:
    """Poll the job as its timer does."""
    last = time.monotonic() + 60.0
    while not until():
        assert time.monotonic() < last
        current.poll(bpy.context)
        time.sleep(0.001)


def texts(job: FitJob) -> list[str]:
    """Return all texts that the panel draws."""
    drawn: list[str] = []

    class Layout:
        def __getattr__(self, name: str) -> Any:
            def call(*_: Any, text: str = "", **__: Any) -> Layout:
                drawn.append(text)
                return self

            return call

    panel._progress(SimpleNamespace(scene=bpy.context.scene), Layout(), job)
    return drawn


@pytest.mark.parametrize(("kind", "name"), [("RENDER", "Blender's render"), ("OBJECT_BAKE", "Blender's bake")])
def test_a_fit_waits_while_blender_renders_and_says_so(renders: list[str], job: FitJob, kind: str, name: str) -> None:
    renders.append(kind)
    polled(lambda: bool(job.waits_for))
    said = f"Waiting for the end of {name}"
    assert said in current.text_of(job) and said in texts(job)
    time.sleep(0.3)
    assert job.running and job.step is None
    renders.clear()
    polled(lambda: job.step is not None)
    assert "Waiting" not in current.text_of(job) and not any("Waiting" in one for one in texts(job))
    polled(lambda: not job.running)
    assert job.error is None and job.result is not None
    assert 3.0 * job.pace <= job.step.seconds - 0.3  # the wait does not belong to an iteration


def test_a_waiting_fit_ends_at_once(renders: list[str], job: FitJob) -> None:
    renders.append("RENDER")
    polled(lambda: bool(job.waits_for))
    job.end(RESTORE)
    polled(lambda: not job.running)
    assert job.ending == RESTORE and job.error is None and job.result is None


def test_a_scene_is_not_read_during_a_render(scene: Any, renders: list[str]) -> None:
    renders.append("RENDER")
    with pytest.raises(Problem, match="can't be read during Blender's render; wait for its end, or cancel it"):
        evaluation.evaluate(scene, lambda _: None)


@pytest.mark.parametrize(("names", "moves"), [(Names(vertices=("Cube",)), True), (Names(base_color=("Clay",)), False)])
def test_lines_of_shapes_are_offered_if_the_fit_may_move_some(scene: Any, picture: str, tmp_path: Path, names: Names,
                                                              moves: bool) -> None:  # fmt: skip
    scene.render.resolution_x, scene.render.resolution_y = 20, 10
    session = Session.prepare(bpy.context, Request([Picture("Front", picture)], names, iterations=1, samples=1))
    assert FitJob(session, tmp_path / "difference.png").moves_shapes is moves


@pytest.mark.parametrize(("seconds", "answered"), [(0.0, 1), (30.0, 3)])
def test_one_call_answers_what_comes_within_its_seconds(seconds: float, answered: int) -> None:
    calls: list[int] = []
    driver = SimpleNamespace(look=lambda values: calls.append(values["x"]))
    relay = Relay(driver)  # type: ignore[arg-type]

    def ask() -> None:
        for k in range(3):
            relay.look({"x": k})
        relay.close()

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    while not relay.wanted:
        time.sleep(0.001)
    relay.serve(seconds)
    assert calls == list(range(answered))
    while thread.is_alive():
        relay.serve()
    assert calls == [0, 1, 2]

"""Fits of properties and of vertices under modifiers go on from a checkpoint with the same bits."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import images
from edgegrad_addon.animated.driver import CHECK_EVERY
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.parameters import Names
from edgegrad_addon.session import Picture, Request, Session
from tests.support.animated import scenes as zoo

SIZE, ITERATIONS = 12, CHECK_EVERY + 4


def prepared(folder: Path, **more: Any) -> Session:
    """A cube under Subdivision, its lamp and its camera's lens; made anew, as by another process."""
    ob = zoo.stage(SIZE)
    ob.modifiers.new("Round", "SUBSURF").render_levels = 1
    images.write_image(folder / "target.exr", np.full((SIZE, SIZE, 3), 0.3, np.float32))
    wanted = (Wanted('lights["Lamp"].energy'), Wanted(f"{zoo.CUBE}.rotation_euler"), Wanted('cameras["Camera"].lens'))
    return Session.prepare(bpy.context, Request([Picture("Camera", str(folder / "target.exr"))], Names(("Cube",)),
                                                ITERATIONS, 1, animated=wanted, **more))  # fmt: skip


def same(a: edgegrad.FitResult, b: edgegrad.FitResult) -> None:
    assert a.losses == b.losses and a.best == b.best and a.notes == b.notes and a.values.keys() == b.values.keys()
    for values in (lambda one: one.values, lambda one: one.first_gradient, lambda one: one.untouched):
        assert all(np.array_equal(values(a)[path], values(b)[path]) for path in values(a))


@pytest.mark.parametrize("stop", [3, CHECK_EVERY - 1, CHECK_EVERY])
def test_a_resumed_fit_has_the_same_bits(stop: int, tmp_path: Path) -> None:
    """Also where the steps of the difference quotients are checked again."""
    path = tmp_path / "fit.npz"
    expected = prepared(tmp_path).run()
    assert len(expected.values) == 4 and expected.losses[-1] < expected.losses[0]
    prepared(tmp_path).run(checkpoint=path, callback=lambda step: "restore" if step.iteration == stop else None)
    same(prepared(tmp_path).run(checkpoint=path, resume=True), expected)


def test_a_fit_that_began_elsewhere_has_the_same_bits(tmp_path: Path) -> None:
    """The search and the trials of other starts are made again, with the same end."""
    path, more = tmp_path / "fit.npz", {"search": 10, "restarts": 1, "uncertainty": False}
    expected = prepared(tmp_path, **more).run()
    assert any("starts were fitted" in note for note in expected.notes)
    prepared(tmp_path, **more).run(checkpoint=path, callback=lambda step: "restore" if step.iteration == 5 else None)
    same(prepared(tmp_path, **more).run(checkpoint=path, resume=True), expected)


def test_in_another_thread(tmp_path: Path) -> None:
    """As in a window, where the main thread evaluates Blender."""
    path = tmp_path / "fit.npz"
    expected = prepared(tmp_path).run()
    prepared(tmp_path).run(checkpoint=path, callback=lambda step: "restore" if step.iteration == 5 else None)
    session = prepared(tmp_path)
    found: list[Any] = []
    thread = threading.Thread(target=lambda: found.append(session.run(checkpoint=path, resume=True)))
    thread.start()
    while thread.is_alive():
        session.serve()
        time.sleep(0.001)
    thread.join()
    same(found[0], expected)


def test_another_property_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "fit.npz"
    prepared(tmp_path).run(checkpoint=path, callback=lambda step: "restore" if step.iteration == 2 else None)
    session = prepared(tmp_path)
    bpy.data.lights["Lamp"].energy *= 1.5
    session = Session.prepare(bpy.context, session.request)
    with pytest.raises(ValueError, match="light 'Lamp' differs"):
        session.run(checkpoint=path, resume=True)

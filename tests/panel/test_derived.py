"""What the panel shows of the file: it follows edits, removed rows, undo and pictures, and is derived once."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import images
from edgegrad_addon import preflight, rows
from edgegrad_addon.panel import derived, icons

pytestmark = pytest.mark.usefixtures("scene")


def shown(target: Any) -> derived.Picture:
    return derived.picture(target, bpy.context.scene, len(bpy.context.scene.edgegrad.targets))


def started() -> derived.Start:
    return derived.start(bpy.context, bpy.context.scene.edgegrad)


def see_rows(settings: Any, count: int, width: float = 400.0) -> None:
    """See the rows in a region whose lines are of a width."""
    derived.see_rows(settings, count, width + derived.BESIDE)


def test_what_the_panel_shows_follows_edits(scene: Any, picture: str) -> None:
    """Also removed rows and files, which are no edits of Blender's."""
    scene.render.resolution_x, scene.render.resolution_y = 20, 10
    row, lamp = rows.add_kind(scene, "POWER", bpy.data.objects["Lamp"]), bpy.data.objects["Lamp"]
    target = scene.edgegrad.targets.add()
    target.camera, target.image = scene.camera, picture
    bpy.context.view_layer.update()
    see_rows(scene.edgegrad, 1)
    assert derived.parameter(row).words == "Lamp: Power" and started().obstacle is None
    lamp.data.energy = 7.5
    bpy.context.view_layer.update()
    assert derived.parameter(row).beside == "7.5"
    lamp.name = "Key"
    bpy.context.view_layer.update()
    assert derived.parameter(row).words == "Key: Power"
    row.enabled, row.sensitivity = False, 0.25
    found = started().obstacle
    assert found is not None and found.sentence == "Every parameter is switched off"
    see_rows(scene.edgegrad, 1)
    about = "Key: Power\nValue: 7.5\nEffect on the loss: 25% of the largest"
    line = derived.Line(icons.number("LIGHT"), "Key: Power", "25%", 0.76, False, 0.25, about)
    assert derived.parameter(row) == line
    assert row.about == about
    see_rows(scene.edgegrad, 1, 164.0)  # a sidebar of usual width
    assert derived.parameter(row).beside == "" and derived.parameter(row).share == 0.93
    row.enabled = True
    target.camera = None
    found = started().obstacle
    assert found is not None and "has no camera" in found.sentence and not shown(target).complete
    target.camera = scene.camera
    scene.render.resolution_x = 99
    bpy.context.view_layer.update()
    found = started().obstacle
    assert found is not None and found.operator == "edgegrad.match_render"
    assert shown(target).difference == "Of another aspect: renders are 99 × 10"
    assert shown(target).size == "20 × 10"
    assert shown(target).camera == scene.camera.name
    scene.edgegrad.targets.clear()
    found = started().obstacle
    assert found is not None and found.sentence.startswith("There is no target")


def test_the_time_of_a_fit_follows_its_numbers(scene: Any, picture: str, monkeypatch: Any) -> None:
    settings = scene.edgegrad

    def label() -> str:
        return started().label

    scene.edgegrad.targets.add().image = picture
    bpy.context.view_layer.update()
    monkeypatch.setattr(derived.STATUS, "cost", 0.0)
    assert label() == "Fit"
    monkeypatch.setattr(derived.STATUS, "cost", 0.01)
    assert label() == "Fit   (about 32 s)"
    settings.iterations = 100
    assert label() == "Fit   (about 16 s)"
    settings.samples = 4
    assert label() == "Fit   (about 4 s)"
    settings.targets.add()
    assert label() == "Fit   (about 8 s)"
    settings.views_per_iteration = 1
    assert label() == "Fit   (about 4 s)"


def test_the_end_of_a_fit_is_not_shown_in_another_file(tmp_path: Path) -> None:
    file = str(tmp_path / "one.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    derived.STATUS.ended("loss 1 → 0.5 in 2 s")
    derived.STATUS.cost = 0.01
    bpy.ops.wm.save_as_mainfile(filepath=file)
    assert derived.STATUS.said == "Loss 1 → 0.5 in 2 s"
    bpy.ops.wm.open_mainfile(filepath=file)
    assert derived.STATUS.said == "" and started().label == "Fit"
    bpy.ops.wm.read_homefile()
    derived.STATUS.say(["object 'Fog': is left out"], ["a note"])
    derived.STATUS.show(plan=["Picture"], checks=["agrees"])
    assert derived.STATUS.lines
    bpy.ops.wm.read_homefile()  # which has no name either
    assert not derived.STATUS.lines and not derived.STATUS.plan and not derived.STATUS.checks


def test_a_fit_that_cannot_start_says_so_in_the_panel(scene: Any) -> None:
    """The message of the operator vanishes, and the panel must not show how an earlier job ended."""
    for run in (bpy.ops.edgegrad.fit, bpy.ops.edgegrad.plan):
        derived.STATUS.ended("the picture is in the image 'Edgegrad Render'")
        with pytest.raises(RuntimeError, match=r"There is no target|No parameter is in the list"):
            run()
        assert derived.STATUS.failed and derived.STATUS.said.startswith(("There is no", "No parameter"))


def test_removed_rows_leave_their_place_to_others(scene: Any) -> None:
    """Blender moves the rows behind a removed one to its place in memory."""
    for material in (bpy.data.materials.new("Glow"), bpy.data.materials["Clay"]):
        rows.add_kind(scene, "EMISSION", material)
    bpy.context.view_layer.update()
    parameters = scene.edgegrad.parameters
    see_rows(scene.edgegrad, len(parameters))
    assert [derived.parameter(row).words for row in parameters] == ["Glow: Emission", "Clay: Emission"]
    parameters.remove(0)
    see_rows(scene.edgegrad, len(parameters))
    assert [derived.parameter(row).words for row in parameters] == ["Clay: Emission"]


def test_removed_targets_leave_their_place_to_others(scene: Any, tmp_path: Path) -> None:
    """Also in another scene, and after a rename."""
    targets = scene.edgegrad.targets
    scene.render.resolution_x, scene.render.resolution_y = 20, 10
    for name in ("one", "two", "three"):
        images.write_image(tmp_path / f"{name}.exr", np.ones((10, 20, 3), np.float32))
        targets.add().image = str(tmp_path / f"{name}.exr")
    bpy.context.view_layer.update()
    assert [shown(target).words for target in targets] == ["one.exr", "two.exr", "three.exr"]
    targets.remove(1)
    assert [shown(target).words for target in targets] == ["one.exr", "three.exr"]
    assert started().obstacle.sentence.startswith("Target 1 has no camera")  # type: ignore[union-attr]
    targets[0].camera = scene.camera
    assert shown(targets[0]).camera == "Front"
    scene.camera.name = "Face"
    bpy.context.view_layer.update()
    assert shown(targets[0]).camera == "Face"
    other = bpy.data.scenes.new("Other")
    for _ in targets:
        other.edgegrad.targets.add()
    for one, sentence in ((scene, "Target 2 has no camera"), (other, "The scene has no camera"), (scene, "Target 2")):
        found = derived.start(SimpleNamespace(scene=one), one.edgegrad).obstacle
        assert found is not None and found.sentence.startswith(sentence)


def test_a_target_in_the_place_of_the_only_one_is_seen(scene: Any, picture: str) -> None:
    """Also if no property of it was edited: its place in memory and the number of targets are the same."""
    targets = scene.edgegrad.targets
    targets.add().image = picture
    bpy.context.view_layer.update()
    assert derived.only_target(derived.see_targets(scene.edgegrad, 1), scene).title == "no camera: a picture.exr"
    targets.clear()
    assert derived.see_targets(scene.edgegrad, 0).target is None
    targets.add()
    assert "a picture.exr" not in derived.only_target(derived.see_targets(scene.edgegrad, 1), scene).title


def test_lines_of_two_windows_fit_into_their_own_regions(scene: Any) -> None:
    other = bpy.data.scenes.new("Other")
    bpy.data.materials["Clay"].name = "A material with a long name"
    for one in (scene, other):
        rows.add_kind(one, "EMISSION", bpy.data.materials["A material with a long name"])
    bpy.context.view_layer.update()
    found = []
    for _ in range(2):
        for one, width in ((scene, 164.0), (other, 600.0)):
            see_rows(one.edgegrad, 1, width)
            found.append(derived.parameter(one.edgegrad.parameters[0]).words)
    assert found[:2] == found[2:] and "…" in found[0] and found[1] == "A material with a long name: Emission"


def test_the_panel_shows_what_undo_restores(scene: Any) -> None:
    rows.add_kind(scene, "POWER", bpy.data.objects["Lamp"])
    see_rows(scene.edgegrad, 1)
    bpy.data.objects["Lamp"].data.energy = 5.0
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects["Lamp"].data.energy = 7.0
    bpy.data.objects["Lamp"].name = "Key"
    bpy.ops.ed.undo_push(message="after")

    def line() -> tuple[str, str]:
        found = derived.parameter(bpy.context.scene.edgegrad.parameters[0])
        return found.words, found.beside

    bpy.context.view_layer.update()
    for step, wanted in ((None, ("Key: Power", "7")), ("undo", ("Lamp: Power", "5")), ("redo", ("Key: Power", "7"))):
        if step is not None:
            getattr(bpy.ops.ed, step)()
        assert line() == wanted


def test_the_panel_notices_changes_of_pictures(scene: Any, picture: str, monkeypatch: Any) -> None:
    """A file that vanishes, and one that comes back with another size."""
    target = scene.edgegrad.targets.add()
    target.camera, target.image = scene.camera, picture
    bpy.context.view_layer.update()

    monkeypatch.setattr(derived, "is_shown", lambda: True)

    def words() -> str:
        derived.see_pictures()
        return shown(target).words

    assert words() == "a picture.exr" and words() == "a picture.exr"
    Path(picture).unlink()
    assert words() == "a picture.exr is missing"
    images.write_image(picture, np.zeros((7, 9, 3), np.float32))
    assert words() == "a picture.exr" and shown(target).size == "9 × 7"


def test_what_the_panel_shows_is_derived_once(scene: Any, monkeypatch: Any) -> None:
    shown_now = True
    monkeypatch.setattr(derived, "is_shown", lambda: shown_now)
    asked: list[None] = []
    plain = preflight.obstacle
    monkeypatch.setattr(preflight, "obstacle", lambda context: (asked.append(None), plain(context))[1])
    started()
    derived.see_pictures()
    asked.clear()
    started()
    for _ in range(5):
        derived.see_pictures()
        started()
    assert len(asked) == 1
    # Where no window shows the tab, what it shows is derived anew.
    shown_now = False
    derived.see_pictures()
    started()
    assert len(asked) == 2

"""Fits by the command line: set-ups, progress as JSON, checkpoints, and what is refused before the work."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad_addon
from edgegrad import images, read_checkpoint
from edgegrad_addon import command_line, rows
from edgegrad_addon.fit_setup import with_setup
from edgegrad_addon.session import Session
from edgegrad_addon.write_back.kept import TEXT
from tests.support.scenes import blender_scenes as bs


@pytest.fixture
def start(tmp_path: Path) -> Path:
    """A saved .blend whose panel has a target, a property and settings."""
    bs.empty(16)
    bs.camera((0, 0, 6), name="Front")
    bs.world((0.5, 0.5, 0.5))
    bs.light("POINT", "Bulb")
    bs.add("Cube", bs.cube("Cube", bs.material("Clay", (0.2, 0.2, 0.2)))).select_set(True)
    images.write_image(tmp_path / "target.exr", np.full((16, 16, 3), 0.4, np.float32))
    edgegrad_addon.register()
    try:
        settings = bpy.context.scene.edgegrad
        target = settings.targets.add()
        target.camera, target.image = bpy.data.objects["Front"], "//target.exr"
        settings.iterations, settings.samples = 3, 2
        settings.write_to = "MESH"
        row = settings.parameters.add()
        row.owner, row.path, row.index = bpy.data.objects["Cube"], "location", 0
        rows.add_kind(bpy.context.scene, "BASE_COLOR", bpy.data.materials["Clay"])
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "start.blend"))
    finally:
        edgegrad_addon.unregister()
    return tmp_path / "start.blend"


@pytest.fixture
def requests(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The requests of fits, which are run."""
    seen: list[Any] = []
    prepare = Session.prepare

    def remember(context: Any, request: Any) -> Session:
        seen.append(request)
        return prepare(context, request)

    monkeypatch.setattr(Session, "prepare", remember)
    return seen


def fit(*words: Any) -> int:
    return command_line.main(["fit", *map(str, words)])


def said(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().err.strip().splitlines()[-1]


def test_the_stored_fit_is_run(start: Path, requests: list[Any], tmp_path: Path) -> None:
    """The add-on is not enabled; the settings are read all the same, and stay in the saved file."""
    saved = tmp_path / "fitted.blend"
    assert not hasattr(bpy.types.Scene, "edgegrad")
    assert fit(start, "--save", saved) == 0
    (request,) = requests
    assert (request.iterations, request.samples, request.in_place) == (3, 2, True)
    assert request.names.base_color == ("Clay",) and not request.names.vertices
    assert [one.path for one in request.animated] == ['objects["Cube"].location[0]']
    assert request.pictures[0].image == "//target.exr"
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    edgegrad_addon.register()
    try:
        settings = bpy.context.scene.edgegrad
        assert settings.iterations == 3 and settings.parameters[0].sensitivity == 1.0
    finally:
        edgegrad_addon.unregister()


def test_arguments_change_parts_of_the_stored_fit(start: Path, requests: list[Any], tmp_path: Path) -> None:
    assert fit(start, "--save", tmp_path / "a.blend", "--iterations", 2, "--power", "Bulb", "--shape-key") == 0
    (request,) = requests
    assert (request.iterations, request.samples, request.in_place) == (2, 2, False)
    assert request.names.power == ("Bulb",) and not request.names.base_color and not request.animated


def test_a_file_has_the_options_of_the_command_line(start: Path, requests: list[Any], tmp_path: Path) -> None:
    setup = tmp_path / "setup.json"
    setup.write_text(json.dumps({
        "blend": str(start), "target": [f"Front={tmp_path / 'target.exr'}"], "base_color": ["Clay"], "power": "Bulb",
        "iterations": 5, "samples": 3, "vertex-step": 0.01, "in_place": True, "save": str(tmp_path / "b.blend"),
    }))  # fmt: skip
    assert fit("--setup", setup, "--iterations", 2) == 0
    (request,) = requests
    assert (request.iterations, request.samples, request.vertex_step, request.in_place) == (2, 3, 0.01, True)
    assert request.names.base_color == ("Clay",) and request.names.power == ("Bulb",) and not request.animated
    assert (tmp_path / "b.blend").exists()
    assert fit(start, "--setup", setup, "--base-color", "Marble") == 1  # a list is replaced, not extended


def test_files_have_lists_for_one_option_and_yield_to_what_excludes_theirs(tmp_path: Path) -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("blend", nargs="?")
    parser.add_argument("--values", nargs="+")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--one", action="store_true")
    where.add_argument("--other", action="store_true")
    setup = tmp_path / "setup.json"
    setup.write_text('{"values": ["color", "roughness"], "one": true}')
    found = parser.parse_args(with_setup(parser, ["--other", "a.blend"], setup))
    assert found.values == ["color", "roughness"] and found.blend == "a.blend" and found.other and not found.one


WRONG: dict[str, tuple[str, str]] = {
    "no JSON": ("{", "is no JSON"),
    "a list": ("[1]", "must be an object"),
    "unknown option": ('{"iteration": 3}', "there is no option 'iteration'; did you mean 'iterations'?"),
    "a text for a switch": ('{"in_place": "yes"}', "'in_place' is a switch"),
    "a list for one value": ('{"iterations": [3]}', "'iterations' must be a text or a number"),
    "an object": ('{"target": [{"camera": "Front"}]}', "'target' must be a text or a number or a list of them"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files_are_refused(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content, words = WRONG[name]
    (tmp_path / "setup.json").write_text(content)
    assert fit("--setup", tmp_path / "setup.json", "--save", tmp_path / "a.blend") == 2
    assert (line := said(capsys)).startswith("edgegrad: error: setup '") and words in line


def test_a_missing_file_and_wrong_values_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert fit("--setup", tmp_path / "none.json", "--save", tmp_path / "a.blend") == 2
    assert "none.json" in said(capsys)
    (tmp_path / "setup.json").write_text('{"iterations": 0}')
    assert fit("--setup", tmp_path / "setup.json", "--save", tmp_path / "a.blend") == 2
    assert "must be 1 or more" in said(capsys)
    assert fit("--iterations", "many", "--save", tmp_path / "a.blend") == 2
    assert "argument --iterations: must be a whole number, 1 or more, not 'many'" in said(capsys)


def test_progress_is_json_lines(start: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    saved = tmp_path / "fitted.blend"
    assert fit(start, "--json-progress", "--save", saved) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines() if line.startswith("{")]
    assert [line["event"] for line in lines] == ["begin", "step", "step", "step", "end"]
    assert lines[0]["iterations"] == 3 and 'objects["Cube"].location[0]' in lines[0]["parameters"]
    assert [line["iteration"] for line in lines[1:-1]] == [1, 2, 3] and lines[1]["loss"] == lines[-1]["first_loss"]
    assert lines[-1]["written"] == [str(saved)]
    assert fit(start, "--json-progress", "--save", saved, "--power", "Lamp") == 1
    last = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert last["event"] == "error" and "'Lamp'" in last["message"]


def test_fits_go_on_from_a_checkpoint(start: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted after the second of three iterations."""
    checkpoint, whole, resumed = (tmp_path / name for name in ("fit.npz", "whole.blend", "resumed.blend"))
    keep = ["--checkpoint", checkpoint, "--checkpoint-every", 1]
    assert fit(start, "--save", whole) == 0
    run = Session.run

    def interrupted(session: Session, callback: Any, **named: Any) -> Any:
        def stop(step: Any) -> None:
            if step.iteration == 3:
                raise KeyboardInterrupt

        return run(session, callback=stop, **named)

    bs.empty()  # the first fit has changed what is open
    with monkeypatch.context() as patch:
        patch.setattr(Session, "run", interrupted)
        assert fit(start, "--save", resumed, *keep) == 130
    assert read_checkpoint(checkpoint).iteration >= 2 and not resumed.exists()
    assert fit(start, "--save", resumed, *keep, "--resume") == 0
    found = []
    for path in (whole, resumed):
        bpy.ops.wm.open_mainfile(filepath=str(path))
        color = bs.shader(bpy.data.materials["Clay"]).inputs["Color"].default_value[:]
        found.append((color, bpy.data.objects["Cube"].location[:]))
        assert bpy.data.texts.get(TEXT) is None
    assert found[0] == found[1] and found[0][1][0] != 0.0


def test_names_are_tried_before_the_file_is_opened(start: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Here the .blend does not even exist."""
    missing, saved = start.with_name("missing.blend"), start.with_name("a.blend")
    for words, reason in ((["--checkpoint", "/nowhere/fit.npz"], "no folder"), (["--checkpoint", "a.txt"], ".npz"),
                          (["--resume"], "needs a --checkpoint")):  # fmt: skip
        assert fit(missing, "--save", saved, *words) == 1 and reason in said(capsys)
    assert fit(missing, "--save", saved) == 1 and "missing.blend" in said(capsys)


def test_a_fit_without_an_output_is_refused(start: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert fit(start, "--base-color", "Clay") == 2
    assert "would be lost: give --save" in said(capsys)


def test_a_file_that_blender_could_not_open_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Blender starts with its default scene then, which nobody wants to fit."""
    bs.empty(4)
    bs.camera()
    monkeypatch.setattr(sys, "argv", ["blender", "--background", "broken.blend", "--command", "edgegrad", "fit"])
    assert fit("--save", tmp_path / "a.blend", "--target", "Camera=a.png") == 1
    assert "file 'broken.blend': Blender has not opened it" in said(capsys)
    monkeypatch.setattr(sys, "argv", ["blender", "--background", "--command", "edgegrad", "render"])
    bs.add("Cube", bs.cube("Cube"))
    bs.world((0.2, 0.2, 0.2))
    assert command_line.main(["render", "--samples", "1", "--out", str(tmp_path / "a.png")]) == 0

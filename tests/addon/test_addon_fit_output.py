"""A fit's results are kept: outputs are tried before the fit, the .blend is saved first, no failure stops the rest."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import dataclasses
import errno
import hashlib
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import images
from edgegrad_addon import command_line
from edgegrad_addon.fit_output import picture_names
from edgegrad_addon.session import Session
from tests.support.scenes import blender_scenes as bs
from tests.support.scenes.disks import fill, names, small_disk

SIZE = 8


def saved(folder: Path, *cameras: str) -> Path:
    """A saved .blend with a square and these cameras, each at another height, and grey targets beside it."""
    bs.empty(SIZE)
    for number, name in enumerate(cameras):
        bs.camera((0, 0, 4 + 2 * number), name=name)
    bs.world((0.2, 0.2, 0.2))
    bs.add("Square", bs.plane("Square", 2.0, bs.material("Clay", (0.7, 0.3, 0.1))))
    images.write_image(folder / "target.exr", np.full((SIZE, SIZE, 3), 0.1))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"))
    return folder / "start.blend"


def fit(start: Path, *more: Any, cameras: tuple[str, ...] = ("Front",)) -> int:
    targets = [word for name in cameras for word in ("--target", f"{name}={start.parent / 'target.exr'}")]
    few = ["--base-color", "Clay", "--samples", "1", "--iterations", "2"]
    if "--save" not in more and "--out" not in more:
        few += ["--save", str(start.parent / "fitted.blend")]
    return command_line.main(["fit", str(start), *targets, *few, *map(str, more)])


def errors(capsys: Any) -> list[str]:
    """The error messages of the command line; any other output is a failure."""
    said = capsys.readouterr().err
    assert "Traceback" not in said
    return [line.removeprefix("edgegrad: error: ") for line in said.splitlines() if "error: " in line]


def is_fitted(blend: Path) -> bool:
    bpy.ops.wm.open_mainfile(filepath=str(blend), use_scripts=False)
    color = bs.shader(bpy.data.materials["Clay"]).inputs["Color"].default_value[:3]
    return not np.allclose(color, (0.7, 0.3, 0.1), atol=1e-4)


@pytest.fixture
def no_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fails where the fit is begun."""

    def run(*_: Any, **__: Any) -> Any:
        raise AssertionError("the fit was begun")

    monkeypatch.setattr(Session, "run", run)


WRONG = {
    "save into no folder": (["--save", "none/x.blend"],
                            "file 'none/x.blend': can't be written (there is no folder 'none')"),
    "save below a file": (["--save", "start.blend/x.blend"], "(there is no folder 'start.blend')"),
    "save as a folder": (["--save", "folder.blend"], "file 'folder.blend': can't be written (it is a folder)"),
    "save as a picture": (["--save", "x.png"], "file 'x.png': must end in .blend, not .png"),
    "save as nothing": (["--save", "x"], "file 'x': must end in .blend"),
    "out is a file": (["--out", "target.exr"], "folder 'target.exr': can't be written to ("),
    "out below a file": (["--out", "target.exr/deep"], "/target.exr' is not a folder)"),
    "picture is a folder": (["--out", "taken"], "file 'taken/after_Front.png': can't be written (it is a folder)"),
    "out replaces a target": (["--out", "mine", "--mask", "Front=mine/after_Front.exr"],
                              "file 'mine/after_Front.exr': is a target or a mask of this fit"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.usefixtures("no_fit")
def test_outputs_are_refused_before_the_fit(name: str, tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    start = saved(tmp_path, "Front")
    monkeypatch.chdir(tmp_path)
    Path("folder.blend").mkdir()
    Path("taken/after_Front.png").mkdir(parents=True)
    Path("mine").mkdir()
    images.write_image("mine/after_Front.exr", np.ones((SIZE, SIZE, 3)))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    more, words = WRONG[name]
    assert fit(start, *more) == 1
    said = errors(capsys)
    assert len(said) == 1 and words in said[0]
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


@pytest.mark.usefixtures("no_fit")
def test_disks_that_take_nothing_are_refused_before_the_fit(tmp_path: Path, capsys: Any) -> None:
    start = saved(tmp_path, "Front")
    with small_disk(tmp_path / "disk", 64) as disk:
        fill(disk)
        for more in (["--save", disk / "x.blend"], ["--out", disk / "out"]):
            assert fit(start, *more) == 1
            assert "No space left" in errors(capsys)[0]
        assert names(disk) == ["filler"]


@pytest.mark.parametrize("command", ["render", "gradient"])
def test_pictures_are_refused_before_they_are_rendered(command: str, tmp_path: Path, capsys: Any,
                                                       monkeypatch: Any) -> None:  # fmt: skip
    start = saved(tmp_path, "Front")
    monkeypatch.setattr(command_line, "render_export", None)
    monkeypatch.setattr(command_line, "derivative_picture", None)
    for out in ("x.tif", "none/x.png", "start.blend"):
        assert command_line.main([command, str(start), "--out", str(tmp_path / out)]) == 1
        assert f"{out}': " in errors(capsys)[0]


def test_a_picture_that_fails_loses_nothing_else(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    start = saved(tmp_path, "Front", "Back")
    write = images.write_image

    def fail(path: Any, *more: Any, **options: Any) -> None:
        if Path(path).name in ("after_Front.exr", "after_Front.png"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        write(path, *more, **options)

    monkeypatch.setattr(images, "write_image", fail)
    out, fitted = tmp_path / "out", tmp_path / "fitted.blend"
    assert fit(start, "--out", out, "--save", fitted, cameras=("Front", "Back")) == 1
    said = errors(capsys)
    assert len(said) == 2 and "after_Front.exr" in said[0] and "after_Front.png" in said[1]
    assert names(out) == ["after_Back.exr", "after_Back.png", *(f"before_{name}" for name in
                          ("Back.exr", "Back.png", "Front.exr", "Front.png")), "report.json"]  # fmt: skip
    assert is_fitted(fitted)


def test_pictures_that_cannot_be_rendered_lose_nothing_else(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    start, run = saved(tmp_path, "Front"), Session.run

    def run_out_of_memory(self: Session, *arguments: Any, **options: Any) -> Any:
        result = run(self, *arguments, **options)

        def fail(*_: Any, **__: Any) -> Any:
            raise MemoryError("no more")

        monkeypatch.setattr(edgegrad, "Renderer", fail)
        return result

    monkeypatch.setattr(Session, "run", run_out_of_memory)
    assert fit(start, "--out", tmp_path / "out", "--save", tmp_path / "fitted.blend") == 1
    assert errors(capsys) == ["the pictures after the fit can't be rendered (no more)"]
    assert "report.json" in names(tmp_path / "out") and is_fitted(tmp_path / "fitted.blend")


def fill_after_the_fit(monkeypatch: pytest.MonkeyPatch, disk: Path, leave: int) -> None:
    run = Session.run

    def run_and_fill(self: Session, *arguments: Any, **options: Any) -> Any:
        result = run(self, *arguments, **options)
        fill(disk, leave)
        return result

    monkeypatch.setattr(Session, "run", run_and_fill)


def test_the_fit_is_saved_before_pictures_fill_the_disk(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    start = saved(tmp_path, "Front")
    with small_disk(tmp_path / "disk", 1024) as disk:
        fill_after_the_fit(monkeypatch, disk, leave=start.stat().st_size + 8192)
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
        assert fit(start, "--out", disk, "--save", disk / "fitted.blend") == 1
        said = errors(capsys)
        assert said and all(str(disk / "after_Front") in line or "report.json" in line for line in said)
        assert not [name for name in names(disk) if name.startswith(".edgegrad") or name.endswith("@")]
        assert is_fitted(disk / "fitted.blend")


def test_a_full_disk_does_not_lose_the_fitted_scene(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    start = saved(tmp_path, "Front")
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    with small_disk(tmp_path / "disk", 1024) as disk:
        earlier = disk / "fitted.blend"
        earlier.write_bytes(start.read_bytes())
        digest = hashlib.sha256(earlier.read_bytes()).digest()
        fill_after_the_fit(monkeypatch, disk, leave=8192)
        assert fit(start, "--save", earlier) == 1
        assert names(disk) == ["filler", "fitted.blend"]
        assert hashlib.sha256(earlier.read_bytes()).digest() == digest
    said = errors(capsys)
    (rescued,) = (tmp_path / "temporary").rglob("fitted.blend")
    assert len(said) == 2 and f"file '{earlier}': can't be written" in said[0] and str(rescued) in said[1]
    assert is_fitted(rescued)


def test_no_space_anywhere_is_told_and_leaves_nothing(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    start = saved(tmp_path, "Front")
    with small_disk(tmp_path / "disk", 1024) as disk:
        monkeypatch.setattr(tempfile, "tempdir", str(disk))
        fill_after_the_fit(monkeypatch, disk, leave=8192)
        assert fit(start, "--save", disk / "fitted.blend", "--out", tmp_path / "out") == 1
        assert names(disk) == ["filler"]
    said = errors(capsys)
    assert len(said) == 2 and "fitted.blend'" in said[0] and "temporary folder" in said[1]
    assert "after_Front.png" in names(tmp_path / "out")


def test_a_closed_log_does_not_lose_the_fitted_scene(tmp_path: Path, monkeypatch: Any) -> None:
    """Messages go to a log that may be on the disk that is full."""

    class Closed:
        def write(self, text: str) -> int:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        flush = isatty = lambda self: False

    start, run = saved(tmp_path, "Front"), Session.run

    def run_with_note(self: Session, *arguments: Any, **options: Any) -> Any:
        result = run(self, *arguments, **options)
        return dataclasses.replace(result, notes=("something to say",))

    monkeypatch.setattr(Session, "run", run_with_note)
    monkeypatch.setattr("sys.stderr", Closed())
    code = fit(start, "--save", tmp_path / "fitted.blend")
    monkeypatch.undo()
    assert code == 0 and is_fitted(tmp_path / "fitted.blend")


def test_an_interrupt_between_the_files_tells_what_there_is(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    start = saved(tmp_path, "Front")
    write = images.write_image

    def interrupt(path: Any, *more: Any, **options: Any) -> None:
        if Path(path).name == "after_Front.png":
            raise KeyboardInterrupt
        write(path, *more, **options)

    monkeypatch.setattr(images, "write_image", interrupt)
    fitted = tmp_path / "fitted.blend"
    assert fit(start, "--out", tmp_path / "out", "--save", fitted) == 130
    said = capsys.readouterr().err.splitlines()[-1]
    assert "nothing was changed" not in said and "before_" not in said
    assert all(f"'{path}'" in said for path in (fitted, tmp_path / "out/report.json", tmp_path / "out/after_Front.exr"))
    assert is_fitted(fitted)


def test_cameras_do_not_share_pictures(tmp_path: Path) -> None:
    cameras = ("Cam 1", "Cam_1", "cam.1")
    start = saved(tmp_path, *cameras)
    out = tmp_path / "out"
    assert fit(start, "--out", out, cameras=cameras) == 0
    written = json.loads((out / "report.json").read_text())["pictures"]
    assert written["Cam_1"] == {when: [f"{when}_Cam_1.exr", f"{when}_Cam_1.png"] for when in ("before", "after")}
    every = [name for kinds in written.values() for pair in kinds.values() for name in pair]
    assert sorted([*every, "report.json"]) == names(out) and len({name.casefold() for name in every}) == 12
    # Cameras higher up see less of the square.
    bright = [images.read_image(out / written[name]["before"][0])[..., 0].sum() for name in cameras]
    assert bright[0] != bright[1] != bright[2]


def test_names_of_pictures_are_safe_and_never_equal() -> None:
    cameras = ["a b", "a/b", "a_b", "a_b_2", "A_B", "../x", "STRASSE", "straße", "\u00e9", "e\u0301"]
    cameras += ["相" * 85, "相" * 84 + "机"]
    found = picture_names(cameras)
    assert list(found) == cameras and found["a_b"] == "a_b" and found["a_b_2"] == "a_b_2"
    assert len({name.casefold() for name in found.values()}) == len(cameras)
    assert all(len(f"before_{name}.exr".encode()) <= 255 and not set(name) & set("/\\.:") for name in found.values())
    assert picture_names(["Front", "Back"]) == {"Front": "Front", "Back": "Back"}


def test_cameras_with_an_equals_sign_can_be_targeted(tmp_path: Path, capsys: Any) -> None:
    start = saved(tmp_path, "A", "A=b", "=")
    target = tmp_path / "x=y.exr"
    (tmp_path / "target.exr").rename(target)
    for texts, code in (([f"A=b={target}", f"A={target}", f"=={target}"], 0), (["A=b="], 1), (["A=b"], 1)):
        words = [word for text in texts for word in ("--target", text)]
        assert command_line.main(["fit", str(start), *words, "--base-color", "Clay", "--samples", "1", "--iterations",
                                  "1", "--out", str(tmp_path / "out")]) == code  # fmt: skip
        if code == 0:
            assert list(json.loads((tmp_path / "out/report.json").read_text())["pictures"]) == ["A=b", "A", "="]
    said = errors(capsys)
    assert "--target 'A=b=': must have the form CAMERA=FILE" in said[0] and "image 'b': " in said[1]

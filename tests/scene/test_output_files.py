"""Files are complete or as they were, whatever happens while they are written, and outputs are tried beforehand."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from edgegrad import images
from edgegrad.images.output_files import WriteError, check_output_folder, check_outputs, replacing
from tests.support.scenes.disks import file_size_limit, fill, kill_while_writing, make_read_only, names, small_disk

NOISE = np.random.default_rng(0).random((40, 50, 3)).astype(np.float32)
WRITERS: dict[str, Callable[[Path], Any]] = {
    "a.exr": lambda path: images.write_image(path, NOISE),
    "a.png": lambda path: images.write_image(path, NOISE),
    "change.png": lambda path: images.write_derivative(path, NOISE - 0.5),
}


@pytest.mark.parametrize("earlier", [None, b"what was there"])
@pytest.mark.parametrize("name", WRITERS)
def test_full_disk_leaves_the_earlier_file(name: str, earlier: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / name
    WRITERS[name](path)
    whole = path.read_bytes()
    path.unlink()
    if earlier is not None:
        path.write_bytes(earlier)
    for limit in (0, 1, len(whole) // 2, len(whole) - 1):
        said = rf"{path}'.*can't be written.*File too large"
        with file_size_limit(limit), pytest.raises(OSError, match=said) as raised:
            WRITERS[name](path)
        assert ".edgegrad" not in str(raised.value)
        assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == ([(name, earlier)] if earlier else [])
    with file_size_limit(len(whole)):
        WRITERS[name](path)
    assert path.read_bytes() == whole


KILLED = """
import sys, numpy
from edgegrad import images
images.write_image(sys.argv[1], numpy.random.default_rng(0).random((1500, 1500, 3)))
"""


@pytest.mark.parametrize("name", ["a.exr", "a.png"])
def test_killed_process_leaves_the_earlier_file(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    images.write_image(path, NOISE)
    earlier = path.read_bytes()
    kill_while_writing(KILLED, str(path), folder=tmp_path)
    assert path.read_bytes() == earlier


@pytest.mark.parametrize("error", [KeyboardInterrupt(), MemoryError(), ValueError("x"), OSError(errno.EIO, "broken")])
def test_nothing_is_left_of_what_was_given_up(error: BaseException, tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("earlier")
    kind = WriteError if isinstance(error, OSError) else type(error)
    with pytest.raises(kind) as raised, replacing(path) as temporary:
        temporary.write_text("half of it")
        temporary.with_name(f"{temporary.name}@").write_text("what the writer keeps beside it")
        raise error
    assert names(tmp_path) == ["a.txt"] and path.read_text() == "earlier"
    if isinstance(error, OSError):
        assert str(raised.value) == f"file '{path}': can't be written (broken)" and raised.value.errno == errno.EIO


def test_renaming_that_fails_is_told_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(WriteError, match="No space left"):
        images.write_image(tmp_path / "a.png", NOISE)
    monkeypatch.undo()
    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(WriteError, match="No space left"):
        images.write_image(tmp_path / "a.png", NOISE)
    assert names(tmp_path) == []


def test_links_and_permissions_stay(tmp_path: Path) -> None:
    behind, link = tmp_path / "behind.png", tmp_path / "link.png"
    images.write_image(behind, np.zeros((2, 2, 3)))
    behind.chmod(0o640)
    link.symlink_to(behind)
    images.write_image(link, NOISE)
    assert link.is_symlink() and images.read_image(behind).shape == NOISE.shape
    assert stat.S_IMODE(behind.stat().st_mode) == 0o640
    umask = os.umask(0o027)
    try:
        images.write_image(tmp_path / "new.png", NOISE)
    finally:
        os.umask(umask)
    assert stat.S_IMODE((tmp_path / "new.png").stat().st_mode) == 0o640


def test_protected_files_are_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"earlier")
    # Permissions don't bind the superuser, as whom tests may run.
    monkeypatch.setattr(os, "access", lambda file, mode: not (str(file) == str(path) and mode == os.W_OK))
    for write in (lambda: images.write_image(path, NOISE), lambda: check_outputs([path], (".png",))):
        with pytest.raises(WriteError, match="write-protected"):
            write()
    assert path.read_bytes() == b"earlier"


def place(tmp_path: Path, name: str) -> Path:
    """Places where nothing can be written, by what the message says of them."""
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "loop.png").symlink_to(tmp_path / "loop.png")
    return tmp_path / {
        "no folder": "none/a.png",
        "no folder ": "file/a.png",
        "is a folder": "folder.png",
        "symbolic links": "loop.png",
        "too long": "x" * 300 + ".png",
        "null character": "a\0b.png",
        "must end in .exr or .png, not .tif": "a.tif",
        "must end in .exr or .png": "picture",
    }[name]


PLACES = ["no folder", "no folder ", "is a folder", "symbolic links", "too long", "null character",
          "must end in .exr or .png, not .tif", "must end in .exr or .png"]  # fmt: skip


@pytest.mark.parametrize("name", PLACES)
def test_places_that_cannot_be_written_are_found_beforehand(name: str, tmp_path: Path) -> None:
    path = place(tmp_path, name)
    with pytest.raises(WriteError) as raised:
        check_outputs([tmp_path / "good.png", path], (".exr", ".png"))
    said = str(raised.value)
    assert said.startswith(f"file '{path}': ") and name.strip() in said.replace("there is no folder", "no folder")
    if name == "null character":
        with pytest.raises(ValueError, match=r"^image: path must be the path of a file, but is '.*a\\x00b\.png'$"):
            images.write_image(path, NOISE)
    elif "must end" not in name:
        with pytest.raises(WriteError) as raised:
            images.write_image(path, NOISE)
        assert str(raised.value) == said
    assert not list(tmp_path.glob(".edgegrad*")) and not (tmp_path / "good.png").exists()


def test_folders_are_tried_beforehand(tmp_path: Path) -> None:
    check_output_folder(tmp_path / "new" / "deep")
    check_output_folder(tmp_path)
    assert names(tmp_path) == []
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "out"):
        with pytest.raises(WriteError, match=rf"folder '{path}': .*/file' is not a folder"):
            check_output_folder(path)


def test_full_and_read_only_disks_are_found_beforehand(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", 64) as disk:
        check_outputs([disk / "a.png"], (".png",))
        with pytest.raises(WriteError, match=r"a\.exr'.*No space left"):
            images.write_image(disk / "a.exr", np.random.default_rng(0).random((200, 200, 3)))
        assert names(disk) == []
        fill(disk)
        for check in (lambda: check_outputs([disk / "a.png"], (".png",)), lambda: check_output_folder(disk / "new")):
            with pytest.raises(WriteError, match="No space left"):
                check()
        assert names(disk) == ["filler"]
        make_read_only(disk)
        with pytest.raises(WriteError, match="Read-only"):
            check_outputs([disk / "a.png"], (".png",))

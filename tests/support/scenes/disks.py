"""Disks on which writing fails, and processes that are killed while they write."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest


@contextlib.contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """Within the block no file of this process can grow beyond `size` bytes: writing fails as on a full disk."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextlib.contextmanager
def small_disk(folder: Path, kilobytes: int) -> Iterator[Path]:
    """A disk of its own in a new folder; skips the test where disks can't be mounted."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        mounted = False
    if not mounted:
        pytest.skip("needs the right to mount a disk")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def fill(folder: Path, leave: int = 0) -> None:
    """Fill the disk that the folder is on, but for `leave` bytes."""
    filler = folder / "filler"
    with filler.open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(1024))
    os.truncate(filler, filler.stat().st_size - leave)


def make_read_only(disk: Path) -> None:
    """Turn a `small_disk` into one that can only be read."""
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)


def names(folder: Path) -> list[str]:
    """All that is in a folder."""
    return sorted(path.name for path in folder.iterdir())


def kill_while_writing(script: str, *arguments: str, folder: Path) -> None:
    """Run a Python script, and kill it as soon as any file in the folder has changed and isn't empty."""
    before = _sizes(folder)
    with subprocess.Popen([sys.executable, "-c", script, *arguments]) as process:
        while process.poll() is None and not any(size and before.get(name) != size for name, size in
                                                 _sizes(folder).items()):  # fmt: skip
            time.sleep(0.001)
        process.kill()
    assert process.returncode == -signal.SIGKILL, "it ended before anything was seen of its file"


def _sizes(folder: Path) -> dict[str, int]:
    out = {}
    for path in folder.iterdir():
        with contextlib.suppress(FileNotFoundError):
            out[path.name] = path.stat().st_size
    return out

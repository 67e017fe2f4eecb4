"""The path of a newcomer from Install from Disk to the first finished fit, on Blender's default scene.

Each step is what its clicks do; the seconds are Blender's own, without those of a hand. The names of the steps say
which clicks and keys they need.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, status
from tests.gui.window import OUT, Script, call, open_tab, redraw, shot

FOUND: dict[str, Any] = {"steps": []}


def step(what: str, clicks: int, work: Callable[[], Script]) -> Generator[float, None, None]:
    """Do a step, and note its clicks and seconds."""
    began = time.monotonic()
    yield from work()
    FOUND["steps"].append({"what": what, "clicks": clicks, "seconds": round(time.monotonic() - began, 2)})
    shot(f"{len(FOUND['steps'])}")


def install() -> Script:
    """Install the extension as the file browser of Install from Disk does."""
    (file,) = Path(os.environ["BLENDER_GUI_DATA"]).glob("*.zip")
    bpy.ops.extensions.package_install_files("EXEC_DEFAULT", filepath=str(file), repo="user_default",
                                             enable_on_install=True)  # fmt: skip
    yield 0.0


def fit() -> Script:
    """Press Fit, and wait for its end."""
    assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}
    yield from ended()


def pressed(operator: Callable[[], Any]) -> Callable[[], Script]:
    """Return a step of one operator, until it is drawn."""

    def work() -> Script:
        assert operator() == {"FINISHED"}
        yield from redraw(0.1)

    return work


def main() -> Script:
    """Go the path."""
    yield from redraw(1.0)
    yield from step("Edit, Preferences, Get Extensions, menu, Install from Disk, double click on the file, close", 8,
                    install)  # fmt: skip
    stage.write_target()  # the newcomer's photograph
    yield from step("N in the 3D view, tab Edgegrad", 2, lambda: open_tab("Edgegrad"))
    yield from step("Open Target Picture, double click on the file", 3, pressed(
        lambda: call(bpy.ops.edgegrad.target_open, "EXEC_DEFAULT", filepath=stage.TARGET)))  # fmt: skip
    yield from step("Match Materials and Lights", 1, pressed(
        lambda: call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="MATERIALS")))  # fmt: skip
    yield from step("Fit, until it has finished", 1, fit)
    FOUND["said"], FOUND["failed"], FOUND["color"] = status().said, status().failed, [*stage.color().default_value]
    FOUND["clicks"] = sum(one["clicks"] for one in FOUND["steps"])
    FOUND["seconds"] = sum(one["seconds"] for one in FOUND["steps"])
    FOUND["size"] = stage.SIZE
    (OUT / "front.exr").unlink()

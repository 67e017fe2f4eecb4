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
from tests.gui.window import OUT, Script, area, call, key, open_tab, redraw, region, shot, wait_for, window

FOUND: dict[str, Any] = {"steps": []}


def step(what: str, clicks: int, work: Callable[[], Script]) -> Generator[float, None, None]:
    """Do a step, and note its clicks and seconds."""
    began = time.monotonic()
    yield from work()
    FOUND["steps"].append({"what": what, "clicks": clicks, "seconds": round(time.monotonic() - began, 2)})
    shot(f"{len(FOUND['steps'])}")


def install() -> Script:
    """Install the extension as the dialog does that Blender opens for a zip dropped on its window."""
    (file,) = Path(os.environ["BLENDER_GUI_DATA"]).glob("*.zip")
    bpy.ops.extensions.package_install_files("EXEC_DEFAULT", filepath=str(file), repo="user_default",
                                             enable_on_install=True)  # fmt: skip
    yield 0.0


def drop() -> Script:
    """Drop the picture on the tab, as Blender does, and choose from the menu of all that takes pictures there."""
    from bl_ext.user_default.edgegrad.panel.targets import DroppedPictures  # type: ignore[import-not-found]

    folder, name = os.path.split(stage.TARGET)
    for kind, takes in (("WINDOW", False), ("UI", True)):
        with bpy.context.temp_override(window=window(), area=area(), region=region(kind)):
            assert DroppedPictures.poll_drop(bpy.context) is takes, kind
    with bpy.context.temp_override(window=window(), area=area(), region=region()):
        bpy.ops.wm.drop_import_file("INVOKE_DEFAULT", directory=folder, files=[{"name": name}])
    yield from redraw(0.3)
    shot("menu")
    key("u")
    yield from wait_for(lambda: len(bpy.context.scene.edgegrad.targets) == 1)
    yield from redraw(0.1)


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
    yield from step("drop the zip on Blender's window, OK", 2, install)
    stage.write_target()  # the newcomer's photograph
    yield from step("N in the 3D view, tab Edgegrad", 2, lambda: open_tab("Edgegrad"))
    yield from step("drop the picture on the tab, Use as Edgegrad Target", 2, drop)
    yield from step("Match Materials and Lights", 1, pressed(
        lambda: call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="MATERIALS")))  # fmt: skip
    yield from step("Fit, until it has finished", 1, fit)
    FOUND["said"], FOUND["failed"], FOUND["color"] = status().said, status().failed, [*stage.color().default_value]
    FOUND["clicks"] = sum(one["clicks"] for one in FOUND["steps"])
    FOUND["seconds"] = sum(one["seconds"] for one in FOUND["steps"])
    FOUND["size"] = stage.SIZE
    (OUT / "front.exr").unlink()

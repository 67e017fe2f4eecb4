"""Every way in which a fit ends: what is written, what is said, and that Blender stays usable until then."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, fitting, opened, status, values
from tests.gui.window import Script, call, holds, key, open_tab, over_viewport, redraw, shot, wait_for

FOUND: dict[str, Any] = {}


def ending(name: str, act: Callable[[], Any], picture: bool = True) -> Script:
    """Do something while a fit runs that must end it without a change of values."""
    yield from opened()
    yield from open_tab("Edgegrad")
    before = values()
    yield from fitting()
    act()
    yield from ended()
    yield from redraw()
    if picture:
        shot(f"ended-{name}")
    FOUND[name] = {"said": status().said, "failed": status().failed, "same": values() == before,
                   "color": values()["color"] == before["color"], "keys": keys()}  # fmt: skip


def keys() -> int:
    """Number of the cube's shape keys."""
    ob = bpy.data.objects.get("Cube") or bpy.data.objects.get("Box")
    return 0 if ob is None or ob.data.shape_keys is None else len(ob.data.shape_keys.key_blocks)


def press(*names: str) -> Callable[[], None]:
    """Make an action of key presses over the 3D view."""

    def act() -> None:
        over_viewport()
        key(*names)

    return act


def rename() -> None:
    """Rename the cube."""
    stage.cube().name = "Box"


def stopping() -> Script:
    """Stop keeps the best values; one undo restores every value."""
    for name, properties in (("stop", False), ("stop properties", True)):
        yield from opened()
        if properties:
            call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="CAMERA")
            bpy.ops.ed.undo_push(message="Set up")
        before = values()
        yield from fitting()
        call(bpy.ops.edgegrad.fit_stop)
        yield from ended()
        changed = values() != before
        said = status().said
        press("ctrl+z")()
        undone = yield from holds(partial(stage.is_as, before))
        FOUND[name] = {"said": said, "changed": changed, "undone": undone}


def usable() -> Script:
    """While a fit runs, Blender selects, saves and refuses a second fit; a paused fit makes no step but the present."""
    yield from opened()
    yield from fitting()
    written = Path(stage.BLEND).stat().st_mtime_ns
    over_viewport()
    key("alt+a")
    yield from holds(lambda: not any(ob.select_get() for ob in bpy.context.view_layer.objects))
    selected = [ob.name for ob in bpy.context.view_layer.objects if ob.select_get()]
    key("ctrl+s")
    saved = yield from holds(lambda: Path(stage.BLEND).stat().st_mtime_ns > written)
    call(bpy.ops.edgegrad.fit_pause)
    count = len(status().job.losses)
    yield from redraw(3.0)
    shot("paused")
    waits = len(status().job.losses) <= count + 1
    call(bpy.ops.edgegrad.fit_pause)
    yield from wait_for(lambda: len(status().job.losses) > count + 1)
    FOUND["usable"] = {"selected": selected, "saved": saved, "waits": waits,
                       "second": bpy.ops.edgegrad.fit.poll(), "runs": status().job is not None}  # fmt: skip
    key("Escape")
    yield from ended()


def rendering() -> Script:
    """Esc ends a render and a gradient."""
    for operator in ("render", "gradient"):
        yield from opened()
        before = values()
        call(getattr(bpy.ops.edgegrad, operator), samples=1 << 20)
        yield 1.0
        runs = status().job is not None
        press("Escape")()
        yield from ended()
        FOUND[operator] = {"runs": runs, "said": status().said, "same": values() == before}


def main() -> Script:
    """Run all of them."""
    yield from redraw(1.0)
    stage.save()
    yield from ending("escape", press("Escape"))
    yield from ending("undo", press("ctrl+z"))
    yield from ending("edit mode", press("Tab"))
    yield from ending("delete", lambda: call(bpy.ops.object.delete, "EXEC_DEFAULT"))
    yield from ending("rename", rename)
    yield from ending("move", lambda: setattr(stage.cube(), "location", (1.0, 0.0, 0.0)))
    yield from stopping()
    yield from usable()
    yield from rendering()
    yield from ending("open", lambda: bpy.ops.wm.open_mainfile(filepath=stage.BLEND))
    yield from ending("new", lambda: bpy.ops.wm.read_homefile(), picture=False)
    yield from opened()
    before = values()
    yield from fitting()
    bpy.ops.preferences.addon_disable(module=stage.ADDON)
    yield from redraw(1.0)
    shot("disabled")
    threads = [thread.name for thread in threading.enumerate() if thread.name == "edgegrad"]
    FOUND["disable"] = {"threads": threads, "same": values() == before}
    bpy.ops.preferences.addon_enable(module=stage.ADDON)
    yield from redraw(1.0)
    FOUND["enable"] = {"said": status().said, "can start": bpy.ops.edgegrad.fit.poll()}

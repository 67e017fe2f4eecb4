"""Steers Blender's window from a script in it: real key presses and clicks, pictures of the screen.

A script is a generator that yields the seconds to wait, so that Blender draws and handles events between its steps;
`start` runs it from a timer. Screenshots are the X server's, since Blender's own are black with software OpenGL.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import time
import traceback
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import bpy

OUT = Path(os.environ.get("BLENDER_GUI_OUT", "."))
Script = Iterator[float]


def log(*words: Any) -> None:
    """Print to Blender's log."""
    print("SCRIPT:", *words, flush=True)


def _run(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def window() -> Any:
    """Return Blender's first window."""
    return bpy.context.window_manager.windows[0]


def area(kind: str = "VIEW_3D") -> Any:
    """Return the first area of a kind."""
    return next(one for one in window().screen.areas if one.type == kind)


def region(kind: str = "UI") -> Any:
    """Return a region of the 3D view."""
    return next(one for one in area().regions if one.type == kind)


def call(operator: Any, mode: str = "INVOKE_DEFAULT", **properties: Any) -> set[str]:
    """Call an operator as a button of the 3D view does."""
    with bpy.context.temp_override(window=window(), area=area(), region=region("WINDOW")):
        return set(operator(mode, **properties))


def refused(operator: Any, **properties: Any) -> str:
    """Call an operator that must refuse; return what it says."""
    try:
        call(operator, **properties)
    except RuntimeError as error:
        return str(error)
    raise AssertionError(f"{operator} does not refuse")


def work() -> float:
    """Return the seconds of the processor that Blender has used, in all of its threads."""
    return time.process_time()


def within(condition: Callable[[], Any], limit: float, every: float = 0.1) -> Generator[float, None, bool]:
    """Wait until a condition holds, but not for more work than a limit; return whether it holds.

    The condition is asked at intervals of some seconds. The limit is in seconds of the processor, so that a busy
    machine does not reach it sooner; a tenth of each interval counts too, since a process that hangs does not work.
    """
    end, asked = work() + limit, 0
    while not condition():
        asked += 1
        if work() + 0.1 * every * asked > end:
            return False
        yield every
    return True


def wait_for(condition: Callable[[], Any], limit: float = 300.0, every: float = 0.1) -> Script:
    """Wait until a condition holds, as `within`; it is an error if it does not."""
    if not (yield from within(condition, limit, every)):
        raise TimeoutError(f"not within {limit} s of the processor: {condition}")


def redraw(seconds: float = 0.5) -> Script:
    """Redraw everything."""
    for one in window().screen.areas:
        one.tag_redraw()
    yield seconds


def holds(condition: Callable[[], Any], limit: float = 20.0) -> Generator[float, None, bool]:
    """Return whether a condition comes to hold after a key press, whose event may still be under way."""
    found = yield from within(condition, limit)
    yield from redraw()
    return found and bool(condition())


def shot(name: str) -> None:
    """Save a picture of the screen; a blank one is an error."""
    path = OUT / f"{name}.png"
    _run("import", "-window", "root", str(path))
    if int(_run("identify", "-format", "%k", str(path))) < 16:
        raise RuntimeError(f"blank screenshot {path}")


def point(x: float, y: float) -> None:
    """Move the pointer to a pixel of the window, counted from its lower left corner."""
    _run("xdotool", "mousemove", str(int(x)), str(int(window().height - 1 - y)))


def over_viewport() -> None:
    """Move the pointer over the 3D view."""
    view = area()
    point(view.x + 0.3 * view.width, view.y + 0.3 * view.height)


def key(*names: str) -> None:
    """Press keys by their X names, such as 'Escape' or 'ctrl+z'."""
    _run("xdotool", "key", *names)


def open_tab(name: str) -> Script:
    """Show a tab of the sidebar."""
    area().spaces.active.show_region_ui = True

    def shown() -> bool:
        area().tag_redraw()
        with contextlib.suppress(TypeError):  # not drawn yet
            region().active_panel_category = name
        return bool(region().active_panel_category == name)

    yield from redraw()
    yield from wait_for(shown)
    yield from redraw()


def start(script: Script, found: dict[str, Any]) -> None:
    """Run a script, write what it has found as JSON, and quit Blender."""

    def step() -> float | None:
        status = "error"
        try:
            return next(script)
        except StopIteration:
            status = "ok"
        except BaseException:
            traceback.print_exc()
            shot("error")
        for name, text in (("found.json", json.dumps(found, indent=1)), ("status.txt", status + "\n")):
            (OUT / name).write_text(text)
        bpy.ops.wm.quit_blender()
        return None

    (OUT / "status.txt").write_text("unfinished\n")
    bpy.app.timers.register(step, first_interval=1.0, persistent=True)

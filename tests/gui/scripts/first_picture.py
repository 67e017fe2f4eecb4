"""What the first picture of a rendered view takes: wall-clock and processor time of its parts, for several switches."""

from __future__ import annotations

import sys
import time
from typing import Any

import bpy

from tests.gui.window import Script, area, redraw, wait_for

FOUND: dict[str, Any] = {"switches": []}
SWITCHES = 5
_parts: dict[str, dict[str, float]] = {}


def timed(owner: Any, name: str, label: str) -> None:
    """Note the first call of a function after each switch."""
    plain = getattr(owner, name)

    def call_it(*arguments: Any, **options: Any) -> Any:
        wall, cpu = time.monotonic(), time.thread_time()
        try:
            return plain(*arguments, **options)
        finally:
            ended = time.monotonic()
            _parts.setdefault(label, {"seconds": ended - wall, "processor": time.thread_time() - cpu, "ended": ended})

    setattr(owner, name, call_it)


def main() -> Script:
    """Switch to the rendered view and back."""
    addon = next(name for name in sys.modules if name.endswith(".render_engine.view")).rpartition(".view")[0]
    view, thread, drawing = (sys.modules[f"{addon}.{name}"] for name in ("view", "view_thread", "drawing"))
    timed(view, "export_evaluated", "export")
    timed(thread.ViewThread, "_following", "tables and BVH")
    timed(thread.edgegrad.Progressive, "add", "samples")
    timed(drawing.Picture, "draw", "upload and drawing")
    scene, shading = bpy.context.scene, area().spaces.active.shading
    scene.render.engine = "EDGEGRAD"
    yield from redraw(1.0)
    for _ in range(SWITCHES):
        shading.type = "SOLID"
        yield from redraw(0.7)
        _parts.clear()
        begin = time.monotonic()
        shading.type = "RENDERED"
        yield from wait_for(lambda: "upload and drawing" in _parts, every=0.002)
        ends = {label: part.pop("ended") - begin for label, part in _parts.items()}
        FOUND["switches"].append({"seconds": ends["upload and drawing"], "parts": dict(_parts)})
        yield from redraw(1.0)

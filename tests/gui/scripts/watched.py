"""What a rendered view of Edgegrad costs a fit that runs beside it: seconds of an iteration, with and without the view.

Blocks of iterations of one fit are timed in turns, since other processes disturb single ones. A fit of a material's
color stays in the engine; one of a property has Blender evaluated in each iteration, which a rendered view hears of.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Generator
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, fitting, opened, status
from tests.gui.window import Script, area, call, redraw, wait_for

FOUND: dict[str, Any] = {}
TURNS = 5
# Iterations of a block, by kind of fit.
KINDS = {"engine's own": 30, "properties": 8}
_spent = {"update": 0.0, "draw": 0.0, "samples": 0.0}


def timed(owner: Any, name: str, label: str) -> None:
    """Add the seconds of each call of a function."""
    plain: Callable[..., Any] = getattr(owner, name)

    def call_it(*arguments: Any, **options: Any) -> Any:
        began = time.monotonic()
        try:
            return plain(*arguments, **options)
        finally:
            _spent[label] += time.monotonic() - began

    setattr(owner, name, call_it)


def block(shading: str, steps: int) -> Generator[float, None, dict[str, float]]:
    """Return the mean seconds of an iteration, and those of the view's parts, while the view is shaded so."""
    area().spaces.active.shading.type = shading
    yield from redraw(0.5)
    for label in _spent:
        _spent[label] = 0.0
    count, began, work = len(status().job.losses), time.monotonic(), time.process_time()
    yield from wait_for(lambda: status().job is None or len(status().job.losses) >= count + steps)
    done = len(status().job.losses) - count
    return {"seconds": (time.monotonic() - began) / done, "processor": (time.process_time() - work) / done,
            **{label: spent / done for label, spent in _spent.items()}}  # fmt: skip


def compared(name: str) -> Script:
    """Compare a fit's iterations in turns."""
    yield from fitting()
    blocks: dict[str, list[dict[str, float]]] = {"SOLID": [], "RENDERED": []}
    for _ in range(TURNS):
        for shading, found in blocks.items():
            found.append((yield from block(shading, KINDS[name])))
    area().spaces.active.shading.type = "SOLID"
    call(bpy.ops.edgegrad.cancel)
    yield from ended()
    FOUND[name] = {shading: {part: statistics.median(one[part] for one in found) for part in found[0]}
                   for shading, found in blocks.items()}  # fmt: skip
    FOUND[name]["ratio"] = statistics.median(
        watched["seconds"] / alone["seconds"]
        for alone, watched in zip(blocks["SOLID"], blocks["RENDERED"], strict=True))  # fmt: skip


def main() -> Script:
    """Compare both kinds of fits."""
    addon = next(name for name in sys.modules if name.endswith(".render_engine.view")).rpartition(".view")[0]
    view, thread = sys.modules[f"{addon}.view"], sys.modules[f"{addon}.view_thread"]
    timed(view.View, "update", "update")
    timed(view.View, "draw", "draw")
    timed(thread.edgegrad.Progressive, "add", "samples")
    yield from redraw(1.0)
    stage.save()
    for name in KINDS:
        yield from opened()
        bpy.context.scene.render.engine = "EDGEGRAD"
        if name == "properties":
            call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="CAMERA")
        bpy.context.scene.edgegrad.iterations = 10_000
        yield from compared(name)

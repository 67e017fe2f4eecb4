"""What the tab costs: the processor's seconds of drawing it with many parameters, and of its updates during a fit."""

from __future__ import annotations

import statistics
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, fitting, opened, status
from tests.gui.window import Script, call, open_tab, redraw

FOUND: dict[str, Any] = {}
PARAMETERS, REDRAWS, STEPS = 50, 40, 60
_spent: dict[str, list[float]] = defaultdict(list)


def timed(owner: Any, name: str) -> None:
    """Note the seconds of the main thread's processor in each call of a function."""
    plain: Callable[..., Any] = getattr(owner, name)
    label = f"{getattr(owner, '__name__', owner)}.{name}"

    def call_it(*arguments: Any) -> Any:
        begin = time.thread_time()
        try:
            return plain(*arguments)
        finally:
            _spent[label].append(time.thread_time() - begin)

    def draw(self: Any, context: Any) -> None:  # Blender passes as many arguments as the function has
        call_it(self, context)

    setattr(owner, name, draw if isinstance(owner, type) else call_it)


def main() -> Script:
    """Draw the tab idle, then during a fit."""
    from bl_ext.user_default.edgegrad import registration  # type: ignore[import-not-found]
    from bl_ext.user_default.edgegrad.running import current, overlay  # type: ignore[import-not-found]

    yield from redraw(1.0)
    stage.save()
    yield from opened()
    yield from open_tab("Edgegrad")
    settings = bpy.context.scene.edgegrad
    for k in range(PARAMETERS - len(settings.parameters)):
        row = settings.parameters.add()
        row.kind, row.owner, row.path, row.index = "PROPERTY", stage.cube(), "location", k % 3
        row.enabled = False
    for cls in registration.CLASSES:
        if issubclass(cls, bpy.types.Panel):  # whose lists are drawn within
            for name in ("draw", "draw_header_preset"):
                if name in cls.__dict__:
                    timed(cls, name)
    timed(current, "poll")
    timed(overlay, "_draw")
    for _ in range(REDRAWS):
        yield from redraw(0.05)
    draws = len(_spent["FitPanel.draw"])
    FOUND["idle, ms"] = {name: 1e3 * total / max(draws, 1) for name, total in totals().items()}
    FOUND["idle draws"] = draws
    settings.show_shapes = True
    settings.parameters.clear()
    stage.cube()
    call(bpy.ops.edgegrad.parameters_add, "EXEC_DEFAULT", of="VERTICES")
    _spent.clear()
    begin = time.monotonic()
    yield from fitting(STEPS)
    FOUND["fit, s"] = time.monotonic() - begin
    FOUND["updates, s"] = totals()
    FOUND["share"] = sum(totals().values()) / FOUND["fit, s"]
    call(bpy.ops.edgegrad.cancel)
    yield from ended()
    assert status().job is None


def totals() -> dict[str, float]:
    """Seconds of all calls of each function; that of a usual call times their number, against disturbances."""
    return {name: statistics.median(times) * len(times) for name, times in _spent.items()}

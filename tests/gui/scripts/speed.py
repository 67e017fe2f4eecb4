"""What the tab costs: the processor's seconds of drawing it with many parameters, and of its updates during a fit.

Between two redraws, software OpenGL fills the processor's caches with the window's pixels, which makes the next draw
two to four times as slow as where a graphics card draws. Each panel is therefore drawn some more times in the same
redraw (*warm*), and so is Blender's own panel *Transform* of the properties editor, which is written in Python too.
"""

from __future__ import annotations

import statistics
import time
from collections import defaultdict
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, fitting, opened, status
from tests.gui.window import Script, area, call, open_tab, redraw

FOUND: dict[str, Any] = {}
PARAMETERS, REDRAWS, STEPS = 50, 40, 60
REPEATS = 8
_spent: dict[str, list[float]] = defaultdict(list)
_warm: dict[str, list[float]] = defaultdict(list)


def timed(owner: Any, name: str) -> None:
    """Note the seconds of the main thread's processor in each call of a function."""
    plain: Any = owner.__dict__[name] if name == "poll" else getattr(owner, name)
    label = f"{getattr(owner, '__name__', owner)}.{name}"

    def call_it(*arguments: Any) -> Any:
        time.thread_time()  # whose own first call takes microseconds, too
        begin = time.thread_time()
        try:
            return plain(*arguments)
        finally:
            _spent[label].append(time.thread_time() - begin)

    def draw(self: Any, context: Any) -> Any:  # Blender passes as many arguments as the function has
        out = call_it(self, context)
        begin = time.thread_time()
        for _ in range(REPEATS):
            plain(self, context)
        _warm[label].append((time.thread_time() - begin) / REPEATS)
        return out

    if isinstance(plain, classmethod):
        plain = plain.__func__
        setattr(owner, name, classmethod(draw))
    else:
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
        # Lists are drawn within. Those of the render engine are elsewhere.
        if issubclass(cls, bpy.types.Panel) and cls.bl_space_type == "VIEW_3D":
            for name in ("draw", "draw_header_preset", "poll"):
                if name in cls.__dict__:
                    timed(cls, name)
    transform = bpy.types.OBJECT_PT_transform
    timed(transform, "draw")
    area("PROPERTIES").spaces.active.context = "OBJECT"
    timed(current, "poll")
    timed(overlay, "_draw")
    for _ in range(REDRAWS):
        yield from redraw(0.05)
    draws = len(_spent["FitPanel.draw"])
    FOUND["idle draws"] = draws
    for kind, times in (("idle", _spent), ("idle, warm", _warm)):
        costs = {name: 1e3 * total / max(draws, 1) for name, total in totals(times).items()}
        reference = costs.pop(f"{transform.__name__}.draw")
        polls = sum(cost for name, cost in costs.items() if name.endswith(".poll"))
        FOUND[f"{kind}, ms"] = {"drawing": sum(costs.values()) - polls, "polls": polls, "Transform": reference} | costs
    settings.show_shapes = True
    settings.parameters.clear()
    stage.cube()
    call(bpy.ops.edgegrad.parameters_add, "EXEC_DEFAULT", of="VERTICES")
    _spent.clear()
    begin = time.monotonic()
    yield from fitting(STEPS)
    FOUND["fit, s"] = time.monotonic() - begin
    FOUND["updates, s"] = totals(_spent)
    FOUND["share"] = sum(FOUND["updates, s"].values()) / FOUND["fit, s"]
    call(bpy.ops.edgegrad.cancel)
    yield from ended()
    assert status().job is None


def totals(spent: dict[str, list[float]]) -> dict[str, float]:
    """Seconds of all calls of each function; that of a usual call times their number, against disturbances."""
    return {name: statistics.median(times) * len(times) for name, times in spent.items()}

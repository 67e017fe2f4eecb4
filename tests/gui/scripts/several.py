"""Several windows and scenes, linked objects, and Esc at random moments."""

from __future__ import annotations

import random
from functools import partial
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, fitting, opened, status, values
from tests.gui.window import OUT, Script, call, key, over_viewport, redraw, refused, shot, wait_for

FOUND: dict[str, Any] = {}
# Of the escapes: their number, and their longest wait in iterations and in seconds after those.
ESCAPES, ITERATIONS, LONGEST = 24, 3, 0.5


def _has_made(steps: int) -> bool:
    """Whether the fit has made so many iterations."""
    return len(status().job.losses) >= steps


def escapes() -> Script:
    """Esc a random time after the start, also before the first iteration has ended."""
    chance = random.Random(7)
    yield from opened()
    before, said = values(), set()
    for _ in range(ESCAPES):
        assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}
        count = chance.randrange(ITERATIONS + 1)
        yield from wait_for(partial(_has_made, count), every=0.02)
        yield chance.uniform(0.0, LONGEST)
        over_viewport()
        key("Escape")
        yield from ended()
        said.add(status().said)
    FOUND["escapes"] = {"same": values() == before, "said": sorted(said)}


def windows() -> Script:
    """A second window with another scene of the same file leaves the fit of the first alone; closing it, too."""
    from bl_ext.user_default.edgegrad.running import overlay  # type: ignore[import-not-found]

    yield from opened()
    before = values()
    bpy.context.scene.edgegrad.show_shapes = True
    yield from fitting()
    bpy.ops.wm.window_new_main()  # whose scene is its own
    yield from redraw(1.0)
    second = bpy.context.window_manager.windows[1]
    with bpy.context.temp_override(window=second):
        bpy.ops.scene.new(type="EMPTY")
    yield from redraw(1.0)
    count = len(status().job.losses)
    shot("two-windows")
    drawn = [overlay.is_drawn_in(window.scene) for window in bpy.context.window_manager.windows]
    with bpy.context.temp_override(window=second):
        other = bpy.context.scene.name
        refuses = not bpy.ops.edgegrad.fit.poll()
        bpy.ops.wm.window_close()
    yield from redraw(1.0)
    FOUND["windows"] = {"other": other, "refuses": refuses, "runs": status().job is not None, "steps": count,
                        "drawn": drawn}  # fmt: skip
    call(bpy.ops.edgegrad.cancel)
    yield from ended()
    FOUND["windows"]["same"] = values() == before
    bpy.data.scenes.remove(bpy.data.scenes[other])


def scenes() -> Script:
    """The result goes to the scene that the fit was started in, though the window shows another one."""
    yield from opened()
    before = values()
    first = bpy.context.scene
    yield from fitting()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.scene.new(type="EMPTY")
    for row in first.edgegrad.parameters:
        row.sensitivity = -1.0
    yield from redraw(1.0)
    status().job.end("best")
    yield from ended()
    said = status().said
    bpy.context.window_manager.windows[0].scene = first
    yield from redraw(1.0)
    FOUND["scenes"] = {"said": said, "failed": status().failed, "changed": values() != before,
                       "effects": [row.sensitivity for row in first.edgegrad.parameters]}  # fmt: skip


def linked() -> Script:
    """What is linked from another file is refused."""
    yield from opened()
    library = str(OUT / "library.blend")
    away = bpy.data.objects.new("Away", stage.cube().data.copy())
    bpy.data.libraries.write(library, {away})
    bpy.data.objects.remove(away)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects = ["Away"]
    ob = wanted.objects[0]
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == ob)
    bpy.context.view_layer.objects.active = ob
    FOUND["linked"] = {"sculpt": refused(bpy.ops.edgegrad.set_up, task="SCULPT"),
                       "field": refused(bpy.ops.edgegrad.fit_as_field)}  # fmt: skip


def main() -> Script:
    """Run all of them."""
    yield from redraw(1.0)
    stage.save()
    for part in (escapes, windows, scenes, linked):
        yield from part()

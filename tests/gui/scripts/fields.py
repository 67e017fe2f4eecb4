"""A fit as a field: from the button to the written mesh, undone, and ended by Esc."""

from __future__ import annotations

from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, opened, status
from tests.gui.window import Script, call, holds, key, open_tab, over_viewport, redraw, shot, wait_for

FOUND: dict[str, Any] = {}


def hidden() -> dict[str, bool]:
    """Which objects are hidden in renders."""
    return {ob.name: bool(ob.hide_render) for ob in bpy.context.scene.objects}


def fitting() -> Script:
    """Press the button, and wait for a shape in the viewport."""
    assert call(bpy.ops.edgegrad.fit_as_field) == {"RUNNING_MODAL"}
    yield from wait_for(lambda: status().job is None or (status().job.session.field.newest is not None
                        and len(status().job.losses) > 2))  # fmt: skip


def main() -> Script:
    """Fit the cube as a field."""
    yield from redraw(1.0)
    stage.save()
    yield from opened()
    settings = bpy.context.scene.edgegrad
    settings.iterations, settings.samples, settings.field_resolution = 12, 4, 24
    bpy.ops.ed.undo_push(message="Start")
    yield from open_tab("Edgegrad")
    before = hidden()
    yield from fitting()
    yield from redraw(1.0)
    yield from redraw(1.0)  # panels that have grown move the others in steps
    shot("field-running")
    yield from ended()
    yield from redraw(1.0)
    shot("field-finished")
    made = [ob for ob in bpy.context.scene.objects if ob.name not in before]
    FOUND["fit"] = {"said": status().said, "failed": status().failed, "made": [ob.name for ob in made],
                    "faces": [len(ob.data.polygons) for ob in made], "hidden": hidden()}  # fmt: skip
    over_viewport()
    key("ctrl+z")
    FOUND["undone"] = yield from holds(lambda: hidden() == before)
    stage.cube()
    yield from fitting()
    over_viewport()
    key("Escape")
    yield from ended()
    FOUND["escape"] = {"said": status().said, "same": hidden() == before}

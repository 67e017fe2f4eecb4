"""A tour of the tab: pictures of each state, and of each error with its cure."""

from __future__ import annotations

from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, status
from tests.gui.window import OUT, Script, call, open_tab, redraw, refused, shot, wait_for

FOUND: dict[str, Any] = {}


def obstacle() -> list[str]:
    """What is in the way of a fit, and the operator that cures it."""
    from bl_ext.user_default.edgegrad.preflight import obstacle as found  # type: ignore[import-not-found]

    one = found(bpy.context)
    return [] if one is None else [one.sentence, one.operator]


def pictured(name: str) -> Script:
    """Save a picture of the screen when it is drawn."""
    yield from redraw(0.7)
    yield from redraw(0.7)  # panels that have grown move the others in steps
    shot(name)


def errors() -> Script:
    """Show each obstacle."""
    scene, settings = bpy.context.scene, bpy.context.scene.edgegrad
    FOUND["no target"] = obstacle()
    scene.render.resolution_x = 1920
    call(bpy.ops.edgegrad.target_add, "EXEC_DEFAULT")
    FOUND["no picture"] = obstacle()
    yield from pictured("error-no-picture")
    settings.targets[0].image = "//nowhere.png"
    FOUND["missing picture"] = obstacle()
    yield from pictured("error-missing-picture")
    settings.targets[0].image = stage.TARGET
    scene.render.resolution_y = 1920
    FOUND["other aspect"] = obstacle()
    yield from pictured("error-other-aspect")
    call(bpy.ops.edgegrad.match_render, "EXEC_DEFAULT")
    FOUND["no parameter"] = obstacle()
    yield from pictured("error-no-parameter")
    stage.cube()
    call(bpy.ops.edgegrad.parameters_add, "EXEC_DEFAULT", of="VERTICES")
    FOUND["ready"] = obstacle()
    bpy.ops.object.mode_set(mode="EDIT")
    FOUND["edit mode"] = obstacle()
    yield from pictured("error-edit-mode")
    bpy.ops.object.mode_set(mode="OBJECT")
    settings.targets.clear()
    settings.parameters.clear()


def main() -> Script:
    """Take the tour."""
    yield from redraw(1.0)
    scene, settings = bpy.context.scene, bpy.context.scene.edgegrad
    stage.write_target()
    yield from open_tab("Edgegrad")
    yield from pictured("idle")
    yield from errors()
    # The first fit in three clicks: picture, task, Fit.
    scene.render.resolution_x = 1920
    call(bpy.ops.edgegrad.target_open, "EXEC_DEFAULT", filepath=stage.TARGET)
    yield from pictured("target")
    call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="MATERIALS")
    FOUND["set up"] = status().said
    yield from pictured("ready")
    settings.iterations, settings.samples = 80, 8
    assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}
    yield from wait_for(lambda: status().job is None or len(status().job.losses) > 40)
    yield from pictured("running")
    yield from ended()
    FOUND["fit"], FOUND["color"] = status().said, [*stage.color().default_value]
    yield from pictured("finished")
    FOUND["sensitivities"] = [row.sensitivity for row in settings.parameters]
    FOUND["no armature"] = refused(bpy.ops.edgegrad.set_up, task="POSE")
    FOUND["images"] = [image.name for image in bpy.data.images if image.is_dirty]
    FOUND["pictures"] = sorted(path.name for path in OUT.glob("*.png"))

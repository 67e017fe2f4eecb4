"""What people do besides: each part does something unusual around a short fit, and notes what came of it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, fitting, opened, status, values
from tests.gui.window import (
    OUT,
    Script,
    area,
    call,
    holds,
    key,
    open_tab,
    over_viewport,
    redraw,
    shot,
    wait_for,
    window,
    within,
)

FOUND: dict[str, Any] = {}
STEPS = 6


def settings() -> Any:
    """The scene's settings."""
    return bpy.context.scene.edgegrad


def obstacle() -> str:
    """What is in the way of a fit."""
    from bl_ext.user_default.edgegrad.preflight import obstacle as found  # type: ignore[import-not-found]

    one = found(bpy.context)
    return "" if one is None else f"{one.sentence} [{one.label}]"


def prepared() -> Script:
    """Open the scene, with a fit of few steps."""
    yield from opened()
    yield from open_tab("Edgegrad")
    settings().iterations, settings().uncertainty = STEPS, False
    bpy.ops.ed.undo_push(message="Start")


def fitted(name: str) -> Script:
    """Run a whole fit, and note how it ended."""
    assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}, name
    yield from ended()
    yield from redraw()
    FOUND[name] = {"said": status().said, "failed": status().failed}


def undo_twice() -> Script:
    """Two fits, two undos, two redos."""
    yield from prepared()
    states = [values()]
    for name in ("first", "second"):
        yield from fitted(name)
        states.append(values())
    steps = []
    for keys, expected in (("ctrl+z", states[1]), ("ctrl+z", states[0]), ("ctrl+shift+z", states[1]),
                           ("ctrl+shift+z", states[2])):  # fmt: skip
        over_viewport()
        key(keys)
        steps.append((yield from holds(partial(stage.is_as, expected))))
    FOUND["undo"] = {"different": states[0] != states[1] != states[2], "steps": steps,
                     "keys": [key.name for key in stage.cube().data.shape_keys.key_blocks]}  # fmt: skip
    shot("odd-undo")


def renamed() -> Script:
    """Names of datablocks change between and while; rows hold the datablocks."""
    yield from prepared()
    stage.cube().name, bpy.data.materials["Material"].name = "Kasten 'é", "Lack"
    bpy.context.scene.camera.name = "Kamera"
    yield from redraw()
    yield from fitted("renamed before")
    stage_color = bpy.data.materials["Lack"].node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    FOUND["renamed before"]["color"] = [*stage_color.default_value]
    FOUND["renamed before"]["rows"] = [row.name for row in settings().parameters]
    settings().iterations = 10_000
    for label, edit in (("material", lambda: setattr(bpy.data.materials["Lack"], "name", "Farbe")),
                        ("scene", lambda: setattr(bpy.context.scene, "name", "Szene")),
                        ("world", lambda: setattr(bpy.context.scene.world, "name", "Welt")),
                        ("light data", lambda: setattr(bpy.data.lights["Light"], "name", "Licht"))):
        yield from fitting(1)
        edit()
        yield from within(lambda: status().job is None or status().job.ending is not None, 3.0)
        job = status().job
        FOUND[f"renamed {label}"] = {"goes on": job is not None and job.ending is None}
        if job is not None:
            call(bpy.ops.edgegrad.cancel)
        yield from ended()
        FOUND[f"renamed {label}"]["said"] = status().said


def deleted() -> Script:
    """Datablocks of rows and targets are deleted while nothing runs; the panel tells, and its cure works."""
    for label, delete in (("camera", lambda: bpy.data.objects.remove(bpy.context.scene.camera)),
                          ("cube", lambda: bpy.data.objects.remove(bpy.data.objects["Cube"])),
                          ("unlinked cube", lambda: bpy.context.scene.collection.children[0].objects.unlink(
                              bpy.data.objects["Cube"])),
                          ("material", lambda: bpy.data.materials.remove(bpy.data.materials["Material"])),
                          ("light data", lambda: bpy.data.lights.remove(bpy.data.lights["Light"])),
                          ("world", lambda: bpy.data.worlds.remove(bpy.context.scene.world))):  # fmt: skip
        yield from prepared()
        delete()
        yield from redraw()
        told = obstacle()
        shot(f"odd-deleted-{label.replace(' ', '-')}")
        if not told:
            yield from fitted(f"deleted {label}")
        else:
            FOUND[f"deleted {label}"] = {"obstacle": told, "rows": [row.name for row in settings().parameters]}


def pictures() -> Script:
    """The file of a target is replaced, removed and brought back, before and while a fit runs."""
    yield from prepared()
    settings().iterations = 10_000
    kept = stage.TARGET + ".kept"
    shutil.copy(stage.TARGET, kept)
    yield from fitting(1)
    (OUT / "front.exr").unlink()
    yield from redraw(1.0)
    FOUND["file removed during"] = {"runs": status().job is not None, "obstacle": obstacle()}
    call(bpy.ops.edgegrad.fit_stop)
    yield from ended()
    FOUND["file removed during"]["said"] = status().said
    (OUT / "front.exr").write_bytes(b"no picture")
    yield from redraw(1.5)
    FOUND["damaged file"] = obstacle()
    shutil.move(kept, stage.TARGET)
    yield from redraw(1.5)
    FOUND["file back"] = obstacle()


def png_targets() -> Script:
    """A PNG that Blender has saved with AgX as target: the fit reads it by the same view transform."""
    yield from prepared()
    scene = bpy.context.scene
    scene.render.engine = "EDGEGRAD"
    scene.edgegrad_render.samples = 64
    scene.view_settings.view_transform = "AgX"
    scene.render.filepath = str(OUT / "agx.png")
    stage.color().default_value = (0.1, 0.4, 0.8, 1.0)
    bpy.ops.render.render(write_still=True)
    stage.color().default_value = (0.8, 0.8, 0.8, 1.0)
    settings().targets[0].image = str(OUT / "agx.png")
    for row in settings().parameters:
        row.enabled = row.kind == "BASE_COLOR"
    settings().iterations = 60
    yield from redraw(1.0)
    FOUND["agx obstacle"] = obstacle()
    yield from fitted("agx")
    FOUND["agx"] |= {"view": settings().targets[0].view, "color": [*stage.color().default_value],
                     "notes": [*status().notes]}  # fmt: skip


def surroundings() -> Script:
    """Things in Blender's window while a fit runs that must not end it."""
    yield from prepared()
    settings().iterations = 10_000
    before = values()
    acts: tuple[tuple[str, Callable[[], Any]], ...] = (
        ("closed sidebar", lambda: setattr(area().spaces.active, "show_region_ui", False)),
        ("opened sidebar", lambda: setattr(area().spaces.active, "show_region_ui", True)),
        ("local view", lambda: call(bpy.ops.view3d.localview, "EXEC_DEFAULT")),
        ("full screen", lambda: call(bpy.ops.screen.screen_full_area, "EXEC_DEFAULT")),
        ("back", lambda: call(bpy.ops.screen.back_to_previous, "EXEC_DEFAULT")),
        ("other workspace", lambda: setattr(window(), "workspace", bpy.data.workspaces["Scripting"])),
        ("first workspace", lambda: setattr(window(), "workspace", bpy.data.workspaces["Layout"])),
        ("saved as", lambda: bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "other.blend"))),
        ("new object", lambda: bpy.ops.mesh.primitive_monkey_add(location=(9.0, 9.0, 9.0))),
        ("frame", lambda: bpy.context.scene.frame_set(7)),
        ("resolution", lambda: setattr(bpy.context.scene.render, "resolution_percentage", 50)),
        ("removed row", lambda: settings().parameters.remove(0)),
        ("removed target", lambda: settings().targets.clear()),
        ("auto save", lambda: bpy.ops.wm.save_mainfile()),
    )
    yield from fitting(1)
    for label, act in acts:
        problem = ""
        try:
            act()
        except Exception as error:  # which is what is looked for
            problem = str(error)
        yield from redraw(0.7)
        FOUND.setdefault("surroundings", {})[label] = {"runs": status().job is not None, "problem": problem,
                                                       "said": status().said}  # fmt: skip
        if status().job is None:
            break
    if status().job is not None:
        status().job.end("best")
        yield from ended()
        FOUND["surroundings"]["end"] = {"said": status().said, "failed": status().failed,
                                        "changed": values()["color"] != before["color"]}  # fmt: skip
    shot("odd-surroundings")


def rendered() -> Script:
    """F12 while a fit of properties runs, and a rendered view of Edgegrad; the fit waits and goes on."""
    yield from prepared()
    scene = bpy.context.scene
    scene.render.engine = "EDGEGRAD"
    scene.edgegrad_render.samples = 256
    call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="CAMERA")
    settings().iterations = 10_000
    area().spaces.active.shading.type = "RENDERED"
    yield from fitting(2)
    yield from redraw(1.0)
    shot("odd-rendered-view")
    call(bpy.ops.render.render, use_viewport=False)
    yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"))
    count = len(status().job.losses) if status().job is not None else -1
    yield from wait_for(lambda: status().job is None or len(status().job.losses) > count + 1)
    FOUND["render beside"] = {"runs": status().job is not None, "said": status().said}
    if status().job is not None:
        call(bpy.ops.edgegrad.fit_stop)
    yield from ended()
    FOUND["render beside"]["end"] = status().said
    yield from redraw(1.0)
    shot("odd-rendered-end")


def main() -> Script:
    """Do all of them; what fails is noted, and the next goes on."""
    yield from redraw(1.0)
    stage.save()
    for part in (undo_twice, renamed, deleted, pictures, png_targets, surroundings, rendered):
        try:
            yield from part()
        except Exception as error:
            FOUND[f"{part.__name__} error"] = repr(error)
            shot(f"odd-error-{part.__name__}")
            if status().job is not None:
                status().job.end("restore")
                yield from ended()

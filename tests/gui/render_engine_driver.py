# mypy: ignore-errors
"""Runs in Blender with a window, started by test_render_engine.py: rendered views and renders of the demo scene.

It prints one line "MEASURED name value" for each measurement, in seconds or bytes.
"""

import os
import pathlib
import statistics
import sys
import time

import bpy
import numpy as np
from blender_gui_lib import ARGS, OUT, area, key, log, override, redraw, shot, start, wait_for
from mathutils import Quaternion

from edgegrad import images

ADDON = next(name for name in sys.modules if name.endswith(".render_engine.view")).rpartition(".render_engine")[0]
render_engine = sys.modules[f"{ADDON}.render_engine.view"]
drawing = sys.modules[f"{ADDON}.render_engine.drawing"]

UPDATES = int(os.environ.get("EDGEGRAD_GUI_UPDATES", "1000"))
SAMPLES = 16
drawn = []  # (time, picture) of each drawing


def watch_drawing():
    plain = drawing.Picture.draw

    def draw(self, engine, scene, shown, width, height):
        plain(self, engine, scene, shown, width, height)
        drawn.append((time.monotonic(), shown))

    drawing.Picture.draw = draw
    for name in ("update", "draw"):
        setattr(render_engine.View, name, timed(getattr(render_engine.View, name), name))


def timed(function, name):
    """Log the first calls of a function of Blender's main thread: seconds, and seconds of its processor."""
    calls = []

    def call(*arguments):
        wall, cpu = time.monotonic(), time.thread_time()
        out = function(*arguments)
        calls.append(None)
        if len(calls) <= 3:
            log(f"{name} {len(calls)}: {time.monotonic() - wall:.4f} s, processor {time.thread_time() - cpu:.4f} s")
        return out

    return call


def measured(name, value):
    print("MEASURED", name, f"{value:.4f}", flush=True)


def memory():
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def space():
    return area().spaces.active


def after(edit, count=1):
    """yield from after(edit): seconds from an edit to the drawing of the first picture of what it has made."""
    times = []
    for k in range(count):
        yield 0.1
        last = drawn[-1][1].request if drawn else None
        begin, at = time.monotonic(), len(drawn)
        edit(k)
        times.append((yield from first_of_another(last, at)) - begin)
    return statistics.median(times)


def first_of_another(request, at):
    """yield from first_of_another(...): when a picture of another request was drawn, from this drawing on."""
    def found():
        return [t for t, shown in drawn[at:] if shown.request is not request]

    yield from wait_for(found, 20, 0.002)
    return found()[0]


def switch_to_rendered():
    scene = bpy.context.scene
    scene.render.engine = "EDGEGRAD"
    scene.edgegrad_render.preview_samples = SAMPLES
    begin, at = time.monotonic(), len(drawn)
    space().shading.type = "RENDERED"
    yield from wait_for(lambda: len(drawn) > at, 20, 0.002)
    return drawn[at][0] - begin


def complete():
    yield from redraw(0.5)  # so that the view asks for what it shows now
    yield from wait_for(lambda: drawn[-1][1].samples >= SAMPLES, 300)
    yield from redraw(0.5)


def edits():
    sculpt, key_light = bpy.data.objects["Sculpt"], bpy.data.lights["Key"]
    clay = bpy.data.materials["Clay"].node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    points = np.empty(len(sculpt.data.vertices) * 3, np.float32)
    sculpt.data.vertices.foreach_get("co", points)

    def move_vertices(k):
        sculpt.data.vertices.foreach_set("co", points * (1.0 + 0.02 * (k + 1)))
        sculpt.data.update()

    def turn(k):
        rotation = space().region_3d.view_rotation.copy()
        rotation.rotate(Quaternion((0, 0, 1), 0.1))
        space().region_3d.view_rotation = rotation

    return {
        "transform": lambda k: setattr(sculpt.location, "x", 0.1 * (k + 1)),
        "material": lambda k: setattr(clay, "default_value", (0.1 * k, 0.4, 0.2, 1.0)),
        "light": lambda k: setattr(key_light, "energy", 100.0 + 50.0 * k),
        "vertices": move_vertices,
        "view": turn,
    }


def many_updates():
    """yield from many_updates(): growth of the memory over many edits and redraws, after some that fill caches."""
    sculpt = bpy.data.objects["Sculpt"]
    sizes = []
    for k in range(UPDATES + 100):
        sculpt.location.z = 1.6 + 0.2 * np.sin(0.1 * k)
        if k % 10 == 0:
            space().region_3d.view_distance *= 1.0 + 0.01 * (-1) ** (k // 10)
        yield 0.01
        if k >= 100 and (k - 100) % 100 == 0:
            sizes.append(memory())
    sizes.append(memory())
    log("memory, MB", [round(size / 1e6, 1) for size in sizes])
    return sizes[-1] - sizes[0]


def render(samples, cancel_after=None):
    """yield from render(n): F12, until it ends; returns its picture without view transform."""
    scene = bpy.context.scene
    scene.edgegrad_render.samples = samples
    with override("WINDOW"):
        bpy.ops.render.render("INVOKE_DEFAULT", use_viewport=False)
    yield 0.3
    if cancel_after is not None:
        yield cancel_after
        shot("6-rendering")
        begin = time.monotonic()
        key("Escape")
        yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"), 20, 0.01)
        measured("cancel", time.monotonic() - begin)
    yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"), 120)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    path = pathlib.Path(OUT) / "frame.exr"
    bpy.data.images["Render Result"].save_render(str(path))
    return images.read_image(path)[..., :3]


def views():
    measured("first picture", (yield from switch_to_rendered()))
    measured("first picture again", (yield from again()))
    yield from complete()
    shot("1-view")
    for name, edit in edits().items():
        measured(name, (yield from after(edit, 7)))
    yield from complete()
    shot("2-edited")
    for number, perspective in enumerate(("CAMERA", "ORTHO", "PERSP"), 3):
        space().region_3d.view_perspective = perspective
        bpy.context.scene.render.film_transparent = perspective == "PERSP"
        yield from complete()
        shot(f"{number}-{perspective.lower()}")
    bpy.context.scene.render.film_transparent = False


def updates():
    yield from switch_to_rendered()
    measured("memory", (yield from many_updates()))


def frames():
    scene = bpy.context.scene
    space().shading.type = "SOLID"
    scene.render.engine = "EDGEGRAD"
    found = yield from render(32)
    export = sys.modules[f"{ADDON}.export"]
    made = export.export_scene(scene)
    expected = export.render_export(made.scene, made.settings, 32)
    assert np.array_equal(found, expected), "the render is not the picture"
    log("the render is the picture")
    yield from render(1 << 20, cancel_after=2.0)
    yield from redraw(0.5)
    shot("7-cancelled")


def main():
    """Run the parts that are named, or all."""
    watch_drawing()
    yield from redraw(1.0)
    log("Blender", bpy.app.version_string)
    for part in (views, updates, frames):
        if not ARGS or part.__name__ in ARGS:
            yield from part()
    log("ALL WELL")


def again():
    space().shading.type = "SOLID"
    yield from redraw(0.5)
    return (yield from switch_to_rendered())


start(main())

"""Rendered views and F12 of the demo scene: seconds from an edit to its picture, memory over many updates, equal bits.

All figures are in seconds but `memory`, which is in bytes.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Quaternion

from edgegrad import images
from tests.gui.window import OUT, Script, area, call, key, log, redraw, shot, wait_for

FOUND: dict[str, Any] = {}
UPDATES = int(os.environ.get("EDGEGRAD_GUI_UPDATES", "1000"))
SAMPLES = 16


class Drawn(NamedTuple):
    """A drawing of a picture. Pictures themselves are not kept, since their memory is measured."""

    at: float
    request: Any
    samples: int


drawn: list[Drawn] = []


def watch_drawing(addon: str) -> None:
    """Note each drawing, and the seconds of Blender's main thread in the first calls of the engine."""
    picture = sys.modules[f"{addon}.render_engine.drawing"].Picture
    view = sys.modules[f"{addon}.render_engine.view"].View
    plain = picture.draw

    def draw(self: Any, engine: Any, scene: Any, shown: Any, width: int, height: int) -> None:
        plain(self, engine, scene, shown, width, height)
        drawn.append(Drawn(time.monotonic(), shown.request, shown.samples))

    picture.draw = draw
    for name in ("update", "draw"):
        setattr(view, name, timed(getattr(view, name), name))


def timed(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """Log the first calls of a function of Blender's main thread: seconds, and seconds of its processor."""
    calls: list[None] = []

    def call_it(*arguments: Any) -> Any:
        wall, cpu = time.monotonic(), time.thread_time()
        out = function(*arguments)
        calls.append(None)
        if len(calls) <= 3:
            log(f"{name} {len(calls)}: {time.monotonic() - wall:.4f} s, processor {time.thread_time() - cpu:.4f} s")
        return out

    return call_it


def memory() -> int:
    """Bytes that the process has in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def space() -> Any:
    """The 3D view."""
    return area().spaces.active


def after(edit: Callable[[int], None], count: int) -> Generator[float, None, float]:
    """Seconds from an edit to the drawing of the first picture of what it has made: the median of several edits."""
    times = []
    for k in range(count):
        yield 0.1
        last = drawn[-1].request if drawn else None
        begin, at = time.monotonic(), len(drawn)
        edit(k)
        times.append((yield from first_of_another(last, at)) - begin)
    return statistics.median(times)


def first_of_another(request: Any, at: int) -> Generator[float, None, float]:
    """When a picture of another request was drawn, from this drawing on."""

    def found() -> list[float]:
        return [one.at for one in drawn[at:] if one.request is not request]

    yield from wait_for(found, every=0.002)
    return found()[0]


def switch_to_rendered() -> Generator[float, None, float]:
    """Seconds from the switch to the first picture."""
    scene = bpy.context.scene
    scene.render.engine = "EDGEGRAD"
    scene.edgegrad_render.preview_samples = SAMPLES
    begin, at = time.monotonic(), len(drawn)
    space().shading.type = "RENDERED"
    yield from wait_for(lambda: len(drawn) > at, every=0.002)
    return drawn[at].at - begin


def again() -> Generator[float, None, float]:
    """Seconds to the first picture after a switch to another shading and back."""
    space().shading.type = "SOLID"
    yield from redraw(0.5)
    return (yield from switch_to_rendered())


def complete() -> Script:
    """Wait until the picture has all samples."""
    yield from redraw(0.5)  # so that the view asks for what it shows now
    yield from wait_for(lambda: drawn[-1].samples >= SAMPLES)
    yield from redraw(0.5)


def edits() -> dict[str, Callable[[int], None]]:
    """Edits of several kinds, by name; each takes the number of the edit."""
    sculpt, key_light = bpy.data.objects["Sculpt"], bpy.data.lights["Key"]
    clay = bpy.data.materials["Clay"].node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    points = np.empty(len(sculpt.data.vertices) * 3, np.float32)
    sculpt.data.vertices.foreach_get("co", points)

    def move_vertices(k: int) -> None:
        sculpt.data.vertices.foreach_set("co", points * (1.0 + 0.02 * (k + 1)))
        sculpt.data.update()

    def turn(k: int) -> None:
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


def many_updates() -> Generator[float, None, int]:
    """Growth of the memory over many edits of a place and a material, and orbits, after some that fill caches."""
    sculpt, edit = bpy.data.objects["Sculpt"], edits()
    sizes = []
    for k in range(UPDATES + 100):
        if k % 3 == 0:
            sculpt.location.z = 1.6 + 0.2 * np.sin(0.1 * k)
        elif k % 3 == 1:
            edit["material"](k // 3 % 10)
        else:
            edit["view"](k)
        yield 0.01
        del drawn[:-1]
        if k >= 100 and (k - 100) % 100 == 0:
            sizes.append(memory())
    sizes.append(memory())
    log("memory, MB", [round(size / 1e6, 1) for size in sizes])
    return sizes[-1] - sizes[0]


def render(samples: int, cancel_after: float | None = None) -> Generator[float, None, Any]:
    """F12, until it ends; return its picture without view transform."""
    scene = bpy.context.scene
    scene.edgegrad_render.samples = samples
    call(bpy.ops.render.render, use_viewport=False)
    yield 0.3
    if cancel_after is not None:
        yield cancel_after
        shot("6-rendering")
        begin = time.monotonic()
        key("Escape")
        yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"), every=0.01)
        FOUND["cancel"] = time.monotonic() - begin
    yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"))
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    path = OUT / "frame.exr"
    bpy.data.images["Render Result"].save_render(str(path))
    return images.read_image(path)[..., :3]


def views() -> Script:
    """Measure the first pictures and edits, and take pictures of each kind of view."""
    FOUND["first picture"] = yield from switch_to_rendered()
    FOUND["first picture again"] = yield from again()
    yield from complete()
    shot("1-view")
    for name, edit in edits().items():
        FOUND[name] = yield from after(edit, 7)
    yield from complete()
    shot("2-edited")
    for number, perspective in enumerate(("CAMERA", "ORTHO", "PERSP"), 3):
        space().region_3d.view_perspective = perspective
        bpy.context.scene.render.film_transparent = perspective == "PERSP"
        yield from complete()
        shot(f"{number}-{perspective.lower()}")
    bpy.context.scene.render.film_transparent = False
    yield from panoramas()


def panoramas() -> Script:
    """Take pictures of views through a fisheye, and through a panorama that can't be rendered."""
    lens = bpy.context.scene.camera.data
    before, space().region_3d.view_perspective = lens.type, "CAMERA"
    lens.type = "PANO"
    setting = lens if hasattr(lens, "panorama_type") else lens.cycles
    setting.panorama_type = "FISHEYE_EQUIDISTANT"
    yield from complete()
    shot("8-fisheye")
    setting.panorama_type = "MIRRORBALL"
    yield from redraw(1.0)
    shot("9-refused")
    lens.type, space().region_3d.view_perspective = before, "PERSP"
    yield from complete()


def frames(addon: str) -> Script:
    """Compare F12 with a render of the export, and cancel a long one."""
    scene = bpy.context.scene
    space().shading.type = "SOLID"
    scene.render.engine = "EDGEGRAD"
    found = yield from render(32)
    export = sys.modules[f"{addon}.export"]
    made = export.export_scene(scene)
    FOUND["equal bits"] = bool(np.array_equal(found, export.render_export(made.scene, made.settings, 32)))
    yield from render(1 << 20, cancel_after=2.0)
    yield from redraw(0.5)
    shot("7-cancelled")


def main() -> Script:
    """Measure views, updates and renders."""
    addon = next(name for name in sys.modules if name.endswith(".render_engine.view")).rpartition(".render_engine")[0]
    watch_drawing(addon)
    yield from redraw(1.0)
    log("Blender", bpy.app.version_string)
    yield from views()
    FOUND["memory"] = yield from many_updates()
    yield from frames(addon)

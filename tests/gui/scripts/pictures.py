"""The pictures and the film of the documentation: a monkey's head is fitted to a picture of a fatter one."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, status
from tests.gui.window import OUT, Script, area, call, open_tab, over_viewport, redraw, shot, wait_for

FOUND: dict[str, Any] = {}
SIZE = 200, 150
ITERATIONS, PICTURED_AT = 60, 30
FRAME_EVERY, FRAME_WIDTH, FRAME_SECONDS = 3, 640, 0.25


def head() -> Any:
    """Replace the cube by a monkey's head that looks at the camera."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_monkey_add(size=3.0, location=(0.0, 0.0, 0.2), rotation=(0.0, 0.0, 0.8))
    ob = bpy.context.view_layer.objects.active
    ob.data.shade_smooth()
    clay = bpy.data.materials.new("Clay")
    clay.diffuse_color = (0.8, 0.45, 0.3, 1.0)
    clay.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.45, 0.3, 1.0)
    ob.data.materials.append(clay)
    return ob


def filmed() -> Script:
    """Take pictures of the 3D view and the panel while the fit runs, and make a film of them."""
    from PIL import Image

    view = area()
    top = bpy.context.window_manager.windows[0].height - view.y - view.height
    box = view.x, top, view.x + view.width, top + view.height
    frames: list[Image.Image] = []
    done = 0
    while status().job is not None:
        count = len(status().job.losses)
        if count >= done + FRAME_EVERY or (not frames and count > 1):
            done = count
            name = "running" if count >= PICTURED_AT and not (OUT / "running.png").exists() else "frame"
            shot(name)
            with Image.open(OUT / f"{name}.png") as screen:
                part = screen.convert("RGB").crop(box)
            size = FRAME_WIDTH, round(FRAME_WIDTH * part.height / part.width)
            frames.append(part.resize(size, Image.Resampling.LANCZOS))
        yield 0.1
    (OUT / "frame.png").unlink()
    milliseconds = int(1000 * FRAME_SECONDS)
    frames[0].save(OUT / "fit.webp", save_all=True, append_images=frames[1:], loop=0, quality=70, method=6,
                   duration=[milliseconds] * (len(frames) - 1) + [8 * milliseconds])  # fmt: skip
    FOUND["frames"] = len(frames)


def main() -> Script:
    """Fit the head's shape and its light, with pictures on the way."""
    from edgegrad import images

    yield from redraw(1.0)
    scene, settings = bpy.context.scene, bpy.context.scene.edgegrad
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.camera.data.lens = 70.0
    bpy.data.lights["Light"].energy = 1500.0
    ob = head()
    thin = np.array([vertex.co for vertex in ob.data.vertices], np.float32)
    fat = thin * (1.0 + 0.25 * np.exp(-6.0 * (thin[:, 2:] + 0.4) ** 2) * np.array([1.0, 0.6, 0.2]))
    ob.data.vertices.foreach_set("co", fat.astype(np.float32).ravel())
    ob.data.update()
    call(bpy.ops.edgegrad.render, "EXEC_DEFAULT", samples=64)
    made = bpy.data.images["Edgegrad Render"]
    pixels = np.array(made.pixels[:], np.float32).reshape(SIZE[1], SIZE[0], 4)
    images.write_image(stage.TARGET, pixels[::-1, :, :3])
    bpy.data.images.remove(made)
    ob.data.vertices.foreach_set("co", thin.ravel())
    ob.data.update()
    call(bpy.ops.edgegrad.target_open, "EXEC_DEFAULT", filepath=stage.TARGET)
    call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="SCULPT")
    bpy.data.objects["Light"].select_set(True)
    call(bpy.ops.edgegrad.parameters_add, "EXEC_DEFAULT", of="POWER")
    settings.active_parameter = 0
    settings.iterations, settings.samples = ITERATIONS, 4
    scene.cycles.max_bounces = 2
    status().said = ""
    yield from open_tab("Edgegrad")
    area().spaces.active.region_3d.view_perspective = "CAMERA"
    area().spaces.active.overlay.show_floor = False
    area().spaces.active.shading.color_type = "MATERIAL"
    area().spaces.active.region_3d.view_camera_zoom = 20.0
    area("PROPERTIES").type = "IMAGE_EDITOR"
    assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}
    yield from wait_for(lambda: status().job.losses)
    # The first picture of the difference comes with the first iteration.
    yield from wait_for(lambda: "Edgegrad Difference" in bpy.data.images)
    call(bpy.ops.edgegrad.show_difference)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area("IMAGE_EDITOR"),
                                   region=next(r for r in area("IMAGE_EDITOR").regions if r.type == "WINDOW")):
        bpy.ops.image.view_all(fit_view=True)
    over_viewport()
    yield from filmed()
    yield from ended()
    FOUND["fit"] = status().said
    settings.look_samples = 32
    call(bpy.ops.edgegrad.gradient)
    yield from ended()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area("IMAGE_EDITOR"),
                                   region=next(r for r in area("IMAGE_EDITOR").regions if r.type == "WINDOW")):
        bpy.ops.image.view_all(fit_view=True)
    yield from redraw(1.0)
    shot("finished")

"""The pictures of the documentation: a monkey's head is fitted to a picture of a fatter one."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, status
from tests.gui.window import Script, area, call, open_tab, over_viewport, redraw, shot, wait_for

FOUND: dict[str, Any] = {}
SIZE = 200, 150


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
    settings.iterations, settings.samples = 60, 4
    scene.cycles.max_bounces = 2
    status().said = ""
    yield from open_tab("Edgegrad")
    area().spaces.active.region_3d.view_perspective = "CAMERA"
    area().spaces.active.overlay.show_floor = False
    area().spaces.active.shading.color_type = "MATERIAL"
    area().spaces.active.region_3d.view_camera_zoom = 20.0
    area("PROPERTIES").type = "IMAGE_EDITOR"
    assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}
    yield from wait_for(lambda: len(status().job.losses) > 6, 200.0)
    call(bpy.ops.edgegrad.show_difference)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area("IMAGE_EDITOR"),
                                   region=next(r for r in area("IMAGE_EDITOR").regions if r.type == "WINDOW")):
        bpy.ops.image.view_all(fit_view=True)
    yield from wait_for(lambda: len(status().job.losses) > 30, 200.0)
    over_viewport()
    yield from redraw(1.0)
    shot("running")
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

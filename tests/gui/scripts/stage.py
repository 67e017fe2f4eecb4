"""The scene of the scripts: Blender's cube, with a target picture of another color and shape."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from tests.gui.window import OUT, Script, call, wait_for

SIZE = 160, 90
TARGET, BLEND = (str(OUT / name) for name in ("front.exr", "stage.blend"))
ADDON = "bl_ext.user_default.edgegrad"


def status() -> Any:
    """Return the add-on's status."""
    from bl_ext.user_default.edgegrad.status import STATUS  # type: ignore[import-not-found]

    return STATUS


def cube() -> Any:
    """Return the cube, active and selected."""
    ob = bpy.data.objects["Cube"]
    ob.select_set(True)
    bpy.context.view_layer.objects.active = ob
    return ob


def color() -> Any:
    """Return the socket of the cube's base color."""
    return bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"].inputs["Base Color"]


def write_target() -> None:
    """Write the picture of the cube in blue and a bit taller."""
    from edgegrad import images

    scene, before = bpy.context.scene, tuple(color().default_value)
    size = scene.render.resolution_x, scene.render.resolution_y
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    color().default_value, cube().scale = (0.1, 0.4, 0.8, 1.0), (1.0, 1.0, 1.2)
    call(bpy.ops.edgegrad.render, "EXEC_DEFAULT", samples=64)
    made = bpy.data.images["Edgegrad Render"]
    pixels = np.array(made.pixels[:], np.float32).reshape(SIZE[1], SIZE[0], 4)
    images.write_image(TARGET, pixels[::-1, :, :3])
    bpy.data.images.remove(made)
    color().default_value, cube().scale = before, (1.0, 1.0, 1.0)
    scene.render.resolution_x, scene.render.resolution_y = size


def save() -> None:
    """Set a long fit of vertices, color and power up, and save it."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    write_target()
    call(bpy.ops.edgegrad.target_open, "EXEC_DEFAULT", filepath=TARGET)
    call(bpy.ops.edgegrad.set_up, "EXEC_DEFAULT", task="MATERIALS")
    cube()
    call(bpy.ops.edgegrad.parameters_add, "EXEC_DEFAULT", of="VERTICES")
    scene.edgegrad.iterations, scene.edgegrad.samples = 10_000, 4
    bpy.ops.wm.save_as_mainfile(filepath=BLEND)


def opened() -> Script:
    """Open the saved scene again."""
    bpy.ops.wm.open_mainfile(filepath=BLEND)
    yield 0.5
    cube()
    bpy.ops.ed.undo_push(message="Start")


def values() -> dict[str, Any]:
    """Return all that a fit may change, bit by bit, and the names of all objects."""
    objects = {}
    for ob in bpy.context.scene.objects:
        keys = getattr(ob.data, "shape_keys", None)
        objects[ob.name] = [[*row] for row in ob.matrix_basis], [] if keys is None else [*keys.key_blocks.keys()]
    out: dict[str, Any] = {"objects": objects}
    if "Cube" in bpy.data.objects:
        out["vertices"] = [[*vertex.co] for vertex in bpy.data.objects["Cube"].data.vertices]
    out["color"], out["energy"] = [*color().default_value], bpy.data.lights["Light"].energy
    return out


def is_as(before: dict[str, Any]) -> bool:
    """Whether all that a fit may change is as it was."""
    return values() == before


def fitting(steps: int = 3) -> Script:
    """Start the fit, and wait for some iterations."""
    assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}
    yield from wait_for(lambda: status().job is None or len(status().job.losses) >= steps)
    assert status().job is not None, status().said


def ended() -> Script:
    """Wait until nothing runs."""
    yield from wait_for(lambda: status().job is None, 1000.0)
    yield 0.3

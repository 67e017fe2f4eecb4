"""The examples that are ready to fit: each is opened and Fit pressed, then one undo takes it back."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import bpy

from tests.gui.scripts.stage import ended, status
from tests.gui.window import OUT, Script, area, call, log, open_tab, redraw, shot, wait_for

FOUND: dict[str, Any] = {}
READY = Path(os.environ["BLENDER_GUI_DATA"]) / "ready"
# Steps of each fit; 0: as many as the example has.
ITERATIONS = int(os.environ.get("EDGEGRAD_GUI_ITERATIONS", "20"))


def state() -> dict[str, Any]:
    """Return all that the examples' fits may change, bit by bit."""
    found: dict[str, Any] = {}
    for ob in bpy.context.scene.objects:
        found[ob.name] = [[*row] for row in ob.matrix_basis]
        if ob.type == "MESH":
            keys = ob.data.shape_keys
            found[f"{ob.name} vertices"] = [[*vertex.co] for vertex in ob.data.vertices]
            found[f"{ob.name} keys"] = [] if keys is None else [(key.name, key.value) for key in keys.key_blocks]
        elif ob.type == "LIGHT":
            found[f"{ob.name} light"] = ob.data.energy, [*ob.data.color]
        elif ob.type == "CAMERA":
            found[f"{ob.name} camera"] = ob.data.lens, ob.data.shift_x, ob.data.shift_y
        elif ob.type == "ARMATURE":
            found[f"{ob.name} bones"] = [[[*row] for row in bone.matrix_basis] for bone in ob.pose.bones]
    for material in bpy.data.materials:
        for node in material.node_tree.nodes:
            found[f"{material.name} {node.name}"] = [plain(getattr(socket, "default_value", None))
                                                     for socket in node.inputs]  # fmt: skip
    return found


def plain(value: Any) -> Any:
    """Return a value of Blender's without Blender."""
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def pressed(name: str, file: Path) -> Script:
    """Open an example, press Fit, and undo."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    yield 0.5
    bpy.ops.ed.undo_push(message="Start")
    yield from open_tab("Edgegrad")
    area().spaces.active.region_3d.view_perspective = "CAMERA"
    settings = bpy.context.scene.edgegrad
    if ITERATIONS:
        settings.iterations = ITERATIONS
    yield from redraw(0.7)
    shot(f"{name}-ready")
    bpy.ops.ed.undo_push(message="Start")
    before = state()
    assert call(bpy.ops.edgegrad.fit) == {"RUNNING_MODAL"}, name
    yield from wait_for(lambda: status().job is None or len(status().job.losses) > 2)
    yield from redraw(0.3)
    shot(f"{name}-running")
    yield from ended()
    yield from redraw(0.7)
    shot(f"{name}-finished")
    changed = state() != before
    bpy.ops.ed.undo()
    yield 0.3
    FOUND[name] = {"said": status().said, "failed": status().failed, "changed": changed, "undone": state() == before}
    log(name, FOUND[name])


def main() -> Script:
    """Press Fit in each example."""
    yield from redraw(1.0)
    folder = OUT / "ready"
    shutil.copytree(READY, folder, dirs_exist_ok=True)  # fits may not be opened from a folder that can't be written
    for file in sorted(folder.glob("*/*.blend")):
        yield from pressed(file.stem, file)
    shutil.rmtree(folder)

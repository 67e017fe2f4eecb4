"""A fit of an image's pixels: what ends it, what it writes, and that undo and redo bring the pixels back."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from tests.gui.scripts import stage
from tests.gui.scripts.stage import ended, fitting, status
from tests.gui.window import OUT, Script, call, holds, key, open_tab, over_viewport, redraw, shot, wait_for

FOUND: dict[str, Any] = {}
SIZE = 16
SHOWN = "Edgegrad Skin"
GREY, BLUE = (0.5, 0.5, 0.5, 1.0), (0.1, 0.4, 0.8, 1.0)


def skin() -> Any:
    """The image on the cube."""
    return bpy.data.images["Skin"]


def paint(color: tuple[float, ...]) -> None:
    """Fill the image with a color."""
    skin().pixels.foreach_set(np.tile(np.array(color, np.float32), SIZE * SIZE))
    skin().update()


def pixels() -> list[float]:
    """All pixels of the image, and whether its file or its packed file has them."""
    return [round(value, 4) for value in skin().pixels] + [float(skin().is_dirty)]


def shown(channel: int) -> float:
    """Mean of a channel of the pixels that a running fit has reached; 0: it shows none yet."""
    image = bpy.data.images.get(SHOWN)
    return 0.0 if image is None else float(np.mean(image.pixels[channel :: image.channels]))


def put_image() -> None:
    """Give the cube an image from a file."""
    image = bpy.data.images.new("Skin", SIZE, SIZE, alpha=False)
    image.filepath_raw, image.file_format = str(OUT / "skin.png"), "PNG"
    paint(GREY)
    image.save()
    bpy.data.images.remove(image)
    bpy.data.images.load(str(OUT / "skin.png")).name = "Skin"
    tree = bpy.data.materials["Material"].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = skin()
    tree.links.new(node.outputs["Color"], stage.color())


def undo_and_redo(name: str, before: list[float]) -> Script:
    """Undo and redo the fit that has ended."""
    after = pixels()
    over_viewport()
    key("ctrl+z")
    undone = yield from holds(lambda: pixels() == before)
    key("ctrl+shift+z")
    redone = yield from holds(lambda: pixels() == after)
    FOUND[name] = {"said": status().said, "failed": status().failed, "changed": after != before,
                   "undone": undone, "redone": redone,
                   "packed": skin().packed_file is not None}  # fmt: skip


def main() -> Script:
    """Fit the image, several times."""
    yield from redraw(1.0)
    scene, settings = bpy.context.scene, bpy.context.scene.edgegrad
    scene.render.resolution_x, scene.render.resolution_y = stage.SIZE
    put_image()
    paint(BLUE)
    stage.write_target()
    skin().reload()
    call(bpy.ops.edgegrad.target_open, "EXEC_DEFAULT", filepath=stage.TARGET)
    stage.cube()
    call(bpy.ops.edgegrad.parameters_add, "EXEC_DEFAULT", of="IMAGE")
    FOUND["rows"] = [row.name for row in settings.parameters]
    settings.iterations, settings.samples = 10_000, 4
    yield from open_tab("Edgegrad")
    before = pixels()
    yield from fitting()
    yield from wait_for(lambda: shown(2) > before[2] + 0.02)  # it becomes blue
    over_viewport()
    key("Escape")
    yield from ended()
    FOUND["escape"] = {"said": status().said, "same": pixels() == before}
    FOUND["shown"] = shown(0) < before[0]
    yield from fitting()
    paint((0.9, 0.1, 0.1, 1.0))
    yield from ended()
    FOUND["painted"] = {"said": status().said, "kept": abs(skin().pixels[0] - 0.9) < 0.01}
    skin().reload()
    bpy.ops.ed.undo_push(message="Start")
    settings.iterations = 30
    yield from fitting()
    yield from ended()
    yield from redraw()
    shot("finished")
    yield from undo_and_redo("of a file", before)
    # What is painted and was never saved is in no file.
    paint((0.4, 0.4, 0.4, 1.0))
    bpy.ops.ed.undo_push(message="Paint")
    before = pixels()
    yield from fitting()
    yield from ended()
    yield from redraw()
    yield from undo_and_redo("of memory", before)

"""A cube whose colour is to be found, and its pictures by Cycles as Blender saves them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from edgegrad_addon import command_line
from tests.support.scenes import blender_scenes as bs

TRUTH = (0.8, 0.1, 0.05)
START = (0.3, 0.4, 0.5)


def saved(path: Path, scene: Any, depth: str = "8", file_format: str = "PNG") -> Path:
    """The scene's picture by Cycles, saved with the scene's view transform."""
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode = file_format, "RGB"
    if file_format != "JPEG":
        settings.color_depth = depth
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return path


def ball(color: Any = TRUTH, size: int = 32) -> Any:
    """A cube in sunlight before a grey world, and the scene."""
    scene = bs.empty(size)
    bs.camera((0, 0, 6), name="Front")
    bs.light("SUN", "Sun", rotation=(0.3, 0.4, 0), energy=3.0)
    bs.world((0.2, 0.2, 0.2))
    bs.add("Cube", bs.cube("Cube", bs.material("Clay", color)), rotation=(0.4, 0.3, 0))
    return scene


def fitted_color(folder: Path, cameras: Path) -> Any:
    """The cube's colour that the command line finds from START with a calibration's cameras and pictures."""
    recolored()
    start, fitted = folder / "start.blend", folder / "fitted.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    assert command_line.main(["fit", str(start), "--cameras", str(cameras), "--base-color", "Clay", "--samples", "8",
                              "--iterations", "80", "--save", str(fitted)]) == 0  # fmt: skip
    bpy.ops.wm.open_mainfile(filepath=str(fitted))
    return np.array(bs.shader(bpy.data.materials["Clay"]).inputs["Color"].default_value[:3])


def recolored(color: Any = START) -> None:
    """Give the cube the colour from which a fit starts."""
    bs.shader(bpy.data.materials["Clay"]).inputs["Color"].default_value = (*color, 1.0)

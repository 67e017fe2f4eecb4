"""Cameras of a calibration as camera objects of Blender, with their pictures as backgrounds.

A camera of Blender has no lens distortion, so its calibrated lens is stored in its data, and targets of this camera are
undistorted when they are read. Blender renders all cameras of a scene in one size and with one shape of pixels; the
pixels of undistorted pictures are square.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from edgegrad.calibration import Calibrated, Lens
from edgegrad.calibration.lens import LEAST_SHIFT
from edgegrad.images import same_aspect

from ..problem import Problem

# Key of the lens in a camera's data, and name of the empty object that holds imported cameras.
LENS = "edgegrad_lens"
HOLDER = "Calibration"
SENSOR = 36.0  # millimetres


def lens_of(camera: Any) -> Lens | None:
    """Return the calibrated lens of a camera object; None if its pictures need none.

    Raises
    ------
    Problem
        If what is stored is no lens.
    """
    stored = camera.data.get(LENS)
    if stored is None:
        return None
    try:
        values: dict[str, Any] = {key: round(value) if key in ("width", "height") else value
                                  for key, value in stored.items()}  # fmt: skip
        return Lens(**values)
    except (AttributeError, TypeError, ValueError) as error:
        raise Problem(f"camera '{camera.name}': its custom property '{LENS}' is no lens ({error}); remove it") from None


def add_cameras(scene: Any, found: Sequence[Calibrated]) -> list[Any]:
    """Add a camera object for each picture of a calibration, below one empty object that places them all.

    The scene's resolution gets the aspect of the pictures; its larger side stays.

    Raises
    ------
    Problem
        If the pictures have several aspects.
    """
    first = found[0].lens
    for one in found:
        if not same_aspect((one.lens.height, one.lens.width), (first.height, first.width)):
            raise Problem(f"picture '{one.name}': is {one.lens.width} x {one.lens.height} pixels, of another aspect "
                          f"than '{found[0].name}' of {first.width} x {first.height}, but Blender renders all cameras "
                          "of a scene in one size; crop the pictures alike, or import each kind into its own scene")
    render = scene.render
    side = max(render.resolution_x, render.resolution_y) / max(first.width, first.height)
    if not same_aspect((render.resolution_y, render.resolution_x), (first.height, first.width)):
        render.resolution_x, render.resolution_y = (max(1, round(side * size)) for size in (first.width, first.height))
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    holder = bpy.data.objects.new(HOLDER, None)
    scene.collection.objects.link(holder)
    out = []
    for one in found:
        camera = add_camera(scene, Path(one.name).stem, one.lens, one.to_world)
        camera.parent = holder
        if one.image.is_file():
            background = camera.data.background_images.new()
            background.image = bpy.data.images.load(str(one.image), check_existing=True)
            background.frame_method = "FIT"
            camera.data.show_background_images = True
        out.append(camera)
    if scene.camera is None:
        scene.camera = out[0]
    bpy.context.view_layer.update()
    return out


def add_camera(scene: Any, name: str, lens: Lens, to_world: Any) -> Any:
    """Add a camera object with a calibrated lens at a pose."""
    data = bpy.data.cameras.new(name)
    data.sensor_fit, data.sensor_width = "HORIZONTAL", SENSOR
    data.lens = SENSOR * lens.fx / lens.width
    data.shift_x, data.shift_y = 0.5 - lens.cx / lens.width, (lens.cy - 0.5 * lens.height) / lens.width
    if lens.shift >= LEAST_SHIFT:
        data[LENS] = asdict(lens)
    camera = bpy.data.objects.new(name, data)
    camera.matrix_world = np.asarray(to_world).T.tolist()
    scene.collection.objects.link(camera)
    return camera

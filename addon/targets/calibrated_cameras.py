"""Cameras of a calibration as camera objects of Blender, with their pictures as backgrounds.

A camera of Blender has no lens distortion, so its calibrated lens is stored in its data, and targets of this camera are
undistorted when they are read. Blender renders all cameras of a scene in one size and with one shape of pixels; the
pixels of undistorted pictures are square.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from edgegrad.calibration import Calibrated, Lens, read_calibration
from edgegrad.calibration.lens import LEAST_SHIFT
from edgegrad.images import same_aspect

from ..problem import Problem
from .solved_clips import solved_clip

# Key of the lens in a camera's data, and name of the empty object that holds imported cameras.
LENS = "edgegrad_lens"
HOLDER = "Calibration"
SENSOR = 36.0  # millimetres
# Beginning of the name of a source that is a movie clip.
CLIP = "clip:"


@dataclass(frozen=True)
class Imported:
    """A camera object of a calibration, its picture file, which may be missing, and its frame if that is a movie."""

    camera: Any
    image: Path
    frame: int | None = None


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


def add_calibration(scene: Any, source: str, every: int = 1) -> list[Imported]:
    """Add the cameras of a calibration; see `add_cameras`.

    Parameters
    ----------
    source
        A file or folder (`edgegrad.calibration.read_calibration`), or "clip:NAME", a solved movie clip of the .blend.
    every
        Of a clip: use each so-many-th frame.

    Raises
    ------
    Problem, ValueError
        If the calibration can't be read or used.
    """
    if source.startswith(CLIP):
        solved = solved_clip(scene, source[len(CLIP) :], every)
        return add_cameras(scene, solved.pictures, solved.frames, solved.matrix)
    return add_cameras(scene, read_calibration(bpy.path.abspath(source)))


def add_cameras(scene: Any, found: Sequence[Calibrated], frames: Sequence[int | None] = (),
                matrix: Any = None) -> list[Imported]:  # fmt: skip
    """Add a camera object for each picture of a calibration, below one empty object that places them all.

    The scene's resolution gets the aspect of the pictures; its larger side stays.

    Parameters
    ----------
    frames
        For each picture: its frame if the file is a movie, else None; empty: all None.
    matrix
        (4, 4) pose and scale of the empty object; None: the identity.

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
    if matrix is not None:
        holder.matrix_world = np.asarray(matrix).T.tolist()
    out = []
    for one, frame in zip(found, frames or [None] * len(found), strict=True):
        camera = add_camera(scene, Path(one.name).stem, one.lens, one.to_world)
        camera.parent = holder
        if one.image.is_file():
            background = camera.data.background_images.new()
            background.image = bpy.data.images.load(str(one.image), check_existing=True)
            background.frame_method = "FIT"
            if frame is not None:  # a movie of one frame
                user = background.image_user
                user.frame_start, user.frame_duration, user.frame_offset = 1, 1, frame - 1
            camera.data.show_background_images = True
        out.append(Imported(camera, one.image, frame))
    if scene.camera is None:
        scene.camera = out[0].camera
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

"""Cameras of a calibration as camera objects of Blender, with their pictures as backgrounds.

A camera of Blender has no lens distortion, or that of a fisheye by a polynomial. A calibrated lens that differs from
its camera is stored in the camera's data, and targets of this camera are undistorted when they are read. Blender
renders all cameras of a scene in one size and with one shape of pixels; the pixels of undistorted pictures are square.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad.calibration import Calibrated, FisheyeLens, Intrinsics, Lens, PanoramaLens, read_calibration
from edgegrad.images import same_aspect

from ..export.surroundings.camera import PANORAMAS, panorama_settings
from ..problem import Problem
from .solved_clips import solved_clip

# Key of the lens in a camera's data, that of the lens's kind within (none: a `Lens`), and name of the empty object that
# holds imported cameras.
LENS, KIND = "edgegrad_lens", "kind"
LENSES: dict[str, type[Intrinsics]] = {kind.__name__: kind for kind in (Lens, FisheyeLens, PanoramaLens)}
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


def lens_of(camera: Any) -> Intrinsics | None:
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
        return LENSES[values.pop(KIND, Lens.__name__)](**values)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
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


def add_camera(scene: Any, name: str, lens: Intrinsics, to_world: Any) -> Any:
    """Add a camera object with a calibrated lens at a pose."""
    data = bpy.data.cameras.new(name)
    _set_projection(data, lens.camera(to_world))
    if not lens.keeps_pictures:
        data[LENS] = asdict(lens) | {KIND: type(lens).__name__}
    camera = bpy.data.objects.new(name, data)
    camera.matrix_world = np.asarray(to_world).T.tolist()
    scene.collection.objects.link(camera)
    return camera


def _set_projection(data: Any, view: edgegrad.Camera) -> None:
    """Give a camera of Blender the projection of an exported one with square pixels (`export.surroundings.camera`)."""
    data.sensor_fit, data.sensor_width = "HORIZONTAL", SENSOR
    if view.kind == "PERSPECTIVE":
        data.lens = SENSOR * view.focal / view.width
        data.shift_x, data.shift_y = view.shift
        return
    data.type = "PANO"
    panorama = panorama_settings(data)
    panorama.panorama_type = next(name for name, kind in PANORAMAS.items() if kind == view.kind)
    if view.kind == "EQUIRECTANGULAR":
        # Blender bounds the angles, so that those beyond are reached by a shift, in parts of the picture
        for side, (low, high) in (("longitude", view.longitude), ("latitude", view.latitude)):
            half = 0.5 * (high - low)
            setattr(panorama, f"{side}_min", -half)
            setattr(panorama, f"{side}_max", half)
            setattr(data, "shift_x" if side == "longitude" else "shift_y", 0.25 * (low + high) / half)
        return
    panorama.fisheye_fov = view.fisheye_fov
    for k, coefficient in enumerate(-view.fisheye_polynomial / SENSOR ** np.arange(5.0)):
        setattr(panorama, f"fisheye_polynomial_k{k}", coefficient)
    data.shift_x, data.shift_y = view.shift[0], view.shift[1] * view.width / view.height

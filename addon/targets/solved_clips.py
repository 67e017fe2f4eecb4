"""Cameras that Blender's motion tracking has solved: some frames of a movie clip as pictures of a calibration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from edgegrad.calibration import Calibrated, Lens

from ..problem import Problem
from .film_files import frame_of_sequence

# Kind of the constraint by which a tracked camera follows its clip.
SOLVER = "CAMERA_SOLVER"
# Largest difference of a pixel's aspect from 1 that counts as rounding.
SQUARE = 1e-4


@dataclass(frozen=True)
class Solved:
    """Solved frames of a clip.

    Attributes
    ----------
    pictures
        The frames.
    frames
        Number of each frame in its movie; None for files of a sequence.
    matrix
        (4, 4) where the solution is in the scene: the pose of a camera that follows the clip, else the identity.
    """

    pictures: list[Calibrated]
    frames: list[int | None]
    matrix: Any


def solved_clip(scene: Any, name: str, every: int = 1) -> Solved:
    """Return each so-many-th solved frame of a clip.

    Raises
    ------
    Problem
        If there is no such clip, it has no solution, or its lens can't be undone.
    """
    clip = bpy.data.movieclips.get(name)
    if clip is None:
        known = ", ".join(f"'{one.name}'" for one in bpy.data.movieclips) or "none"
        raise Problem(f"movie clip '{name}': there is no such clip (known: {known})")
    camera_object = next(one for one in clip.tracking.objects if one.is_camera)
    reconstruction = camera_object.reconstruction
    if not reconstruction.is_valid or not len(reconstruction.cameras):
        raise Problem(f"movie clip '{name}': its camera is not solved; track it and press Solve Camera Motion first")
    lens = _lens(clip)
    pictures, frames = [], []
    for camera in list(reconstruction.cameras)[:: max(1, every)]:
        path, frame = _picture(clip, camera.frame)
        matrix = np.array(camera.matrix, np.float64)
        pictures.append(Calibrated(f"{Path(clip.name).stem} {camera.frame:04d}", path, lens, matrix))
        frames.append(frame)
    return Solved(pictures, frames, _place(scene, clip))


def _lens(clip: Any) -> Lens:
    camera = clip.tracking.camera
    where = f"movie clip '{clip.name}'"
    width, height = clip.size
    if not width or not height:
        raise Problem(f"{where}: its pictures can't be read; check its file '{clip.filepath}'")
    if abs(camera.pixel_aspect - 1.0) > SQUARE:
        raise Problem(f"{where}: its pixels are not square (Pixel Aspect {camera.pixel_aspect:g}), which is not "
                      "supported; convert it to square pixels")  # fmt: skip
    if camera.distortion_model == "POLYNOMIAL":
        coefficients = {key: getattr(camera, key) for key in ("k1", "k2", "k3")}
    elif camera.distortion_model == "BROWN" and not camera.brown_k4:
        coefficients = {key: getattr(camera, f"brown_{key}") for key in ("k1", "k2", "k3")}
        # Blender's tracker has P1 and P2 in the opposite order, and y upwards.
        coefficients |= {"p1": -camera.brown_p2, "p2": camera.brown_p1}
    else:
        what = "with K4" if camera.distortion_model == "BROWN" else ""
        raise Problem(f"{where}: its lens distortion {camera.distortion_model.title()} {what} can't be undone; choose "
                      "Polynomial, or Brown without K4, and solve again")  # fmt: skip
    x, y = camera.principal_point_pixels
    return Lens(width, height, camera.focal_length_pixels, camera.focal_length_pixels, x, height - y, **coefficients)


def _picture(clip: Any, frame: int) -> tuple[Path, int | None]:
    """Return the file of a frame of the clip, counted from 1, and the frame of the file if it is a movie."""
    path = Path(bpy.path.abspath(clip.filepath, library=clip.library))
    if clip.source == "MOVIE":
        return path, frame + clip.frame_offset
    return frame_of_sequence(path, lambda first: first + frame - 1 + clip.frame_offset) or path, None


def _place(scene: Any, clip: Any) -> Any:
    """Pose that a camera with the constraint Camera Solver has without it; it places the solution in the scene."""
    for ob in scene.objects:
        for constraint in ob.constraints:
            if constraint.type != SOLVER or constraint.mute:
                continue
            if constraint.clip == clip or (constraint.use_active_clip and scene.active_clip == clip):
                above = ob.parent.matrix_world @ ob.matrix_parent_inverse if ob.parent else None
                return np.array(ob.matrix_basis if above is None else above @ ob.matrix_basis)
    return np.eye(4)

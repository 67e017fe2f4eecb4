"""The camera of a 3D view, from the matrices that Blender draws it with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import edgegrad

F64 = NDArray[np.float64]

# Clip distance of views whose matrix has none within the precision of floats.
_FARTHEST = 1e9


def camera_of_view(view: F64, projection: F64, width: int, height: int) -> edgegrad.Camera:
    """Make the camera with which a view is drawn.

    Parameters
    ----------
    view
        (4, 4) transform from world to camera space.
    projection
        (4, 4) transform from camera space to clip space, as of OpenGL.
    width, height
        Size of the picture, pixels.
    """
    perspective = bool(projection[3, 3] == 0.0)
    x, y = float(projection[0, 0]), float(projection[1, 1])
    to_world = np.linalg.inv(view)
    to_world[:3, :3] /= np.linalg.norm(to_world[:3, :3], axis=0)
    aspect = x * width / (y * height)
    column = 2 if perspective else 3
    offset = projection[:2, column] * (0.5 if perspective else -0.5)
    shift = np.array([offset[0], offset[1] * height * aspect / width])
    near, far = _clip(projection, perspective)
    if not perspective and near < 0.0:
        # Orthographic views also show what is behind their origin.
        to_world[:3, 3] -= near * to_world[:3, 2]
        near, far = 0.0, far - near
    return edgegrad.Camera(
        to_world=_rigid(to_world), width=width, height=height, shift=shift, pixel_aspect=aspect,
        kind="PERSPECTIVE" if perspective else "ORTHOGRAPHIC",
        fov_x=2.0 * float(np.arctan(1.0 / x)) if perspective else 0.6911,
        ortho_width=6.0 if perspective else 2.0 / x,
        clip_start=max(near, 0.0), clip_end=far,
    )  # fmt: skip


def _clip(projection: F64, perspective: bool) -> tuple[float, float]:
    a, b = float(projection[2, 2]), float(projection[2, 3])
    if perspective:
        near = b / (a - 1.0)
        return near, b / (a + 1.0) if a + 1.0 < -1.0 / _FARTHEST else _FARTHEST
    return (b + 1.0) / a, (b - 1.0) / a


def _rigid(matrix: F64) -> F64:
    """The rotation next to that of a matrix in single precision."""
    u, _, v = np.linalg.svd(matrix[:3, :3])
    out = matrix.copy()
    out[:3, :3] = u @ v
    return out


def smaller(camera: edgegrad.Camera, divisor: int) -> edgegrad.Camera:
    """Return the camera with a picture of fewer pixels."""
    if divisor == 1:
        return camera
    return camera.of_size(max(camera.height // divisor, 1), max(camera.width // divisor, 1))


def with_lens(camera: edgegrad.Camera, lens: edgegrad.Camera) -> edgegrad.Camera:
    """Return the camera of a view through a camera object, with the depth of field and the filter of `lens`."""
    return replace(camera, aperture_radius=lens.aperture_radius, focus_distance=lens.focus_distance,
                   aperture_blades=lens.aperture_blades, aperture_rotation=lens.aperture_rotation,
                   aperture_ratio=lens.aperture_ratio, filter=lens.filter, filter_width=lens.filter_width)  # fmt: skip

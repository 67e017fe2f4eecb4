"""The camera of a 3D view, from the matrices that Blender draws it with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene.camera import PANORAMAS

from ..export.surroundings.camera import export_camera
from ..problem import Report

F64 = NDArray[np.float64]

# Clip distance of views whose matrix has none within the precision of floats.
_FARTHEST = 1e9


class Seen(NamedTuple):
    """What a view shows.

    Attributes
    ----------
    camera
        Of the picture.
    place
        Of the picture in the view: left, bottom, width and height, as fractions of the view's size.
    """

    camera: edgegrad.Camera
    place: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)


def through_camera(ob: Any, scene: Any, view: F64, projection: F64, width: int, height: int) -> Seen:
    """Return what a view through a camera object shows.

    Parameters
    ----------
    ob
        Evaluated camera object.
    scene
        Blender's scene.
    view, projection, width, height
        Of the view, as for `camera_of_view`.

    Raises
    ------
    Problem
        If the camera can't be rendered.
    """
    lens = export_camera(ob, scene, Report())
    if lens.kind not in PANORAMAS:
        return Seen(_with_lens(camera_of_view(view, projection, width, height), lens))
    corners = np.array([[*corner, 1.0] for corner in ob.data.view_frame(scene=scene)]) @ projection.T
    corners = (0.5 + 0.5 * corners[:, :2] / corners[:, 3:]) * (width, height)
    return _in_frame(replace(lens, crop=None), corners, width, height)


def _in_frame(panorama: edgegrad.Camera, corners: F64, width: int, height: int) -> Seen:
    """Return the part of a panorama that a view shows.

    Blender draws views through panoramas in perspective. As in Cycles, the panorama fills the frame of the camera.

    Parameters
    ----------
    panorama
        Camera of the whole picture, without a crop.
    corners
        (4, 2) corners of the frame in the view, pixels from the lower left.
    """
    left, bottom = (int(side) for side in np.round(corners.min(axis=0)))
    right, top = (int(side) for side in np.round(corners.max(axis=0)))
    right, top = max(right, left + 1), max(top, bottom + 1)
    camera = panorama.of_size(top - bottom, right - left)
    x0, x1 = max(left, 0), min(right, width)
    y0, y1 = max(bottom, 0), min(top, height)
    if x0 >= x1 or y0 >= y1:  # the frame is out of the view
        return Seen(replace(camera, crop=(0, 0, 1, 1)), (0.0, 0.0, 0.0, 0.0))
    return Seen(replace(camera, crop=(x0 - left, top - y1, x1 - left, top - y0)),
                (x0 / width, y0 / height, (x1 - x0) / width, (y1 - y0) / height))  # fmt: skip


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
    """Return the camera with a picture of fewer pixels; the border of a crop moves by less than one of them."""
    if divisor == 1:
        return camera
    out = replace(camera, crop=None).of_size(max(camera.height // divisor, 1), max(camera.width // divisor, 1))
    if camera.crop is None:
        return out
    sizes = np.array([out.width, out.height])
    factor = sizes / (camera.width, camera.height)
    corners = np.reshape(camera.crop, (2, 2)) * factor
    low = np.minimum(corners[0].astype(int), sizes - 1)
    high = np.maximum(np.round(corners[1]).astype(int), low + 1)
    return replace(out, crop=(int(low[0]), int(low[1]), int(high[0]), int(high[1])))


def _with_lens(camera: edgegrad.Camera, lens: edgegrad.Camera) -> edgegrad.Camera:
    """Return the camera of a view through a camera object, with the depth of field and the filter of `lens`."""
    return replace(camera, aperture_radius=lens.aperture_radius, focus_distance=lens.focus_distance,
                   aperture_blades=lens.aperture_blades, aperture_rotation=lens.aperture_rotation,
                   aperture_ratio=lens.aperture_ratio, filter=lens.filter, filter_width=lens.filter_width)  # fmt: skip

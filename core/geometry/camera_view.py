"""Tests whether points lie within the picture of a camera; occlusion is ignored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera

F64 = NDArray[np.float64]


def depths(camera: Camera, points: F64) -> F64:
    """(n,) depth of points (n, 3), metres; negative behind the camera."""
    return np.asarray((camera.to_world[:3, 3] - points) @ camera.to_world[:3, 2])


def in_picture(camera: Camera, points: F64) -> NDArray[np.bool_]:
    """(n,) whether points (n, 3) lie in front of the camera and within its rendered window.

    For panoramic cameras, every point counts as within the picture.
    """
    if camera.kind not in ("PERSPECTIVE", "ORTHOGRAPHIC"):
        return np.ones(len(points), bool)
    x, y = pixels(camera, points).T
    x0, y0, x1, y1 = camera.window
    before = depths(camera, points) > 0.0
    return np.asarray(before & (x >= x0) & (x < x1) & (y >= y0) & (y < y1))


def pixels(camera: Camera, points: F64) -> F64:
    """(n, 2) pixel coordinates, in the full picture, of points (n, 3) in front of a perspective or orthographic camera.

    Points behind the camera get any coordinates.
    """
    depth = depths(camera, points)
    scale = camera.focal / np.where(depth > 0.0, depth, 1.0) if camera.kind == "PERSPECTIVE" else camera.focal
    across = np.asarray(scale)[..., None] * ((points - camera.to_world[:3, 3]) @ camera.to_world[:3, :2])
    return np.asarray(camera.principal_point + across * [1.0, -1.0 / camera.pixel_aspect])

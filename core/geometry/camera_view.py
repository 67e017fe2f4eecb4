"""Where cameras see points, and which rays they send; occlusion is ignored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import PANORAMAS, Camera

F64 = NDArray[np.float64]


def depths(camera: Camera, points: F64) -> F64:
    """(n,) depth of points (n, 3), metres; negative behind the camera."""
    return np.asarray((camera.to_world[:3, 3] - points) @ camera.to_world[:3, 2])


def in_picture(camera: Camera, points: F64) -> NDArray[np.bool_]:
    """(n,) whether points (n, 3) lie in front of the camera and within its rendered window.

    For panoramic cameras, every point counts as within the picture.
    """
    if camera.kind in PANORAMAS:
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


def panorama_rays(camera: Camera, at: F64) -> F64:
    """(n, 3) unit directions, in the camera's axes, of a panorama's rays through points (n, 2) of its full picture.

    Directions are NaN outside of what a fisheye sees.
    """
    x, y = at.T
    if camera.kind == "EQUIRECTANGULAR":
        longitude = camera.longitude[0] + x / camera.width * np.diff(camera.longitude)
        latitude = camera.latitude[1] - y / camera.height * np.diff(camera.latitude)
        return np.column_stack([np.sin(longitude) * np.cos(latitude), np.sin(latitude),
                                -np.cos(longitude) * np.cos(latitude)])  # fmt: skip
    across = (at - camera.principal_point) * [1.0, -camera.pixel_aspect] / camera.focal
    radius = np.hypot(*across.T)
    seen = radius * camera.focal <= camera.disc
    angle = _fisheye_angle(camera, np.where(seen, radius, np.nan))
    aside = np.sin(angle) / np.maximum(radius, 1e-12)
    return np.column_stack([across * aside[:, None], -np.cos(angle)])


def pixel_angles(camera: Camera) -> F64:
    """(2,) mean angles between the rays through neighbouring pixels of a panorama, across and along it, radians."""
    if camera.kind == "EQUIRECTANGULAR":
        turns = np.array([np.diff(camera.longitude)[0] / camera.width, np.diff(camera.latitude)[0] / camera.height])
        return np.asarray(np.abs(turns))
    return _fisheye_angle(camera, camera.disc / camera.focal) / camera.disc * np.array([1.0, camera.pixel_aspect])


def pixel_widths(camera: Camera, distances: F64 | float) -> F64:
    """Widths of a pixel in the scene, metres, at distances, which are depths in a perspective."""
    if camera.kind == "ORTHOGRAPHIC":
        return np.full(np.shape(distances), 1.0 / camera.focal)
    return np.asarray(distances * (pixel_angles(camera)[0] if camera.kind in PANORAMAS else 1.0 / camera.focal))


def _fisheye_angle(camera: Camera, radius: F64 | float) -> F64:
    if camera.kind == "FISHEYE_EQUISOLID":
        return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.asarray(radius), 1.0)))
    if camera.kind == "FISHEYE_EQUIDISTANT":
        return np.asarray(radius)
    return np.asarray(np.polynomial.Polynomial(camera.fisheye_polynomial)(radius))

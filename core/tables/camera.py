"""The camera as a row of floats, `Tables.camera`, by which kernels differentiate."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera

# Name of a value -> its positions in the row.
PLACES = {
    "camera_position": slice(0, 3),  # relative to the tables' origin
    "camera_axes": slice(3, 12),  # X to the right, Y up, Z backwards
    "focal": slice(12, 13),  # pixels; of an orthographic camera: pixels per metre
    "pixel_aspect": slice(13, 14),
    "principal_point": slice(14, 16),  # pixels of the rendered window
    "panorama": slice(16, 20),  # longitude and latitude of the full picture's left, right, lower and upper edge
    "fisheye": slice(20, 25),  # angle by powers of the radius
    "disc": slice(25, 26),  # pixels
    "aperture_radius": slice(26, 27),
    "focus_distance": slice(27, 28),
    "aperture_rotation": slice(28, 29),
    "aperture_ratio": slice(29, 30),
}
WIDTH = 30
EQUIDISTANT = (0.0, 1.0, 0.0, 0.0, 0.0)


def camera_row(camera: Camera, origin: NDArray[np.float64]) -> NDArray[Any]:
    """(WIDTH,) row of a camera; its position is relative to `origin` (3,).

    The row is an analytic function of the numbers of the camera: complex numbers give a complex row (`jacobian`).
    """
    x0, y0, _, _ = camera.window
    return np.concatenate([
        camera.to_world[:3, 3] - origin,
        camera.to_world[:3, :3].T.reshape(-1),
        [camera.focal, camera.pixel_aspect],
        camera.principal_point - [x0, y0],
        camera.longitude,
        camera.latitude,
        camera.fisheye_polynomial if camera.kind == "FISHEYE_POLYNOMIAL" else EQUIDISTANT,
        [camera.disc],
        [camera.aperture_radius, camera.focus_distance, camera.aperture_rotation, camera.aperture_ratio],
    ])

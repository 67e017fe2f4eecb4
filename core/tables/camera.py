"""The camera as a row of floats: the one place that says where each of its values is.

Kernels differentiate with respect to this row, `Tables.camera`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera

# Value to its places in the row.
PLACES = {
    "camera_position": slice(0, 3),  # relative to the tables' origin
    "camera_axes": slice(3, 12),  # right X, up Y, backwards Z
    "focal": slice(12, 13),  # pixels; orthographic: pixels per metre
    "pixel_aspect": slice(13, 14),
    "principal_point": slice(14, 16),  # pixels of the rendered window
    "panorama": slice(16, 20),  # longitude and latitude of the full picture's left, right, lower and upper edge
    "aperture_radius": slice(20, 21),
    "focus_distance": slice(21, 22),
    "aperture_rotation": slice(22, 23),
    "aperture_ratio": slice(23, 24),
}
WIDTH = 24


def camera_row(camera: Camera, origin: NDArray[np.float64]) -> NDArray[Any]:
    """(WIDTH,) values of a camera at `PLACES`, its position relative to `origin` (3,).

    An analytic function of the camera's numbers: complex ones give a complex row (`jacobian`).
    """
    x0, y0, _, _ = camera.window
    return np.concatenate([
        camera.to_world[:3, 3] - origin,
        camera.to_world[:3, :3].T.reshape(-1),
        [camera.focal, camera.pixel_aspect],
        camera.principal_point - [x0, y0],
        camera.longitude,
        camera.latitude,
        [camera.aperture_radius, camera.focus_distance, camera.aperture_rotation, camera.aperture_ratio],
    ])

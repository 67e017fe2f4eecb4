"""A scene of many faces."""

from __future__ import annotations

import numpy as np

from edgegrad import Scene
from tests.support.small_scenes import floating_box


def dense_scene(side: int) -> Scene:
    """`floating_box` with a rippled sheet of 2 side² faces for its box."""
    scene = floating_box()
    ends = np.linspace(-1.0, 1.0, side + 1)
    x, y = np.meshgrid(ends, ends)
    box = scene.meshes["box"]
    box.vertices = np.stack([x, y, 1.0 + 0.2 * np.sin(5.0 * x) * np.cos(4.0 * y)], axis=-1).reshape(-1, 3)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    corners = [first, first + 1, first + side + 2], [first, first + side + 2, first + side + 1]
    box.faces = np.concatenate([np.stack(triangle, axis=-1) for triangle in corners]).astype(np.int32)
    return scene

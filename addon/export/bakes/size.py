"""How fine the images of a bake must be: as fine as the camera sees the mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.geometry.camera_view import pixel_widths

from ..geometry.group import Group

TEXELS = 2.0  # per pixel, along each side: interpolation between them blurs less than the pixel filter does
FILLED = 0.4  # share of an image that is covered by UV islands
SMALLEST = 64


def bake_size(group: Group, names: set[str], camera: edgegrad.Camera, largest: int) -> int:
    """Width and height of the images to which materials are baked on a mesh: a power of two, or `largest`.

    Parameters
    ----------
    names
        The materials.
    """
    arrays = group.arrays
    slot = np.clip(arrays.slots, 0, len(group.slots) - 1)
    faces = arrays.faces[np.isin(slot, [k for k, name in enumerate(group.slots) if name in names])]
    needed = 0.0
    for source in group.sources:
        corners = arrays.positions[faces] @ source.matrix[:3, :3].T + source.matrix[:3, 3]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = 0.5 * float(np.linalg.norm(across, axis=1).sum())
        pixel = _smallest_pixel(corners.reshape(-1, 3), camera)
        needed = max(needed, area / max(pixel, 1e-30) ** 2)
    side = TEXELS * np.sqrt(needed / FILLED)
    size = SMALLEST
    while size < min(side, largest):
        size *= 2
    return min(size, largest)


def _smallest_pixel(points: NDArray[np.float64], camera: edgegrad.Camera) -> float:
    """Size of the camera's pixels at the nearest point of the points' bounding box, metres.

    Points are corners of triangles, which may be nearer between their corners.
    """
    low, high = points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)
    eye = camera.to_world[:3, 3]
    distance = float(np.linalg.norm(eye - np.clip(eye, low, high)))
    return float(pixel_widths(camera, max(distance, camera.clip_start)))

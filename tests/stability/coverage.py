"""The area that triangles cover in each pixel, exactly, in double precision, and its derivatives.

What a lone emissive triangle before a black world looks like: its picture is its radiance times that area. Its plane
may reach behind the camera and its edges may be of any length, so that it is the reference where numbers get hard.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from edgegrad import Camera

F64 = NDArray[np.float64]
# Of central differences of areas, which are known to 1e-14: about a hundredth of the smallest features.
STEP = 2.0**-28


def clipped(polygon: F64, normal: F64, offset: float) -> F64:
    """The part of a convex polygon (n, d) where normal . x >= offset (Sutherland and Hodgman 1974)."""
    out = []
    height = polygon @ normal - offset
    for k in range(len(polygon)):
        a, b, ha, hb = polygon[k - 1], polygon[k], height[k - 1], height[k]
        if (ha >= 0.0) != (hb >= 0.0):
            out.append(a + (b - a) * (ha / (ha - hb)))
        if hb >= 0.0:
            out.append(b)
    return np.array(out).reshape(-1, polygon.shape[1])


def area(polygon: F64) -> float:
    """Signed area of a polygon (n, 2)."""
    if len(polygon) < 3:
        return 0.0
    x, y = (polygon - polygon[0]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def coverage(camera: Camera, corners: F64) -> F64:
    """(H, W) area of each pixel that a triangle (3, 3) covers, seen by a perspective camera."""
    height, width = camera.size
    out = np.zeros((height, width))
    local = (corners - camera.to_world[:3, 3]) @ camera.to_world[:3, :3]
    local = clipped(local, np.array([0.0, 0.0, -1.0]), camera.clip_start)
    if len(local) < 3:
        return out
    depth = -local[:, 2:]
    screen = camera.principal_point + camera.focal * local[:, :2] * [1.0, -1.0] / depth
    low = np.clip(np.floor(screen.min(axis=0)), 0, [width, height]).astype(int)
    high = np.clip(np.ceil(screen.max(axis=0)), 0, [width, height]).astype(int)
    for row in range(low[1], high[1]):
        strip = clipped(clipped(screen, np.array([0.0, 1.0]), row), np.array([0.0, -1.0]), -row - 1.0)
        for column in range(low[0], high[0]) if len(strip) else ():
            cell = clipped(clipped(strip, np.array([1.0, 0.0]), column), np.array([-1.0, 0.0]), -column - 1.0)
            out[row, column] = abs(area(cell))
    return out


def gradient(camera: Camera, corners: F64, weights: F64) -> F64:
    """(3, 3) derivative of sum(weights * coverage) by the corners."""
    out = np.zeros((3, 3))
    for k in np.ndindex(3, 3):
        ahead, behind = corners.copy(), corners.copy()
        ahead[k] += STEP
        behind[k] -= STEP
        out[k] = np.sum(weights * (coverage(camera, ahead) - coverage(camera, behind))) / (2.0 * STEP)
    return out

"""Poses, places, directions and driven numbers, moved together by one vector in units of their first steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...geometry.camera_view import depths, panorama_rays
from ...scene import parameters
from ...scene.camera import PANORAMAS, Camera
from ...scene.field import Field
from ...scene.mesh import Mesh
from ...scene.scene import Scene
from ..driven import Numbers, Variable
from ..rigid_variables import Directions, Poses, Positions, boxes_of, depth_seen, rotations
from ..variables import Unknown

F64 = NDArray[np.float64]
Movable = Numbers | Positions | Directions | Poses

# Depth of a place in a picture, relative to what the camera sees.
NEAREST, FARTHEST = 0.6, 1.6


class Moves:
    """The variables of a fit that can be moved as a whole.

    Parameters
    ----------
    scene
        The scene at the start.
    variables
        All variables of the fit.
    values
        Their values at the start.

    Attributes
    ----------
    parts
        Path of each variable that can be moved, and its numbers in the vector.
    count
        Length of the vector.
    """

    def __init__(self, scene: Scene, variables: Sequence[Unknown | Variable | Numbers],
                 values: Mapping[str, Any]) -> None:  # fmt: skip
        self._scene, self._values = scene, values
        self._items: dict[str, Movable] = {}
        self.parts: dict[str, slice] = {}
        self.count = 0
        for item in variables:
            size = _size(item)
            if size and isinstance(item, (Numbers, Positions, Directions, Poses)):
                self._items[item.path] = item
                self.parts[item.path] = slice(self.count, self.count + size)
                self.count += size

    def at(self, vector: F64) -> dict[str, F64]:
        """Return the values of the variables that a vector moves, from the start on."""
        return {path: _moved(item, np.asarray(self._values[path], np.float64), vector[self.parts[path]])
                for path, item in self._items.items()}  # fmt: skip

    def aimed(self, vector: F64, cameras: Sequence[Camera], generator: np.random.Generator) -> F64:
        """Return the vector with objects moved to random places in the pictures, and cameras kept in their place.

        An object that is out of view is hardly found by motions in space, most of which leave it out of view. A camera
        that looks away has to turn where it stands, towards some object; the steps of its pose turn it about what it
        sees.
        """
        out = vector.copy()
        for path, item in self._items.items():
            if not isinstance(item, Poses) or item.value.shape[-1] != 4:
                continue
            part, start = self.parts[path], np.asarray(self._values[path], np.float64)
            held = parameters.owner(self._scene, path)[0]
            unit = item.step * item.extent
            if isinstance(held, Camera):
                out[part][:3] = _turn_towards(self._scene, start, generator) / item.step
                arm = start[:3, 3] - item.pivot
                out[part][3:] = (arm - rotations(item.step * out[part][:3]) @ arm) / unit
            elif isinstance(held, (Mesh, Field)):
                place = _place_in_view(self._scene, cameras[generator.integers(len(cameras))], item.pivot, generator)
                out[part][3:] = (place - item.pivot) / unit
        return out


def _size(item: Unknown | Variable | Numbers) -> int:
    """Length of the part of the vector of a variable; 0: it is not moved as a whole."""
    if isinstance(item, Numbers):
        return int(item.value.size)
    if isinstance(item, (Positions, Directions)):
        return 3 if item.value.shape == (3,) else 0
    if isinstance(item, Poses) and item.value.ndim == 2:
        return 6 if item.value.shape[1] == 4 else 3
    return 0


def _moved(item: Movable, value: F64, part: F64) -> F64:
    if isinstance(item, Numbers):
        return np.clip(value + item.steps * part.reshape(value.shape), item.low, item.high)
    if isinstance(item, Positions):
        return np.asarray(value + item.step * part)
    if isinstance(item, Directions):
        return np.asarray(rotations(item.step * part[:3]) @ value)
    return item.moved(value, np.concatenate([item.step * part[:3], item.step * item.extent * part[3:]]))


def _turn_towards(scene: Scene, pose: F64, generator: np.random.Generator) -> F64:
    """The rotation vector of the smallest turn of a camera that brings a random place of the scene to its middle."""
    boxes = [(corners.min(axis=0), corners.max(axis=0)) for corners in boxes_of(scene)]
    if not boxes:
        return np.zeros(3)
    low, high = boxes[generator.integers(len(boxes))]
    wanted = low + generator.uniform(0.25, 0.75, 3) * (high - low) - pose[:3, 3]
    ahead, distance = -pose[:3, 2], float(np.linalg.norm(wanted))
    if distance == 0.0:
        return np.zeros(3)
    axis = np.cross(ahead, wanted / distance)
    sine = float(np.linalg.norm(axis))
    angle = np.arctan2(sine, float(ahead @ wanted) / distance)
    return np.asarray(axis * (angle / sine if sine > 1e-9 else 0.0))


def _place_in_view(scene: Scene, camera: Camera, now: F64, generator: np.random.Generator) -> F64:
    """A random place in the picture of a camera, at the depth of a point or of what the camera sees."""
    depth, usual = float(depths(camera, now[None])[0]), depth_seen(scene, camera)
    if not NEAREST * usual < depth < FARTHEST * usual:
        depth = usual * generator.uniform(NEAREST, FARTHEST)
    if camera.kind in PANORAMAS:
        x0, y0, x1, y1 = camera.window
        ray = panorama_rays(camera, generator.uniform((x0, y0), (x1, y1))[None])[0]
        away = ray if np.isfinite(ray).all() else np.array([0.0, 0.0, -1.0])  # outside of what a fisheye sees
        return np.asarray(camera.to_world[:3, 3] + camera.to_world[:3, :3] @ away * depth)
    height, width = camera.size
    across = depth * np.tan(0.5 * camera.fov_x) if camera.kind == "PERSPECTIVE" else 0.5 * camera.ortho_width
    x, y = generator.uniform(-0.9, 0.9, 2) * across * np.array([1.0, height / width])
    return np.asarray(camera.to_world[:3, 3] + camera.to_world[:3, :3] @ np.array([x, y, -depth]))

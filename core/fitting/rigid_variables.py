"""Optimised variables for positions, directions and poses.

The steps keep the lengths of directions, and transforms move rigidly: the gradient is projected to these changes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.camera_view import depths, in_picture
from ..scene import parameters
from ..scene.camera import Camera
from ..scene.field import Field
from ..scene.mesh import Mesh
from ..scene.placement import expanded, placed_meshes, places
from ..scene.scene import Scene
from .bounds import LEAST_SIZE
from .checkpoints.resumable import Resumable
from .optimisers import AdamMatrix, AdamUniform

F64 = NDArray[np.float64]

# Decay rate of the mean squared gradient. The usual 0.999 remembers the large gradients of the first iterations longer
# than most fits last, which makes the last steps too short. A smaller value lets noise into the step size.
BETA2 = 0.98
# First steps: TURN_STEP in radians, for poses also as a fraction of the extent; MOVE_STEP of positions as a fraction of
# the extent. Larger steps converge in fewer iterations, but overshoot.
TURN_STEP = 0.02
MOVE_STEP = 0.02


class Positions(Resumable):
    """A point in space, optimised by `AdamUniform`."""

    changing = ("value", "_optimiser")

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = (MOVE_STEP if step is None else step) * scene_extent(scene)
        self._optimiser = AdamUniform(self.step, beta2=BETA2)

    def take_step(self, gradient: F64, factor: float) -> Any:
        self.value = self._optimiser.update(self.value, gradient, factor)
        return self.value


class Corners(Positions):
    """A corner of a field's box. It stays on its side of the first box's middle: lower must be below upper."""

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        super().__init__(scene, path, step)
        held, name = parameters.owner(scene, path)
        self.step = (MOVE_STEP if step is None else step) * float(np.linalg.norm(held.upper - held.lower))
        self._optimiser = AdamUniform(self.step, beta2=BETA2)
        least, middle = LEAST_SIZE * (held.upper - held.lower), 0.5 * (held.lower + held.upper)
        self._limits = (-np.inf, middle - least) if name == "lower" else (middle + least, np.inf)

    def take_step(self, gradient: F64, factor: float) -> Any:
        self.value = np.clip(super().take_step(gradient, factor), *self._limits)
        return self.value


class Directions(Resumable):
    """Directions (..., 3): steps rotate them and keep their lengths."""

    changing = ("value", "_optimiser")

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = TURN_STEP if step is None else step
        self._length = np.linalg.norm(self.value, axis=-1, keepdims=True)
        self._optimiser = AdamUniform(self.step, beta2=BETA2)

    def take_step(self, gradient: F64, factor: float) -> Any:
        unit = self.value / self._length
        # Gradient by the unit direction, without its radial part.
        across = self._length * (gradient - unit * np.sum(unit * gradient, axis=-1, keepdims=True))
        turned = self._optimiser.update(unit, across, factor)
        self.value = self._length * turned / np.linalg.norm(turned, axis=-1, keepdims=True)
        return self.value


class Poses(Resumable):
    """Transforms (..., 4, 4) or rotations (3, 3), changed by rigid motions.

    A step rotates about the pivot by the vector w (radians) and translates by t: the linear part A and the offset m
    become R A and R (m - pivot) + pivot + t. Let c_j be the columns of (A, m - pivot) and g_j the gradients by them.
    Then the gradient by w is sum_j c_j x g_j, and the gradient by t is g_3. One optimiser moves both; the unit of t is
    the extent of the moved object.
    """

    changing = ("value", "_pivot", "_optimiser")

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = TURN_STEP if step is None else step
        self._pivot, self._extent = pivot_and_extent(scene, path, self.value)
        self._optimiser = AdamMatrix(self.step)

    @property
    def pivot(self) -> F64:
        """The points about which steps rotate."""
        return self._pivot

    @property
    def extent(self) -> float:
        """The unit of translations."""
        return self._extent

    def take_step(self, gradient: F64, factor: float) -> Any:
        columns = self.value[..., :3, :].copy()
        change = gradient[..., :3, :]
        rigid = self.value.shape[-1] == 4
        if rigid:
            columns[..., 3] -= self._pivot
        slope = np.cross(columns, change, axisa=-2, axisb=-2, axisc=-2).sum(axis=-1)
        if rigid:
            slope = np.concatenate([slope, self._extent * change[..., 3]], axis=-1)
        step = self._optimiser.update(np.zeros_like(slope), slope, factor)
        columns = rotations(step[..., :3]) @ columns
        if rigid:
            self._pivot = self._pivot + self._extent * step[..., 3:]
            columns[..., 3] += self._pivot
        self.value = self.value.copy()
        self.value[..., :3, :] = columns
        return self.value

    def moved(self, value: F64, motion: F64) -> F64:
        """Return one pose after a rotation about the pivot (radians) and a translation, both along the world's axes."""
        return moved_pose(value, self._pivot, motion)


def moved_pose(value: F64, pivot: F64, motion: F64) -> F64:
    """Return a pose after a rotation about a pivot, by a vector (radians), and a translation."""
    turn, out = rotations(motion[:3]), value.copy()
    out[:3, :3] = turn @ out[:3, :3]
    if value.shape[-1] == 4:
        out[:3, 3] = turn @ (out[:3, 3] - pivot) + pivot + motion[3:]
    return out


def rotations(vectors: F64) -> F64:
    """(..., 3, 3) rotations by vectors (..., 3): axis times angle in radians (Rodrigues' formula)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*vectors.shape, 3)
    # sin(a)/a and (1 - cos(a))/a^2, written with sinc, which is exact at 0.
    half = np.sinc(angle / (2.0 * np.pi))
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * skew + 0.5 * half * half * (skew @ skew))


def scene_extent(scene: Scene) -> float:
    """Diagonal of the bounding box of all meshes, metres; 1 for a scene without meshes or extent."""
    corners = [corner for box in boxes_of(scene) for corner in box]
    return float(np.linalg.norm(np.ptp(corners, axis=0))) or 1.0 if corners else 1.0


def boxes_of(scene: Scene) -> list[F64]:
    """Corners of the bounding box of each mesh, with all of its instances, in world space."""
    return [_box(mesh) for mesh in placed_meshes(scene)]


def _box(mesh: Mesh) -> F64:
    """(k, 3) corners of the bounding boxes of all instances of a mesh, in world space."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    place = places(mesh)
    return np.asarray((np.einsum("kij,nj->kni", place[:, :, :3], corners) + place[:, None, :, 3]).reshape(-1, 3))


def depth_seen(scene: Scene, camera: Camera) -> float:
    """Typical depth of the visible objects: median depth of the vertices in the picture, else of those in front.

    A camera pose uses a pivot at this depth. A rotation about it keeps the objects in the picture, while a rotation
    about the camera shifts the picture just like a translation. The optimiser could not separate these two.
    """
    points = np.concatenate([np.zeros((0, 3)), *(expanded(mesh).vertices for mesh in placed_meshes(scene))])
    depth = depths(camera, points)
    in_front = depth > 0.0
    seen = in_front & in_picture(camera, points)
    chosen = depth[seen] if seen.any() else depth[in_front]
    return float(np.median(chosen)) if len(chosen) else scene_extent(scene)


def pivot_and_extent(scene: Scene, path: str, value: F64) -> tuple[F64, float]:
    """Return the pivot of the rotations of a pose, and the extent that is the unit of its translations."""
    held, field = parameters.owner(scene, path)
    if isinstance(held, Camera):
        return value[:3, 3] - depth_seen(scene, held) * value[:3, 2], scene_extent(scene)
    if not isinstance(held, (Field, Mesh)):
        return value[..., :3, -1], scene_extent(scene)
    corners = held.corners() if isinstance(held, Field) else _box(held)
    extent = float(np.linalg.norm(np.ptp(corners, axis=0))) or 1.0
    if isinstance(held, Field) or field == "transform":
        return 0.5 * (corners.min(axis=0) + corners.max(axis=0)), extent
    # Each instance rotates about its own centre, in the space of the object's transform.
    middle = 0.5 * (held.vertices.min(axis=0) + held.vertices.max(axis=0))
    return value[:, :3, :3] @ middle + value[:, :3, 3], extent

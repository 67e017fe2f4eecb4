"""What an optimiser moves of positions, directions and poses: steps that keep directions' lengths and shapes rigid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.camera_view import depths, in_picture
from ..scene import parameters
from ..scene.camera import Camera
from ..scene.mesh import Mesh
from ..scene.placement import expanded, placed_meshes, places
from ..scene.scene import Scene
from .optimisers import AdamMatrix, AdamUniform

F64 = NDArray[np.float64]

# Memory of the squared gradient. The usual 0.999 keeps the large gradients of the start in mind longer
# than most fits last, and slows their end down.
BETA2 = 0.98
# First steps: radians (of poses also of moves, as a fraction of the extent), and of positions as that fraction.
TURN_STEP = 0.02
MOVE_STEP = 0.02


class Positions:
    """A point in space."""

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = (MOVE_STEP if step is None else step) * scene_extent(scene)
        self._optimiser = AdamUniform(self.step, beta2=BETA2)

    def take_step(self, gradient: F64, factor: float) -> Any:
        self.value = self._optimiser.update(self.value, gradient, factor)
        return self.value


class Directions:
    """Directions (..., 3): they turn and keep their lengths."""

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = TURN_STEP if step is None else step
        self._length = np.linalg.norm(self.value, axis=-1, keepdims=True)
        self._optimiser = AdamUniform(self.step, beta2=BETA2)

    def take_step(self, gradient: F64, factor: float) -> Any:
        unit = self.value / self._length
        # By the unit direction, and across it.
        across = self._length * (gradient - unit * np.sum(unit * gradient, axis=-1, keepdims=True))
        turned = self._optimiser.update(unit, across, factor)
        self.value = self._length * turned / np.linalg.norm(turned, axis=-1, keepdims=True)
        return self.value


class Poses:
    """Transforms (..., 4, 4) that move rigidly, or rotations (3, 3) that turn.

    A step turns about the pivot by a vector w (radians) and moves by t: linear part A and offset m become R A and
    R (m - pivot) + pivot + t. With gradients g_j of the columns c_j of (A, m - pivot), that of w is the sum of
    c_j x g_j, that of t is g_3. One optimiser sees both, t in units of the extent.
    """

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = TURN_STEP if step is None else step
        self._pivot, self._extent = _pivot_and_extent(scene, path, self.value)
        self._optimiser = AdamMatrix(self.step)

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


def rotations(vectors: F64) -> F64:
    """(..., 3, 3) rotations about axes (..., 3) by their lengths in radians (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*vectors.shape, 3)
    # sin(a)/a and (1 - cos(a))/a^2, both of which have limits at 0.
    half = np.sinc(angle / (2.0 * np.pi))
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * skew + 0.5 * half * half * (skew @ skew))


def scene_extent(scene: Scene) -> float:
    """Diagonal of the bounding box of all that stands in the scene, metres; 1 if that is nothing."""
    corners = [corner for mesh in placed_meshes(scene) for corner in _box(mesh)]
    return float(np.linalg.norm(np.ptp(corners, axis=0))) or 1.0 if corners else 1.0


def _box(mesh: Mesh) -> F64:
    """(k, 3) corners that span all copies of a mesh."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    place = places(mesh)
    return np.asarray((np.einsum("kij,nj->kni", place[:, :, :3], corners) + place[:, None, :, 3]).reshape(-1, 3))


def depth_seen(scene: Scene, camera: Camera) -> float:
    """Depth of what a camera sees: the median of the vertices in its picture, else of those before it.

    A camera that turns about what it sees, instead of about itself, keeps it in the picture: of the two ways to move
    the picture aside, turning and moving, only one is left, and they no longer work against each other.
    """
    points = np.concatenate([np.zeros((0, 3)), *(expanded(mesh).vertices for mesh in placed_meshes(scene))])
    depth = depths(camera, points)
    before = depth > 0.0
    seen = before & in_picture(camera, points)
    chosen = depth[seen] if seen.any() else depth[before]
    return float(np.median(chosen)) if len(chosen) else scene_extent(scene)


def _pivot_and_extent(scene: Scene, path: str, value: F64) -> tuple[F64, float]:
    """What a pose turns about, and the extent that its moves go by."""
    held, field = parameters.owner(scene, path)
    if isinstance(held, Camera):
        return value[:3, 3] - depth_seen(scene, held) * value[:3, 2], scene_extent(scene)
    if not isinstance(held, Mesh):
        return value[..., :3, -1], scene_extent(scene)
    corners = _box(held)
    extent = float(np.linalg.norm(np.ptp(corners, axis=0))) or 1.0
    if field == "transform":
        return 0.5 * (corners.min(axis=0) + corners.max(axis=0)), extent
    # Instances turn within the object's transform, each about its own middle.
    middle = 0.5 * (held.vertices.min(axis=0) + held.vertices.max(axis=0))
    return value[:, :3, :3] @ middle + value[:, :3, 3], extent

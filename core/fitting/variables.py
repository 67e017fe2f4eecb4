"""What an optimiser moves for each parameter: its step, its limits, and for vertices the preconditioner."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..geometry import topology
from ..scene import parameters
from ..scene.mesh import Mesh
from ..scene.scene import Scene
from .bounds import first_step, limits
from .large_steps import LargeSteps
from .optimisers import Adam, AdamUniform
from .rigid_variables import BETA2, Directions, Poses, Positions

F64 = NDArray[np.float64]

# Default of the first step of vertices as a fraction of their mesh's bounding box diagonal.
VERTEX_STEP = 0.02
# Share of the motion along the surface that closed meshes keep; those with open borders keep all.
SLIDE = 0.2


class Unknown(Protocol):
    """One parameter of a fit."""

    path: str
    step: float

    def take_step(self, gradient: F64, factor: float) -> Any:
        """The parameter's next value, after a step of `factor` times the parameter's own length."""
        ...


class Values:
    """Numbers, colours, texels: Adam on the values themselves, clipped to their range."""

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = first_step(scene, path) if step is None else step
        self.limits = limits(scene, path)
        self._optimiser = Adam(self.step, beta2=BETA2)

    def take_step(self, gradient: F64, factor: float) -> Any:
        self.value = np.clip(self._optimiser.update(self.value, gradient, factor), *self.limits)
        return self.value


class Vertices:
    """A mesh's vertices: AdamUniform on the preconditioned, welded positions.

    A picture of a smooth surface tells, to first order, only its motion along the normal. What the
    preconditioner makes of that has parts along the surface as well: a growing bump drags the
    vertices around it along. These change no shape, but let vertices drift from where they belong,
    so only the share `slide` of them is kept. With T = n n^T + slide (1 - n n^T) a step is
    T (I + lambda L)^-2 T times the gradient: symmetric and positive, so it still goes downhill.
    """

    def __init__(
        self, scene: Scene, path: str, step: float | None, smoothness: float | None, slide: float | None
    ) -> None:
        self.path = path
        mesh: Mesh = parameters.owner(scene, path)[0]
        self.value = mesh.vertices
        extent = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
        if not extent > 0.0:
            raise ValueError(f"parameter '{path}': all vertices are at one place; the mesh has no extent to move by")
        self.step = (VERTEX_STEP if step is None else step) * extent
        self._steps = LargeSteps(mesh.vertices, mesh.faces, smoothness)
        self._faces = mesh.faces
        self._slide = slide if slide is not None else SLIDE if _closed(mesh.faces, self._steps.label) else 1.0
        self._optimiser = AdamUniform(1.0, beta2=BETA2)
        self._length: float | None = None

    def take_step(self, gradient: F64, factor: float) -> Any:
        filtered = self._steps.gradient(self._restrained(gradient))
        move = self._optimiser.update(np.zeros_like(filtered), filtered, factor)
        if not move.any():
            return self.value
        change = self._restrained(self._steps.vertices(move))
        if self._length is None:
            # The filter shortens what is local by up to lambda times the degree. The length of a step is
            # meant in space, so the first one is stretched to it, and all later ones by as much.
            longest = float(np.linalg.norm(change, axis=1).max())
            self._length = factor * self.step / longest if longest > 0.0 else None
        # All copies of a welded vertex get the same change, so seams can't tear.
        self.value = self.value + (1.0 if self._length is None else self._length) * change
        return self.value

    def _restrained(self, vectors: F64) -> F64:
        """T times vectors at the vertices."""
        if self._slide == 1.0:
            return vectors
        normal = vertex_normals(self.value, self._faces, self._steps.label)
        along = np.einsum("ij,ij->i", vectors, normal)[:, None] * normal
        free = ~normal.any(axis=1)  # no normal, no direction to prefer
        return np.where(free[:, None], vectors, self._slide * vectors + (1.0 - self._slide) * along)


def vertex_normals(vertices: F64, faces: NDArray[np.integer], label: NDArray[np.int64]) -> F64:
    """(n, 3) unit normals, the mean of the faces at each welded vertex by area; 0 where that is 0."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice_area = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    at = label[faces.ravel()]
    count = int(label.max()) + 1
    total = np.stack([np.bincount(at, twice_area[:, axis], minlength=count) for axis in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray((total / np.where(length > 0.0, length, 1.0))[label])


def _closed(faces: NDArray[np.int32], label: NDArray[np.int64]) -> bool:
    """Whether no edge is an open border, whose vertices show their motion along the surface."""
    return bool((np.diff(topology.edges(faces, label).face_first.astype(np.int64)) > 1).all())


def unknown(
    scene: Scene, path: str, step: float | None, smoothness: float | None, slide: float | None
) -> Unknown:
    """The unknown of a parameter; `step`, `smoothness` and `slide` None: the defaults above."""
    field = parameters.split(path)[2]
    if field == "vertices":
        return Vertices(scene, path, step, smoothness, slide)
    if field == "position":
        return Positions(scene, path, step)
    if field in ("direction", "normals"):
        return Directions(scene, path, step)
    if field in ("to_world", "transform", "instances", "rotation"):
        return Poses(scene, path, step)
    return Values(scene, path, step)

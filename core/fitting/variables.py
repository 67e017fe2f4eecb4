"""Optimised variables: for each parameter its optimiser, step size and limits, for vertices also the preconditioner."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..geometry import topology
from ..scene import parameters
from ..scene.mesh import Mesh
from ..scene.scene import Scene
from .bounds import first_step, limits
from .fields.variables import Coefficients, FieldSteps
from .large_steps import LargeSteps
from .optimisers import Adam, AdamUniform
from .resumable import Resumable, State
from .rigid_variables import BETA2, Directions, Poses, Positions

F64 = NDArray[np.float64]

# Default first step of vertices, as a fraction of the diagonal of the mesh's bounding box.
VERTEX_STEP = 0.02
# Default factor for the tangential motion of vertices of closed meshes. A smaller value keeps vertices evenly spaced,
# but material borders and UV maps cannot move along the surface.
SLIDE = 0.2


class Unknown(Protocol):
    """The variable of one parameter of a fit."""

    path: str
    step: float

    def take_step(self, gradient: F64, factor: float) -> Any:
        """Make one step, of `factor` times the step length of the parameter, and return the next value."""
        ...

    def state(self) -> State:
        """Return what steps change (`Resumable`)."""
        ...

    def restore(self, state: State) -> None:
        """Take over what `state` has returned."""
        ...


class Values(Resumable):
    """Numbers, colours and texels: Adam on the values, which are clipped to their range."""

    changing = ("value", "_optimiser")

    def __init__(self, scene: Scene, path: str, step: float | None) -> None:
        self.path = path
        self.value = np.array(parameters.get(scene, path), np.float64)
        self.step = first_step(scene, path) if step is None else step
        self.limits = limits(scene, path)
        self._optimiser = Adam(self.step, beta2=BETA2)

    def take_step(self, gradient: F64, factor: float) -> Any:
        self.value = np.clip(self._optimiser.update(self.value, gradient, factor), *self.limits)
        return self.value


class Vertices(Resumable):
    """The vertices of a mesh: AdamUniform on the preconditioned, welded positions (`LargeSteps`).

    To first order, only the normal motion of a smooth surface changes its picture. The preconditioner turns such a
    gradient into a step that also has tangential parts: a growing bump drags the vertices around it along. Tangential
    motion does not change the shape, but it makes the vertices drift. Therefore it is scaled by `slide`. With
    T = n n^T + slide (1 - n n^T), a step is T (I + lambda L)^-2 T times the gradient. This matrix is symmetric and
    positive, so the step is a descent direction.
    """

    changing = ("value", "_optimiser", "_length")

    def __init__(
        self, path: str, vertices: F64, faces: NDArray[np.int32], step: float | None, smoothness: float | None,
        slide: float | None,
    ) -> None:
        self.path = path
        self.value = vertices
        extent = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        if not extent > 0.0:
            raise ValueError(f"parameter '{path}': all vertices are at one place, so the mesh has no extent that sets "
                             "the length of a step; separate its vertices")
        self.step = (VERTEX_STEP if step is None else step) * extent
        self._steps = LargeSteps(vertices, faces, smoothness)
        self._faces = faces
        self._slide = slide if slide is not None else SLIDE if _closed(faces, self._steps.label) else 1.0
        self._optimiser = AdamUniform(1.0, beta2=BETA2)
        self._length: float | None = None

    def take_step(self, gradient: F64, factor: float) -> Any:
        filtered = self._steps.gradient(self._restrained(gradient))
        move = self._optimiser.update(np.zeros_like(filtered), filtered, factor)
        if not move.any():
            return self.value
        change = self._restrained(self._steps.vertices(move))
        if self._length is None:
            # The filter shortens a local step by a factor of up to lambda times the degree. `step` is a length in
            # space: the first step is scaled to this length, and all later steps by the same factor.
            longest = float(np.linalg.norm(change, axis=1).max())
            self._length = factor * self.step / longest if longest > 0.0 else None
        # All copies of a welded vertex get the same change, so a seam cannot tear.
        self.value = self.value + (1.0 if self._length is None else self._length) * change
        return self.value

    def _restrained(self, vectors: F64) -> F64:
        """Multiply vectors at the vertices by T: scale their tangential part by `slide`."""
        if self._slide == 1.0:
            return vectors
        normal = vertex_normals(self.value, self._faces, self._steps.label)
        normal_part = np.einsum("ij,ij->i", vectors, normal)[:, None] * normal
        free = ~normal.any(axis=1)  # vertices without a normal move freely
        return np.where(free[:, None], vectors, self._slide * vectors + (1.0 - self._slide) * normal_part)


def vertex_normals(vertices: F64, faces: NDArray[np.integer], label: NDArray[np.int64]) -> F64:
    """(n, 3) unit vertex normals: area-weighted mean over the faces at each welded vertex; 0 if the mean is 0."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice_area = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    at = label[faces.ravel()]
    count = int(label.max()) + 1
    total = np.stack([np.bincount(at, twice_area[:, axis], minlength=count) for axis in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray((total / np.where(length > 0.0, length, 1.0))[label])


def _closed(faces: NDArray[np.int32], label: NDArray[np.int64]) -> bool:
    """Whether the mesh has no open border. Tangential motion of a border changes the shape."""
    return bool((np.diff(topology.edges(faces, label).face_first.astype(np.int64)) > 1).all())


def unknown(
    scene: Scene, path: str, step: float | None, smoothness: float | None, slide: float | None,
    iterations: int = 1, field_steps: FieldSteps | None = None,
) -> Unknown:
    """Make the variable of a parameter; None for `step`, `smoothness`, `slide` or `field_steps` means its default."""
    collection, _, field = parameters.split(path)
    if collection == "fields" and field == "values":
        return Coefficients(scene, path, step, iterations, field_steps)
    if field == "vertices":
        mesh: Mesh = parameters.owner(scene, path)[0]
        return Vertices(path, mesh.vertices, mesh.faces, step, smoothness, slide)
    if field == "position":
        return Positions(scene, path, step)
    if field in ("direction", "across", "normals"):
        return Directions(scene, path, step)
    if field in ("to_world", "transform", "instances", "rotation"):
        return Poses(scene, path, step)
    return Values(scene, path, step)

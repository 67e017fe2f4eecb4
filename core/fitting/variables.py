"""Optimised variables: for each parameter its optimiser, step size and limits."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..scene import parameters
from ..scene.mesh import Mesh
from ..scene.scene import Scene
from .bounds import first_step, limits
from .checkpoints.resumable import Resumable, State
from .fields.grids import Attribute
from .fields.schedule import FieldSteps
from .fields.variables import Coefficients
from .optimisers import Adam
from .rigid_variables import BETA2, Corners, Directions, Poses, Positions
from .vertices.rules import VertexRules
from .vertices.variables import Vertices

F64 = NDArray[np.float64]


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


def unknown(
    scene: Scene, path: str, step: float | None, smoothness: float | None, slide: float | None,
    iterations: int = 1, field_steps: FieldSteps | None = None, rules: VertexRules | None = None,
) -> Unknown:
    """Make the variable of a parameter; None for an option means its default."""
    collection, _, field = parameters.split(path)
    if collection == "fields" and field == "values":
        return Coefficients(scene, path, step, iterations, field_steps)
    if collection == "fields" and parameters.layer_of(field) is not None:
        return Attribute(scene, path, step, iterations, field_steps)
    if field == "vertices":
        mesh: Mesh = parameters.owner(scene, path)[0]
        return Vertices(path, mesh.vertices, mesh.faces, step, smoothness, slide, iterations, rules)
    if field == "position":
        return Positions(scene, path, step)
    if field in ("lower", "upper"):
        return Corners(scene, path, step)
    if field in ("direction", "across", "normals"):
        return Directions(scene, path, step)
    if field in ("to_world", "transform", "instances", "rotation"):
        return Poses(scene, path, step)
    return Values(scene, path, step)

"""A ball to be fitted, and the state of a scene before and after a fit."""

from __future__ import annotations

from typing import Any

import numpy as np

import edgegrad
from edgegrad import Scene
from edgegrad.scene import parameters
from tests.support import shapes

VERTICES, COLOR, POWER = "meshes.object.vertices", "materials.clay.base_color", "lights.lamp.power"


def ball(radius: float = 1.0) -> Scene:
    return shapes.scene(*shapes.ball(2, radius))


def picture(scene: Scene, **options: Any) -> np.ndarray:
    return edgegrad.Renderer(scene).render(spp=64, seed=12345, **options)


def state(scene: Scene) -> dict[str, np.ndarray]:
    return {path: np.array(parameters.get(scene, path), copy=True) for path in parameters.paths(scene)}


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[path], b[path]) for path in a)

"""Why a fit finds no gradient for a parameter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import parameters
from .scene import Scene


def why_untouched(scene: Scene, losses: NDArray[np.float64], path: str) -> str:
    """The likeliest reason why the gradient of the parameter `path` is zero everywhere.

    `losses` are those of the pictures.
    """
    collection, name, fieldname = parameters.split(path)
    if not losses.any():
        return "the pictures already equal their targets"
    if collection == "materials" and not any(name in mesh.materials for mesh in scene.meshes.values()):
        return "no mesh uses this material"
    if collection == "lights" and fieldname == "color" and np.size(parameters.get(scene, path)):
        held = parameters.owner(scene, path)[0]
        if not getattr(held, "power", getattr(held, "strength", 1.0)):
            return "this light's power is 0"
    if collection == "world" and fieldname == "color" and not scene.world.strength:
        return "the world's strength is 0"
    if fieldname in ("power", "strength") and not np.any(parameters.owner(scene, path)[0].color):
        return "its colour is black"
    return "nothing that the cameras see depends on it (out of view, hidden, unlit, or all of it masked)"

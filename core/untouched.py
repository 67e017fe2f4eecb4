"""Why a fit finds no gradient for a parameter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import parameters
from .material import Mixture
from .scene import Scene
from .table_derivatives import asked_tables, wanted_tables
from .tables import flatten


def why_untouched(scene: Scene, losses: NDArray[np.float64], path: str) -> str:
    """The likeliest reason why the gradient of the parameter `path` is zero everywhere.

    `losses` are those of the pictures.
    """
    collection, name, fieldname = parameters.split(path)
    if not losses.any():
        return "the pictures already equal their targets"
    if collection == "materials" and not _is_used(scene, name):
        return "no mesh uses this material"
    tables = asked_tables(scene, flatten(scene), [path])
    if not wanted_tables(scene, tables, [path]):
        return "nothing of the picture reads it (it is textured, or of no effect on what has no size)"
    if collection == "lights" and fieldname == "color" and np.size(parameters.get(scene, path)):
        held = parameters.owner(scene, path)[0]
        if not getattr(held, "power", getattr(held, "strength", 1.0)):
            return "this light's power is 0"
    if collection == "world" and fieldname == "color" and not scene.world.strength:
        return "the world's strength is 0"
    if fieldname in ("power", "strength") and not np.any(parameters.owner(scene, path)[0].color):
        return "its colour is black"
    return "nothing that the cameras see depends on it (out of view, hidden, unlit, or all of it masked)"


def _is_used(scene: Scene, name: str) -> bool:
    """Whether a mesh has the material, or a mixture that it is a part of."""
    users = {name, *(other for other, m in scene.materials.items() if isinstance(m, Mixture) and name in m.parts)}
    return any(not users.isdisjoint(mesh.materials) for mesh in scene.meshes.values())

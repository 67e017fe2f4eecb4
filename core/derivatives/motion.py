"""What moves along a tangent of some parameters: meshes, the camera, lights, the environment."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ..scene import parameters
from ..scene.scene import Scene
from ..tables.tables import Tables
from .table_derivatives import requested_tables

# Fields of lights that change how much they shine and move nothing.
STRENGTH = ("power", "strength", "color")


@dataclass(frozen=True)
class Motion:
    """What moves.

    Attributes
    ----------
    meshes, lights
        Names, in the scene's order.
    camera
        Whether pixels' rays move: by its pose, projection or lens.
    sky
        Whether the environment turns.
    """

    meshes: tuple[str, ...]
    camera: bool
    lights: tuple[str, ...]
    sky: bool

    @property
    def any(self) -> bool:
        """Whether anything moves."""
        return bool(self.meshes or self.camera or self.lights or self.sky)


def may_move(path: str) -> bool:
    """Whether a parameter may move anything: then edges sweep over the picture, or between surfaces and lights."""
    collection, _, field = parameters.split(path)
    return (
        field in ("vertices", "instances", "transform", "rotation")
        or collection == "camera"
        or (collection == "lights" and field not in STRENGTH)
    )


def motion(scene: Scene, tables: Tables, wrt: Collection[str]) -> Motion:
    """What moves with the parameters `wrt` of a scene with tables of `table_derivatives.with_requested`."""
    wanted = requested_tables(scene, tables, wrt)
    moving = np.zeros(len(tables.vertices), bool)
    for first, last in wanted.get("vertices", ()):
        moving[first:last] = True
    placed = np.zeros(len(tables.mesh_names), bool)
    for first, last in wanted.get("instance_to_world", ()):
        placed[tables.instance_mesh[first:last]] = True
    before = np.concatenate([[0], np.cumsum(moving)])[tables.mesh_first_vertex]
    placed |= np.diff(before)[: len(placed)] > 0
    meshes = [tables.mesh_names[k] for k in np.flatnonzero(placed)]
    split = [parameters.split(path) for path in wrt]
    lights = {name for collection, name, field in split if collection == "lights" and field not in STRENGTH}
    return Motion(
        tuple(meshes), "camera" in wanted, tuple(name for name in scene.lights if name in lights),
        "environment_rotation" in wanted,
    )

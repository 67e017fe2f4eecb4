"""The scene: everything that is rendered, as validated dataclasses of numpy arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import array, number
from .camera import Camera
from .light import Light
from .material import Material
from .mesh import Mesh


@dataclass
class World:
    """The constant environment: radiance color * strength from every direction.

    Attributes
    ----------
    color
        (3,) linear Rec.709, >= 0.
    strength
        W/(m² sr), >= 0.
    """

    color: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    strength: float = 1.0

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        self.color = array("world", "color", self.color, (3,), np.float64, least=0.0)
        self.strength = number("world", "strength", self.strength, least=0.0)


@dataclass
class Scene:
    """Camera, meshes, materials, lights and world, each by the name that its parameter path uses.

    Raises
    ------
    ValueError
        From `validate` (called by every function that renders), naming the object and the field.
    """

    camera: Camera
    meshes: Mapping[str, Mesh] = field(default_factory=dict)
    materials: Mapping[str, Material] = field(default_factory=dict)
    lights: Mapping[str, Light] = field(default_factory=dict)
    world: World = field(default_factory=World)

    def validate(self) -> None:
        """Check every field; arrays of another type are converted, wrong ones raise."""
        if not isinstance(self.camera, Camera):
            raise ValueError("scene: has no camera")
        self.camera.validate()
        for name, material in self.materials.items():
            material.validate(name)
        for name, mesh in self.meshes.items():
            mesh.validate(name)
            for slot in mesh.materials:
                if slot not in self.materials:
                    raise ValueError(f"mesh '{name}': material '{slot}' is not in the scene")
        for name, light in self.lights.items():
            light.validate(name)
        self.world.validate()
        if not self._emits():
            raise ValueError("scene: nothing gives light; add a light, an emissive material or a world colour")

    def _emits(self) -> bool:
        used = {slot for mesh in self.meshes.values() for slot in mesh.materials}
        return (
            bool(self.lights)
            or bool(np.any(self.world.color * self.world.strength > 0.0))
            or any(np.any(self.materials[name].emission > 0.0) for name in used)
        )

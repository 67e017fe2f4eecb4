"""The scene: everything that is rendered, as validated dataclasses of numpy arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import RAYS, array, derived, number, rays
from .camera import Camera
from .expression import images_of
from .image import Image
from .light import Light
from .material import Material, Mixture
from .mesh import Mesh


@dataclass
class World:
    """The environment: radiance color * strength, times the image's where there is one, from every direction.

    Attributes
    ----------
    color
        (3,) linear Rec.709, >= 0.
    strength
        W/(m² sr), >= 0.
    image
        Name of an equirectangular image in the scene, or None. Direction d of the image's own space is at
        u = 0.5 - atan2(d.y, d.x) / (2 pi) of its width, v = 0.5 + asin(d.z) / pi of its height above the
        lower edge (Blender's Environment Texture).
    rotation
        (3, 3) rotation from world space to the image's own space.
    visible_to
        Kinds of rays that see it: a subset of "camera", "diffuse", "glossy", "transmission".
    """

    color: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    strength: float = 1.0
    image: str | None = None
    rotation: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    visible_to: frozenset[str] = frozenset(RAYS)

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        self.color = array("world", "color", self.color, (3,), np.float64, least=0.0)
        self.strength = number("world", "strength", self.strength, least=0.0)
        derived("world", "color times strength", self.color * self.strength)
        self.rotation = array("world", "rotation", self.rotation, (3, 3), np.float64)
        if not np.allclose(self.rotation @ self.rotation.T, np.eye(3), atol=1e-4):
            raise ValueError("world: rotation must be a rotation; its axes are not orthonormal")
        self.visible_to = rays("world", "visible_to", self.visible_to)


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
    materials: Mapping[str, Material | Mixture] = field(default_factory=dict)
    lights: Mapping[str, Light] = field(default_factory=dict)
    world: World = field(default_factory=World)
    images: Mapping[str, Image] = field(default_factory=dict)

    def validate(self) -> None:
        """Check every field; arrays of another type are converted, wrong ones raise."""
        if not isinstance(self.camera, Camera):
            raise ValueError("scene: has no camera")
        self.camera.validate()
        for name, material in self.materials.items():
            material.validate(name)
        for name, mesh in self.meshes.items():
            mesh.validate(name)
        for name, light in self.lights.items():
            light.validate(name)
        for name, image in self.images.items():
            image.validate(name)
        self.world.validate()
        self._check_names()
        if not self._is_lit():
            raise ValueError("scene: nothing gives light; add a light, an emissive material or a world colour")

    def leaves(self, name: str) -> list[Material]:
        """The shaders that a material is the sum of: itself, or a mixture's parts."""
        material = self.materials[name]
        if isinstance(material, Material):
            return [material]
        return [part for key in material.parts if isinstance(part := self.materials[key], Material)]

    @property
    def used_materials(self) -> list[str]:
        """Names of the materials that faces of some mesh have, in the order of `materials`."""
        used = {name for mesh in self.meshes.values() for name in mesh.used_materials}
        return [name for name in self.materials if name in used]

    def emits(self, mesh_name: str) -> bool:
        """Whether a face of the mesh may give light of its own."""
        return any("emission" in leaf.textures or bool(np.any(leaf.emission > 0.0))
                   for name in self.meshes[mesh_name].used_materials for leaf in self.leaves(name))

    def _check_names(self) -> None:
        for name, material in self.materials.items():
            for part in material.parts if isinstance(material, Mixture) else ():
                if not isinstance(self.materials.get(part), Material):
                    raise ValueError(f"material '{name}': part '{part}' is not a shader in the scene")
            for value in material.textures.values():
                for image in images_of(value):
                    if image not in self.images:
                        raise ValueError(f"material '{name}': image '{image}' is not in the scene")
        for name, mesh in self.meshes.items():
            for slot in mesh.materials:
                if slot not in self.materials:
                    raise ValueError(f"mesh '{name}': material '{slot}' is not in the scene")
        for name, light in self.lights.items():
            for key in (*(light.receivers or ()), *(light.blockers or ())):
                if key not in self.meshes:
                    raise ValueError(f"light '{name}': mesh '{key}' is not in the scene")
        if self.world.image is not None and self.world.image not in self.images:
            raise ValueError(f"world: image '{self.world.image}' is not in the scene")

    def _is_lit(self) -> bool:
        return (
            bool(self.lights)
            or bool(np.any(self.world.color * self.world.strength > 0.0))
            or any(self.emits(name) for name in self.meshes)
        )

"""The scene: everything that is rendered, as dataclasses of numpy arrays, and its validation."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import RAYS, array, derived, instance, mapping, number, orthonormal, rays, shown, text
from .._fields import Check, Checked, by, near, optional
from ..expression import images_of, required_attributes
from .camera import Camera
from .field import Field
from .image import Image
from .light import AreaLight, Light, PointLight, SpotLight, SunLight
from .material import Material, Mixture
from .medium import Medium
from .mesh import Mesh


@dataclass
class World(Checked):
    """The environment: radiance color * strength from every direction, times the image if there is one.

    Attributes
    ----------
    color
        (3,) linear Rec.709, >= 0.
    strength
        W/(m² sr), >= 0.
    image
        Name of an equirectangular image in the scene, or None. A direction d in image space is at the fraction
        u = 0.5 - atan2(d.y, d.x) / (2 pi) of the width, and at the fraction v = 0.5 + asin(d.z) / pi of the
        height above the lower edge (Blender's Environment Texture).
    rotation
        (3, 3) rotation from world space to image space.
    visible_to
        Kinds of rays that see the environment: a subset of "camera", "diffuse", "glossy", "transmission".
    medium
        What fills the space around the meshes; None: nothing. It has no end, so that it hides the environment and suns.
    """

    color: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    strength: float = 1.0
    image: str | None = None
    rotation: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    visible_to: frozenset[str] = frozenset(RAYS)
    medium: Medium | None = None

    checks: ClassVar[Mapping[str, Check]] = {
        "color": by(array, (3,), np.float64, least=0.0),
        "strength": by(number, least=0.0),
        "image": optional(text),
        "rotation": by(array, (3, 3), np.float64),
        "visible_to": rays,
        "medium": optional(by(instance, Medium)),
    }

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        self.check_fields("world")
        derived("world", "color times strength", self.color * self.strength)
        orthonormal("world", "rotation", self.rotation, "rotation")
        if self.medium is not None:
            self.medium.check_fields("world: medium")


@dataclass
class Scene(Checked):
    """Camera, meshes, materials, lights, world, images and fields; parameter paths use the names of the dicts.

    Raises
    ------
    ValueError
        From `validate`, which every function that renders calls; names the object and the field.
    """

    camera: Camera
    meshes: Mapping[str, Mesh] = field(default_factory=dict)
    materials: Mapping[str, Material | Mixture] = field(default_factory=dict)
    lights: Mapping[str, Light] = field(default_factory=dict)
    world: World = field(default_factory=World)
    images: Mapping[str, Image] = field(default_factory=dict)
    fields: Mapping[str, Field] = field(default_factory=dict)

    checks: ClassVar[Mapping[str, Check]] = {
        "camera": by(instance, Camera),
        "meshes": by(mapping, by(instance, Mesh)),
        "materials": by(mapping, by(instance, (Material, Mixture))),
        "lights": by(mapping, by(instance, (PointLight, SpotLight, SunLight, AreaLight))),
        "world": by(instance, World),
        "images": by(mapping, by(instance, Image)),
        "fields": by(mapping, by(instance, Field)),
    }

    def validate(self) -> None:
        """Check every field, and convert arrays to the dtypes that the package computes with."""
        if self.camera is None:
            raise ValueError("scene: has no camera; set camera to an edgegrad.Camera")
        self.check_fields("scene")
        self.camera.validate()
        for name, material in self.materials.items():
            material.validate(name)
        for name, mesh in self.meshes.items():
            mesh.validate(name)
        for name, light in self.lights.items():
            light.validate(name)
        for name, image in self.images.items():
            image.validate(name)
        for name, one in self.fields.items():
            one.validate(name)
        self.world.validate()
        self._check_names()
        if not self._is_lit():
            raise ValueError("scene: nothing emits light; add a light, an emissive material or a world colour")

    def closures(self, name: str) -> list[Material]:
        """Return the closures of a material: itself, or the parts of a mixture."""
        material = self.materials[name]
        if isinstance(material, Material):
            return [material]
        return [part for key in material.parts if isinstance(part := self.materials[key], Material)]

    @property
    def used_materials(self) -> list[str]:
        """Names of the materials that some face or field uses, in the order of `materials`."""
        used = {name for mesh in self.meshes.values() for name in mesh.used_materials}
        used |= {one.material for one in self.fields.values()}
        return [name for name in self.materials if name in used]

    def meshes_with(self, materials: Collection[str]) -> list[str]:
        """Names of the meshes with faces of at least one of these materials."""
        sought = frozenset(materials)
        if not sought:
            return []
        return [name for name, mesh in self.meshes.items() if not sought.isdisjoint(mesh.used_materials)]

    @property
    def emitters(self) -> list[str]:
        """Names of the meshes with faces whose material may emit light."""
        return self.meshes_with([name for name in self.materials if self._emits(name)])

    def emits(self, mesh_name: str) -> bool:
        """Whether a face of the mesh has a material that may emit light."""
        return any(map(self._emits, self.meshes[mesh_name].used_materials))

    def _emits(self, material: str) -> bool:
        return any(closure.emits for closure in self.closures(material))

    def check_medium(self, name: str) -> None:
        """Check that the parts of a mixture have the same medium."""
        if len({closure.medium for closure in self.closures(name)}) > 1:
            raise ValueError(f"material '{name}': its parts have different media; give all the same")

    def _check_names(self) -> None:
        for name, material in self.materials.items():
            for part in material.parts if isinstance(material, Mixture) else ():
                if not isinstance(self.materials.get(part), Material):
                    raise ValueError(f"material '{name}': part '{part}' is not a shader in the scene")
            self.check_medium(name)
            for value in material.textures.values():
                for image in images_of(value):
                    _check_known(f"material '{name}': image", image, self.images)
        for name, mesh in self.meshes.items():
            for slot in mesh.materials:
                _check_known(f"mesh '{name}': material", slot, self.materials)
        self._check_fields()
        self._check_attributes()
        for name, light in self.lights.items():
            for field_name in ("receivers", "blockers"):
                for key in getattr(light, field_name) or ():
                    if key not in self.fields:
                        _check_known(f"light '{name}': {field_name}: mesh", key, self.meshes)
        if self.world.image is not None:
            _check_known("world: image", self.world.image, self.images)

    def _check_attributes(self) -> None:
        """Refuse a texture that reads an attribute which no surface with the material has: likely it is misspelt."""
        needed = {name: {key for value in material.textures.values() for key in required_attributes(value)}
                  for name, material in self.materials.items() if material.textures}
        if not needed:
            return
        held: dict[str, list[set[str]]] = {}  # by material: the attributes of each surface
        surfaces = [(mesh.materials, {*mesh.attributes, *mesh.instance_attributes}) for mesh in self.meshes.values()]
        surfaces += [((one.material,), {*one.attributes}) for one in self.fields.values()]
        for slots, attributes in surfaces:
            for slot in slots:
                material = self.materials[slot]
                for part in (slot, *(material.parts if isinstance(material, Mixture) else ())):
                    held.setdefault(part, []).append(attributes)
        for name, keys in needed.items():
            there = set().union(*held.get(name, ()))
            for key in sorted(keys - there) if name in held else ():
                raise ValueError(f"material '{name}': textures read the attribute {shown(key)}, which is not in "
                                 f"attributes of any mesh or field with the material{near(key, there)}")

    def _check_fields(self) -> None:
        """Refuse materials of fields that need light samples on the surface, or a UV map."""
        for name, one in self.fields.items():
            where = f"field '{name}'"
            if name in self.meshes:
                raise ValueError(f"{where}: a mesh has this name too; rename one of them")
            _check_known(f"{where}: material", one.material, self.materials)
            for closure in self.closures(one.material):
                if closure.medium is not None:
                    raise ValueError(f"{where}: its material '{one.material}' has a medium, which fields cannot hold; "
                                     "use a material without it, or a mesh")
                if closure.emits:
                    raise ValueError(f"{where}: its material '{one.material}' emits light, which fields cannot do; "
                                     "use a material without emission, or a mesh")
                if "normal" in closure.textures and closure.normal_space == "TANGENT":
                    raise ValueError(f"{where}: its material '{one.material}' has a normal map, which needs a UV map; "
                                     "use a material without it, or a mesh")
                if "anisotropy" in closure.textures or closure.anisotropy != 0.0:
                    raise ValueError(f"{where}: its material '{one.material}' has an anisotropy, whose direction needs "
                                     "a UV map; set anisotropy to 0, or use a mesh")

    def _is_lit(self) -> bool:
        return (
            bool(self.lights)
            or bool(np.any(self.world.color * self.world.strength > 0.0))
            or bool(self.emitters)
        )


def _check_known(what: str, name: str, among: Mapping[str, Any]) -> None:
    if name not in among:
        raise ValueError(f"{what} {shown(name)} is not in the scene{near(name, among)}")


def validated(scene: Any) -> Scene:
    """Return `scene` after `Scene.validate`; refuse anything that is not a `Scene`."""
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be an edgegrad.Scene, not {shown(scene)}")
    scene.validate()
    return scene

"""The same scene in a world of another size: what floats compute of it must be the same for powers of two."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import AreaLight, Field, Material, Medium, Mixture, Scene, SunLight
from edgegrad.scene import parameters
from edgegrad.scene.light import Light
from edgegrad.scene.mesh import Mesh

F64 = NDArray[np.float64]
# Powers of lengths in the power of a light, by how it falls with the distance.
ORDERS = {"QUADRATIC": 2, "LINEAR": 1, "CONSTANT": 0}


def resized(scene: Scene, factor: float) -> Scene:
    """The scene with all lengths times `factor`, and with them the powers of lights, so that its picture stays."""
    camera = scene.camera
    lengths = ("clip_start", "clip_end", "ortho_width", "aperture_radius", "focus_distance")
    return replace(
        scene, meshes={name: _mesh(mesh, factor) for name, mesh in scene.meshes.items()},
        lights={name: _light(light, factor) for name, light in scene.lights.items()},
        fields={name: _field(one, factor) for name, one in scene.fields.items()},
        materials={name: _material(one, factor) for name, one in scene.materials.items()},
        world=replace(scene.world, medium=_medium(scene.world.medium, factor)),
        camera=replace(camera, to_world=_moved(camera.to_world, factor),
                       **{name: factor * getattr(camera, name) for name in lengths}),
    )  # fmt: skip


def resized_tangent(scene: Scene, path: str, value: Any, factor: float) -> F64:
    """A tangent of a parameter in the resized scene, along which the picture changes as much."""
    out, field = np.array(value, np.float64), path.rpartition(".")[2]
    if field in ("to_world", "transform", "instances"):
        out[..., :3, 3] *= factor
    elif field in ("vertices", "position", "radius", "size", "ortho_width", "aperture_radius", "focus_distance",
                   "lower", "upper"):  # fmt: skip
        out = out * factor
    elif field == "smooth":
        out = out * factor**2
    elif field in ("absorption", "scattering"):
        out = out / factor
    elif field == "power":
        out = out * factor ** ORDERS[parameters.owner(scene, path)[0].decay]
    return out


def _mesh(mesh: Mesh, factor: float) -> Mesh:
    return replace(
        mesh, vertices=factor * mesh.vertices, transform=_moved(mesh.transform, factor),
        instances=None if mesh.instances is None else _moved(mesh.instances, factor),
    )  # fmt: skip


def _field(field: Field, factor: float) -> Field:
    return replace(field, lower=factor * field.lower, upper=factor * field.upper,
                   transform=_moved(field.transform, factor))  # fmt: skip


def _material(material: Material | Mixture, factor: float) -> Material | Mixture:
    if isinstance(material, Mixture):
        return material
    return replace(material, absorption=material.absorption / factor, medium=_medium(material.medium, factor))


def _medium(medium: Medium | None, factor: float) -> Medium | None:
    if medium is None:
        return None
    return replace(medium, scattering=tuple(value / factor for value in medium.scattering),
                   absorption=tuple(value / factor for value in medium.absorption))  # fmt: skip


def _light(light: Light, factor: float) -> Light:
    if isinstance(light, SunLight):
        return light
    power, smooth = factor ** ORDERS[light.decay] * light.power, factor**2 * light.smooth
    if isinstance(light, AreaLight):
        return replace(light, power=power, smooth=smooth, to_world=_moved(light.to_world, factor),
                       size=factor * light.size)  # fmt: skip
    return replace(light, power=power, smooth=smooth, position=factor * light.position, radius=factor * light.radius)


def _moved(matrix: F64, factor: float) -> F64:
    out = matrix.copy()
    out[..., :3, 3] *= factor
    return out

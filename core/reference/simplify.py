"""Simplification of a scene to a flat-shaded, diffuse scene, which the reference engine can differentiate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .._check import RAYS
from ..scene.camera import Camera
from ..scene.light import AreaLight, Light, PointLight, SpotLight, SunLight
from ..scene.material import Material, Mixture
from ..scene.mesh import Mesh
from ..scene.placement import expanded, is_moved
from ..scene.scene import Scene, validated
from ..tables.materials import LAMBERTIAN, NORMAL_MAP, TRANSPARENCY, flags
from ..tables.mean_color import mean_color, mean_expression


def differentiable(scene: Scene) -> tuple[Scene, list[str]]:
    """Simplify a scene until the reference engine can differentiate it, with a sentence for each simplification.

    Surfaces become flat-shaded, opaque and Lambertian, with their mean colour. Instances become part of one mesh.
    Distance fields are left out. Lights lose their size, and the camera becomes a pinhole with a box filter. Meshes
    keep their vertices, so gradients with respect to them are valid for the original scene.
    """
    validated(scene)
    notes: list[str] = []
    camera = _camera(scene.camera, notes)
    materials = {name: _material(scene, name, notes) for name in scene.materials}
    meshes = {name: _mesh(name, mesh, notes) for name, mesh in scene.meshes.items()}
    lights = {name: _light(name, light, notes) for name, light in scene.lights.items()}
    notes += [f"field '{name}': is left out" for name in scene.fields]
    world = scene.world
    if world.image is not None or world.visible_to != frozenset(RAYS):
        notes.append("world: its mean colour replaces the image, and all rays see it")
        color = world.color
        if world.image is not None:
            color = color * mean_color(scene.images[world.image], sphere=True)
        world = replace(world, color=color, image=None, visible_to=frozenset(RAYS))
    if world.medium is not None:
        notes.append("world: its medium is left out")
        world = replace(world, medium=None)
    return Scene(camera, meshes, materials, lights, world), notes


def obstacles(scene: Scene) -> Iterator[str]:
    """Reasons why the reference engine has no exact derivatives of a scene; none after `differentiable`."""
    yield from differentiable(scene)[1]


def _camera(camera: Camera, notes: list[str]) -> Camera:
    if camera.kind != "PERSPECTIVE":
        notes.append(f"camera: {camera.kind.lower()} projection is replaced by a perspective of the same pose")
    if camera.aperture_radius > 0.0:
        notes.append("camera: depth of field is left out")
    if camera.pixel_aspect != 1.0:
        notes.append("camera: pixels are square")
    if camera.filter != "BOX" or camera.filter_width != 1.0:
        notes.append("camera: the pixel filter is a box of one pixel")
    return replace(camera, kind="PERSPECTIVE", aperture_radius=0.0, pixel_aspect=1.0, filter="BOX", filter_width=1.0)


def _material(scene: Scene, name: str, notes: list[str]) -> Material:
    material = scene.materials[name]
    closure = scene.closures(name)[0]
    simple = isinstance(material, Material) and not material.textures
    if closure.medium is not None:
        notes.append(f"material '{name}': its medium is left out")
        closure = replace(closure, medium=None)
    if simple and flags(closure) & LAMBERTIAN and not flags(closure) & (TRANSPARENCY | NORMAL_MAP):
        return closure
    notes.append(f"material '{name}': is replaced by a diffuse surface of its mean colour")
    if isinstance(material, Mixture):
        parts = [(scene.closures(name)[k], w) for k, w in enumerate(material.weights)]
    else:
        parts = [(closure, 1.0)]
    total = sum(w for _, w in parts) or 1.0
    base = sum((w / total * _mean(scene, part, "base_color") for part, w in parts), np.zeros(3))
    emission = sum((w * _mean(scene, part, "emission") for part, w in parts), np.zeros(3))
    return Material(np.clip(base, 0.0, 1.0), emission, any(part.emission_two_sided for part, _ in parts))


def _mean(scene: Scene, part: Material, field: str) -> NDArray[np.float64]:
    if field in part.textures:
        return mean_expression(scene, part.textures[field])
    return np.asarray(getattr(part, field), np.float64)


def _mesh(name: str, mesh: Mesh, notes: list[str]) -> Mesh:
    if mesh.smoothing is not None:
        notes.append(f"mesh '{name}': is shaded flat")
    if mesh.visible_to != frozenset(RAYS):
        notes.append(f"mesh '{name}': is visible to all rays")
    if mesh.instances is not None:
        notes.append(f"mesh '{name}': its {len(mesh.instances)} instances are one mesh")
    elif is_moved(mesh):
        notes.append(f"mesh '{name}': its transform is applied to its vertices")
    return replace(
        expanded(mesh), smoothing=None, normals=None, visible_to=frozenset(RAYS), attributes={}, terminator_offset=0.0
    )


def _light(name: str, light: Light, notes: list[str]) -> Light:
    plain = PointLight(np.zeros(3))
    if light.receivers is not None or light.blockers is not None or not light.casts_shadow:
        notes.append(f"light '{name}': lights all meshes, and all meshes cast its shadows")
    if light.max_bounces is not None:
        notes.append(f"light '{name}': lights paths of any number of bounces")
    light = replace(light, receivers=None, blockers=None, casts_shadow=True, max_bounces=None,
                    visible_to=plain.visible_to)  # fmt: skip
    if not isinstance(light, SunLight) and (light.decay != "QUADRATIC" or light.smooth > 0.0):
        notes.append(f"light '{name}': falls with the square of the distance")
        light = replace(light, decay=plain.decay, smooth=plain.smooth)
    if isinstance(light, SpotLight):
        notes.append(f"light '{name}': is replaced by a point light")
        light = PointLight(light.position, light.power, light.radius, light.sphere, color=light.color)
    if isinstance(light, PointLight) and light.radius > 0.0:
        notes.append(f"light '{name}': has no size, its shadows are hard")
        light = replace(light, radius=0.0)
    if isinstance(light, SunLight) and light.angle > 0.0:
        notes.append(f"light '{name}': has no angle, its shadows are hard")
        light = replace(light, angle=0.0)
    if isinstance(light, AreaLight) and light.spread < np.pi:
        notes.append(f"light '{name}': shines to all sides")
        light = replace(light, spread=float(np.pi))
    return light

"""Additions to random scenes: fields, normals by expressions, falloffs, negative lights, values of instances."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from edgegrad import Material, Mesh, Scene, SunLight
from edgegrad.expression import ImageTexture
from edgegrad.scene.light import DECAYS, Light
from edgegrad.scene.material import SMOOTH_NORMAL
from tests.support.scenes.world_sizes import ORDERS
from tests.torture.drawing.draw import Draw
from tests.torture.drawing.fields import fields
from tests.torture.drawing.textures import LAYERS, expression


def add_values(draw: Draw, scene: Scene, scale: float) -> None:
    """Give lights falloffs, instances values of their own, and materials normals in world space."""
    scene.lights = {name: _with_falloff(draw, light, scale) for name, light in scene.lights.items()}
    for mesh in scene.meshes.values():
        _add_instance_values(draw, mesh)
    scene.materials = {name: _with_normal(draw, one) if isinstance(one, Material) else one
                       for name, one in scene.materials.items()}  # fmt: skip


def add_fields(draw: Draw, scene: Scene, scale: float, at: np.ndarray) -> None:
    """Add fields about a place, some of which lights skip."""
    found, materials = fields(draw, scene.materials, scale)
    for one in found.values():
        one.transform = one.transform.copy()
        one.transform[:3, 3] += at
    scene.fields, scene.materials = found, {**scene.materials, **materials}
    for light in scene.lights.values():
        for linked in ("receivers", "blockers"):
            names = getattr(light, linked)
            if names is not None:
                setattr(light, linked, (*names, *(name for name in found if draw.chance(0.5))))


def turn_lights_negative(draw: Draw, scene: Scene) -> None:
    """Let some lights take light away."""
    scene.lights = {name: negative(light) if draw.chance(0.15) else light for name, light in scene.lights.items()}


def negative(light: Light) -> Light:
    """The light that takes away what a light gives."""
    if isinstance(light, SunLight):
        return replace(light, strength=-light.strength)
    return replace(light, power=-light.power)


def amount(light: Light) -> float:
    """The number that scales a light."""
    return light.strength if isinstance(light, SunLight) else light.power


def any_negative(scene: Scene) -> bool:
    """Whether something may take light away: a light, or an emission by an expression of any sign."""
    emissions = [m.textures["emission"] for m in scene.materials.values()
                 if isinstance(m, Material) and "emission" in m.textures]  # fmt: skip
    return any(amount(light) < 0.0 for light in scene.lights.values()) or not all(
        isinstance(one, ImageTexture) for one in emissions)


def _with_falloff(draw: Draw, light: Light, scale: float) -> Light:
    if isinstance(light, SunLight) or draw.chance(0.7):
        return light
    decay: Any = draw.one(DECAYS)
    power = light.power * scale ** (ORDERS[decay] - 2)
    return replace(light, decay=decay, power=power, smooth=scale**2 * draw.one((0.0, 1e-6, 1.0, 1e6)))


def _add_instance_values(draw: Draw, mesh: Mesh) -> None:
    free = [name for name in LAYERS if name not in mesh.attributes]
    if mesh.instances is None or not free or draw.chance(0.4):
        return
    spread = draw.one((1.0, 1.0, 0.0, 100.0))
    name = draw.one(free)
    values = spread * draw.rng.uniform(-0.2, 1.2, (len(mesh.instances), LAYERS[name]))
    mesh.instance_attributes = {name: values.astype(np.float32)}


def _with_normal(draw: Draw, material: Material) -> Material:
    if draw.chance(0.85):
        return material
    key, value = draw.one(("normal", "normal", SMOOTH_NORMAL)), expression(draw, draw.whole(1, 3))
    space = "WORLD" if key == "normal" else material.normal_space
    return replace(material, textures={**material.textures, key: value}, normal_space=space)

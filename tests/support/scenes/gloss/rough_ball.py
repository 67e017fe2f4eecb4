"""A ball whose lobes change their width."""

from __future__ import annotations

import numpy as np

from edgegrad import Image, Material, Scene, World
from tests.support import shapes

ROUGHNESS, COAT = "materials.clay.roughness", "materials.clay.coat_roughness"


def sky() -> Image:
    """A dark sky with a wide sun."""
    v, u = np.meshgrid((np.arange(16) + 0.5) / 16, (np.arange(32) + 0.5) / 32, indexing="ij")
    sun = 8.0 * np.exp(-80.0 * ((u - 0.7) ** 2 + 0.25 * (v - 0.3) ** 2))
    return Image((sun[..., None] * [1.0, 0.9, 0.7] + [0.1, 0.15, 0.2]).astype(np.float32))


def ball(theta: float = 0.0, **fields: float) -> Scene:
    """A coated dielectric over a floor of its own material, under an image."""
    vertices, faces = shapes.ball(2)
    scene = shapes.scene(vertices, faces)
    scene.camera.width, scene.camera.height = 24, 16
    low, floor = shapes.sheet(2, 8.0)
    scene.meshes = {**scene.meshes, "floor": shapes.scene(low - [0.0, 0.0, 1.0], floor).meshes["object"]}
    material = {"roughness": 0.35, "coat_roughness": 0.3, "specular_ior_level": 0.5, "coat_weight": 0.5} | fields
    material["roughness"] += theta
    material["coat_roughness"] += 0.5 * theta
    scene.materials = {"clay": Material(np.array([0.6, 0.5, 0.4]), **material)}
    scene.images, scene.world = {"sky": sky()}, World(np.ones(3), image="sky")
    return scene

"""Sheets of rough glass, and how they, what they see and who sees them change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import edgegrad
from tests.support.motions import camera_moves
from tests.support.rich_scene import turn
from tests.support.small_scenes import Floats, Make, camera

# Parameters that a sheet under the sky has, by what they are called in tables.
PARAMETERS = {
    "rotation": "world.rotation", "ior": "materials.glass.ior", "roughness": "materials.glass.roughness",
    "camera": "camera.to_world", "vertices": "meshes.sheet.vertices",
}  # fmt: skip


def glass(kind: str, ior: float, roughness: float) -> edgegrad.Material:
    """Tinted glass; of "PRINCIPLED" a part is plastic."""
    transmission = 0.8 if kind == "PRINCIPLED" else 0.0
    return edgegrad.Material(
        np.array([0.9, 0.8, 0.7]), kind=kind, ior=ior, roughness=roughness, transmission=transmission
    )


def sheet(smooth: bool = False) -> edgegrad.Mesh:
    """32 triangles that leave the picture on all sides, bent a little, with a UV map."""
    x, y = np.meshgrid(*2 * [np.linspace(-4.0, 4.0, 5)], indexing="ij")
    vertices = np.stack([x, y, 0.15 * np.sin(1.3 * x) + 0.1 * np.cos(1.7 * y)], 2).reshape(-1, 3)
    corner = np.arange(25).reshape(5, 5)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = np.concatenate([np.stack(t, 2).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]).astype(np.int32)
    uv = (vertices[faces, :2] + 4.0) / 8.0
    return edgegrad.Mesh(vertices, faces, ("glass",), attributes={"UVMap": uv}, smoothing=faces if smooth else None)


def sky() -> edgegrad.Image:
    """A smooth image, brighter on some sides than on others."""
    v, u = np.meshgrid((np.arange(16) + 0.5) / 16, (np.arange(32) + 0.5) / 32, indexing="ij")
    waves = [1.0 + np.sin(2 * np.pi * (u + k / 3)) * np.sin(np.pi * v) * (0.6 - 0.2 * k) + 0.3 * np.cos(np.pi * v)
             for k in range(3)]  # fmt: skip
    return edgegrad.Image(np.stack(waves, 2).astype(np.float32))


def under_sky(material: edgegrad.Material, smooth: bool = False) -> edgegrad.Scene:
    """The sheet, seen aslant, under the sky."""
    return edgegrad.Scene(
        camera((1.2, 0.5, 2.0), (0.1, 0.0, 0.0), size=16), {"sheet": sheet(smooth)}, {"glass": material},
        world=edgegrad.World(np.ones(3), 1.0, "sky", turn(0.2, 0.1, 0.4)), images={"sky": sky()},
    )  # fmt: skip


def changing(make: Callable[[], edgegrad.Scene], what: str) -> Make:
    """The scene with one of `PARAMETERS` changing."""
    if what == "camera":
        return camera_moves(make, (0.3, 0.4, 0.2))

    def at(theta: float) -> edgegrad.Scene:
        scene = make()
        if what == "rotation":
            rotation: Floats = turn(0.8 * theta, 0.3 * theta, 0.5 * theta) @ scene.world.rotation
            scene.world = replace(scene.world, rotation=rotation)
        elif what == "vertices":
            mesh = scene.meshes["sheet"]
            mesh.vertices = mesh.vertices + 0.3 * theta * np.random.default_rng(5).normal(size=mesh.vertices.shape)
        else:
            material = scene.materials["glass"]
            assert isinstance(material, edgegrad.Material)
            scene.materials = {**scene.materials, "glass": replace(material, **{what: getattr(material, what) + theta})}
        return scene

    return at

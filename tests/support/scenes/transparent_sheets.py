"""Sheets that let a part of the light through, over what they light."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np

import edgegrad
from edgegrad import Image, Material, Mixture
from edgegrad import expression as e
from edgegrad._check import RAYS
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.rich_scene import pose, turn
from tests.support.scenes.box_under_lights import scene_under
from tests.support.small_scenes import Floats, Make, camera, glowing, matte, rectangle

VIEW = camera((0, 1.6, 2.4), (0, 0, 0.1), 16)
UV = e.Attribute("UVMap")
UNSEEN = frozenset(RAYS) - {"camera"}


def sheet(height: float, material: str, size: float = 1.3, tilt: float = 0.2) -> edgegrad.Mesh:
    """A sheet over the floor whose UV map fills the unit square; the camera doesn't see it."""
    mesh = rectangle((0, height, 0), (0, tilt, size), (size, 0, 0), material)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    return replace(mesh, attributes={"UVMap": corners[mesh.faces]}, visible_to=UNSEEN)


def veiled(light: str, **materials: Material | Mixture) -> edgegrad.Scene:
    """A floor under one sheet for each material "veil...", lit by one light."""
    scene = scene_under(light)
    scene.camera = deepcopy(VIEW)
    del scene.meshes["box"], scene.materials["clay"]
    scene.materials.update(materials)
    for k, name in enumerate(name for name in materials if name.startswith("veil")):
        scene.meshes[name] = sheet(0.6 + 0.3 * k, name)
    return scene


def soft_mask(size: int = 8) -> Image:
    """Alphas between 0.1 and 0.9."""
    return Image(np.random.default_rng(7).uniform(0.1, 0.9, (size, size, 1)).astype(np.float32))


def masked(light: str) -> edgegrad.Scene:
    """A sheet that an image of alphas covers."""
    alpha = e.ImageTexture("mask", UV, extension="EXTEND")
    scene = veiled(light, veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": alpha}))
    scene.images["mask"] = soft_mask()
    return scene


def waves(*amplitudes: float) -> e.Expression:
    """A smooth alpha of waves across the sheet."""
    x = [e.Math("SINE", e.Math("MULTIPLY", e.Channel(UV, k), 9.0)) for k in range(2)]
    return e.Math("MULTIPLY_ADD", e.Math("MULTIPLY", x[0], x[1]), *(amplitudes or (0.4, 0.5)))


def rippled(light: str) -> edgegrad.Scene:
    return veiled(light, veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": waves()}))


def changed(make: Callable[[], edgegrad.Scene], path: str, rate: float | Floats) -> tuple[Make, list[str]]:
    """One parameter changes at a constant rate."""

    def at(theta: float) -> edgegrad.Scene:
        scene = deepcopy(make())
        parameters.put(scene, path, np.asarray(parameters.get(scene, path), np.float64) + theta * np.asarray(rate))
        return scene

    return at, [path]


def moved(make: Callable[[], edgegrad.Scene], name: str, rate: Floats) -> tuple[Make, list[str]]:
    """A mesh moves and is sheared."""
    scene = make()
    vertices = scene.meshes[name].vertices
    return changed(make, f"meshes.{name}.vertices", rate + 0.3 * (vertices - vertices.mean(axis=0))[:, [1, 2, 0]])


CLEAR = Material(np.array([0.7, 0.3, 0.2]), alpha=0.4)
GLASS = Material(np.array([0.9, 0.5, 0.2]), kind="TRANSPARENT")
PARTS = {"glass": GLASS, "clay": matte(0.5, 0.3, 0.1)}
HALF = Mixture(("glass", "clay"), np.array([0.6, 0.4]))
TEXELS = 0.5 * np.random.default_rng(3).normal(size=(8, 8, 1))


def one_material_twice() -> edgegrad.Scene:
    """Both sheets change."""
    scene = veiled("rectangle", veil=replace(CLEAR))
    scene.meshes["other"] = sheet(1.1, "veil", 0.8, -0.3)
    return scene


def bounced() -> edgegrad.Scene:
    """A floor that a wall lights, which a lamp behind a veil lights; all rays meet the veil."""
    return edgegrad.Scene(
        camera((0, 0.8, 2.0), (0, 0, 0), 16, 0.7),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 1), (1, 0, 0), "floor"),
            "wall": rectangle((0, 1.0, -1.0), (1, 0, 0), (0, 1, 0), "wall"),
            "shelf": rectangle((0, 1.5, 0.1), (0, 0, 0.6), (1, 0, 0), "wall"),
            "veil": replace(sheet(1.9, "veil", 1.0), visible_to=frozenset(RAYS)),
        },
        {"floor": matte(), "wall": matte(0.9, 0.8, 0.7), "veil": replace(CLEAR)},
        {"lamp": edgegrad.PointLight(np.array([0.2, 2.4, 0.1]), 200.0)},
    )  # fmt: skip


def dozen() -> edgegrad.Scene:
    """More sheets than a ray has room for at first."""
    alpha = e.Math("MULTIPLY", waves(), 0.3)
    scene = veiled("rectangle", veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": alpha}))
    for k in range(11):
        scene.meshes[f"veil{k}"] = sheet(0.7 + 0.1 * k, "veil", 1.3 - 0.05 * k, 0.02 * k)
    return scene


def in_metal() -> edgegrad.Scene:
    """A floor of rough metal, which scatters rays that no surface ends into the sky behind the sheet."""
    scene = rippled("sky")
    scene.materials["floor"] = Material(np.array([0.8, 0.7, 0.6]), kind="GLOSSY", roughness=0.6)
    return scene


def in_a_mirror() -> edgegrad.Scene:
    """A black sheet of waves before a glowing wall, both behind the camera."""
    veil = replace(rectangle((0, 0, 2.5), (0, 7, 0), (7, 0, 0), "veil"), attributes=sheet(0.0, "veil").attributes)
    return edgegrad.Scene(
        camera((0.2, 0.1, 1.5), size=16),
        {
            "mirror": rectangle((0, 0, -1.0), (3, 0, 0.2), (0, 3, 0.1), "mirror"),
            "veil": veil,
            "wall": rectangle((0, 0, 3.5), (0, 9, 0), (9, 0, 0), "wall"),
        },
        {
            "mirror": Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0),
            "veil": Material(np.zeros(3), textures={"alpha": waves()}),
            "wall": glowing(1.0),
        },
    )


def between() -> edgegrad.Scene:
    """A floor that a bright wall lights through a sheet of waves."""
    scene = bounced()
    del scene.meshes["veil"]
    scene.meshes["shelf"].vertices = scene.meshes["shelf"].vertices + np.array([0.0, 0.6, -0.3])
    scene.meshes["veil"] = sheet(0.5, "veil", 0.9)
    scene.materials["veil"] = Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": waves()})
    scene.lights["lamp"] = edgegrad.PointLight(np.array([0.2, 2.4, -0.7]), 200.0)
    return scene


DRIFT = np.array([0.3, 0.4, -0.2])


def facets() -> edgegrad.Scene:
    """A bent sheet of two flat facets that let light through by its angle."""
    scene = veiled("point", veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": e.LayerWeight("FACING", 0.5)}))
    x, z = np.tile([-1.3, 0.0, 1.3], 2), np.repeat([-1.3, 1.3], 3)
    vertices = np.stack([x, 0.65 + 0.4 * (x == 0.0) + 0.04 * z, z], axis=1)
    faces = np.array([[0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2]], np.int32)
    scene.meshes["veil"] = edgegrad.Mesh(vertices, faces, ("veil",), visible_to=UNSEEN)
    return scene


def copies() -> edgegrad.Scene:
    """The sheet of waves twice, both turned and stretched, one of them mirrored."""
    scene = rippled("rectangle")
    poses = np.stack([pose(turn(0.1, 0.3, 0.05) @ np.diag([0.6, 1.0, 0.7]), -0.4, 0.0, 0.1),
                      pose(turn(-0.1, 0.7, 0.1) @ np.diag([-0.5, 1.0, 0.6]), 0.5, 0.4, -0.2)])  # fmt: skip
    scene.meshes["veil"].instances = poses
    return scene


def lifted() -> edgegrad.Scene:
    """A smooth-shaded ball whose shadow rays start above it, under the sheet of waves."""
    scene = rippled("rectangle")
    vertices, faces = shapes.ball(1, 0.45)
    ball = edgegrad.Mesh(vertices + np.array([0, 0.1, 0]), faces, ("floor",), smoothing=faces, terminator_offset=1.0)
    scene.meshes = {"ball": ball, "veil": scene.meshes["veil"]}
    scene.camera = camera((0, 1.6, 1.6), (0, 0.1, 0), 16, 0.6)
    return scene

"""Boxes that hide from each other the light of other surfaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import edgegrad
from edgegrad.scene.bounces import UNLIMITED, Bounces
from tests.support.scenes.cornell_box import cornell
from tests.support.small_scenes import Make, box, camera, glowing, matte, rectangle, white_world

SIZE = 16


def bounced_light(view: edgegrad.Camera | None = None) -> edgegrad.Scene:
    """A box between a floor and a ceiling; the lamp is near the ceiling and shines on nothing else."""
    return edgegrad.Scene(
        view or camera((0.3, 0.9, 2.6), (0, 0.35, 0), SIZE, 0.9),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 1.2), (1.2, 0, 0), "floor"),
            "ceiling": rectangle((0, 1.6, 0), (1.2, 0, 0), (0, 0, 1.2), "ceiling"),
            "lamp": rectangle((0, 1.3, 0), (0, 0, 0.4), (0.4, 0, 0), "lamp"),
            "box": box((0.1, 0.4, 0.1), (0.3, 0.12, 0.25), "clay", 0.4),
        },
        {
            "floor": matte(0.8, 0.7, 0.6),
            "ceiling": matte(0.9, 0.9, 0.8),
            "lamp": glowing(8.0),
            "clay": matte(0.3, 0.5, 0.7),
        },
    )


def mirrored_edge(roughness: float) -> edgegrad.Scene:
    """A black box over a floor of rough metal that reflects a wall; the lamp lights the wall alone, from nearby."""
    metal = edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=float(np.sqrt(roughness)))
    return edgegrad.Scene(
        camera((0, 1.0, 2.2), (0, 0.1, 0), SIZE, 0.7),
        {
            "floor": rectangle((0, 0, 0.2), (0, 0, 0.8), (0.9, 0, 0), "metal"),
            "wall": rectangle((0, 0.7, -1.2), (1.5, 0, 0), (0, 1.0, 0), "wall"),
            "lamp": rectangle((0, 1.9, -0.9), (0, 0.1, 0), (0.6, 0, 0), "lamp"),
            "box": box((0.1, 0.45, -0.2), (0.25, 0.12, 0.1), "black", 0.3),
        },
        {"metal": metal, "wall": matte(0.8, 0.6, 0.5), "lamp": glowing(30.0), "black": matte(0.0, 0.0, 0.0)},
    )


def behind_rough_glass() -> edgegrad.Scene:
    """The same box before the wall, seen through a sheet that refracts roughly."""
    scene = mirrored_edge(0.3)
    sheet = rectangle((0, 0.6, 0.4), (0.9, 0, 0), (0, 0.8, 0), "glass")
    scene.meshes = {name: scene.meshes[name] for name in ("wall", "lamp", "box")} | {"sheet": sheet}
    scene.materials["glass"] = edgegrad.Material(np.full(3, 0.9), kind="REFRACTION", roughness=0.5, ior=1.2)
    scene.camera = camera((0, 0.8, 2.2), (0, 0.5, 0), SIZE, 0.7)
    return scene


def below() -> edgegrad.Scene:
    """Bounced light on the floor below the box, and little else."""
    return bounced_light(camera((0.2, 0.32, 1.3), (0.1, 0.0, 0.1), SIZE, 0.8))


def mirrored_room() -> edgegrad.Scene:
    """Bounced light as seen in a wall of nearly smooth metal alone: boundaries behind the metal."""
    scene = bounced_light(camera((0.0, 0.9, 2.0), (0, 0.7, -1.0), SIZE, 0.7))
    scene.meshes["mirror"] = rectangle((0, 0.8, -1.3), (1.2, 0, 0), (0, 0.8, 0), "metal")
    scene.materials["metal"] = edgegrad.Material(
        np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=float(np.sqrt(0.05))
    )
    return scene


def veiled() -> edgegrad.Scene:
    """Bounced light past a box that lets a part of it through, and through a sheet that does."""
    scene = bounced_light()
    scene.materials["clay"].alpha = 0.4
    scene.materials["veil"] = edgegrad.Material(np.array([0.5, 0.6, 0.7]), alpha=0.5)
    scene.meshes["veil"] = rectangle((0.0, 0.8, 0.1), (0, 0, 0.7), (0.7, 0, 0), "veil")
    return scene


def windowed() -> edgegrad.Scene:
    """Bounced light past a sheet with one transparent half. The border of the halves is never a silhouette."""
    scene = bounced_light()
    sheet = rectangle((0.1, 0.5, 0.1), (0.0, 0.05, 0.5), (0.5, 0.1, 0.0), "clay")
    sheet.materials = ("clay", "pane")
    sheet.face_material = np.arange(len(sheet.faces), dtype=np.int32) % 2
    scene.materials["pane"] = replace(scene.materials["clay"], alpha=0.1)
    scene.meshes["box"] = sheet
    return scene


def instanced() -> edgegrad.Scene:
    """The box twice, one of them stretched."""
    scene = bounced_light()
    poses = np.stack([np.eye(4), np.eye(4)])
    poses[0, :3, 3] = (-0.3, 0.1, 0.0)
    poses[1, :3, :3] = np.diag([0.5, 1.4, 0.7])
    poses[1, :3, 3] = (0.4, -0.2, 0.2)
    scene.meshes["box"].instances = poses
    return scene


def reflected_shadow(sky: bool = False) -> edgegrad.Scene:
    """A wall that is lit by a floor on which a box casts its shadow: the camera sees the wall alone."""
    scene = edgegrad.Scene(
        camera((0, 0.35, 0.9), (0, 0.5, -1.0), SIZE, 0.4),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 1.0), (1.0, 0, 0), "floor"),
            "wall": rectangle((0, 0.7, -1.0), (1.0, 0, 0), (0, 0.7, 0), "wall"),
            "lamp": rectangle((0.1, 1.6, -0.1), (0.25, 0, 0), (0, 0, 0.25), "lamp"),
            "box": box((0.0, 0.8, -0.1), (0.3, 0.05, 0.3), "black", 0.3),
        },
        {"floor": matte(0.9, 0.7, 0.6), "wall": matte(0.8, 0.8, 0.9), "lamp": glowing(20.0), "black": matte(0, 0, 0)},
    )
    if sky:
        del scene.meshes["lamp"]
        scene.world = white_world()
    return scene


def moving(make: Callable[[], edgegrad.Scene], mesh: str, direction: tuple[float, float, float]) -> Make:
    """A mesh moves."""

    def at(theta: float) -> edgegrad.Scene:
        scene = make()
        scene.meshes[mesh].vertices = scene.meshes[mesh].vertices + theta * np.asarray(direction)
        return scene

    return at


def moving_camera(make: Callable[[], edgegrad.Scene], direction: tuple[float, float, float]) -> Make:
    """The camera moves."""

    def at(theta: float) -> edgegrad.Scene:
        scene = make()
        scene.camera.to_world = scene.camera.to_world.copy()
        scene.camera.to_world[:3, 3] += theta * np.asarray(direction)
        return scene

    return at


@dataclass(frozen=True)
class Case:
    """A scene's motion, the paths that are rendered, and by how much and how often the scene is sampled."""

    make: Make
    path: str = "meshes.box.vertices"
    max_depth: int = 3
    bounces: Bounces = UNLIMITED
    spp: int = 512
    reference_spp: int = 512
    eps: float = 0.02
    seeds: int = 8
    without: str = "indirect"  # the term that is needed
    quick: bool = False


BOX = (1.0, 0.3, 0.5)
CASES: dict[str, Case] = {
    "occluder of bounced light": Case(moving(bounced_light, "box", BOX), quick=True),
    "receiver of bounced light": Case(moving(below, "floor", (0.1, 1.0, 0.0)), "meshes.floor.vertices"),
    "source of bounced light": Case(moving(bounced_light, "ceiling", (0.5, 1.0, 0.3)), "meshes.ceiling.vertices"),
    "camera and bounced light": Case(moving_camera(below, (0.5, 0.4, -1.0)), "camera.to_world"),
    "two bounces": Case(moving(bounced_light, "box", BOX), max_depth=4, quick=True),
    "three bounces": Case(moving(bounced_light, "box", BOX), max_depth=6),
    "one bounce by limit": Case(moving(bounced_light, "box", BOX), max_depth=5, bounces=Bounces(diffuse=1)),
    "shadow seen by way of a wall": Case(
        moving(reflected_shadow, "box", (1.0, 0.3, 0.8)), without="shadow", quick=True
    ),
    "sky's shadow seen by way of a wall": Case(
        moving(lambda: reflected_shadow(sky=True), "box", (1.0, 0.3, 0.8)), without="shadow"
    ),
    "shadow seen by way of a wall that moves": Case(
        moving(reflected_shadow, "wall", (0.0, 0.0, 1.0)), "meshes.wall.vertices", without="shadow"
    ),
    "shadow and bounces": Case(moving(reflected_shadow, "box", (1.0, 0.3, 0.8)), max_depth=5, without="shadow"),
    "shadow and one bounce by limit": Case(
        moving(reflected_shadow, "box", (1.0, 0.3, 0.8)), max_depth=5, bounces=Bounces(diffuse=1), without="shadow"
    ),
    "transparent occluder": Case(moving(veiled, "box", BOX), quick=True),
    "windows": Case(moving(windowed, "box", (1.0, 0.3, -1.0)), quick=True),
    "instances": Case(moving(instanced, "box", BOX)),
    "edge in rougher metal": Case(moving(lambda: mirrored_edge(0.3), "box", (1.0, 0.5, 0.3))),
    "edge in rough metal": Case(moving(lambda: mirrored_edge(0.1), "box", (1.0, 0.5, 0.3)), quick=True),
    "edge in nearly smooth metal": Case(moving(lambda: mirrored_edge(0.03), "box", (1.0, 0.5, 0.3))),
    "metal that moves": Case(moving(lambda: mirrored_edge(0.1), "floor", (0.3, 1.0, 0.2)), "meshes.floor.vertices"),
    "camera and metal": Case(moving_camera(lambda: mirrored_edge(0.2), (0.5, 0.4, -1.0)), "camera.to_world"),
    "bounces in nearly smooth metal": Case(
        moving(mirrored_room, "box", BOX), max_depth=4, spp=1024, reference_spp=2048, eps=0.03
    ),
    "Cornell box": Case(cornell, "meshes.tall.vertices", max_depth=6),
    "edge behind rough glass": Case(moving(behind_rough_glass, "box", (1.0, 0.5, 0.3)), quick=True),
}

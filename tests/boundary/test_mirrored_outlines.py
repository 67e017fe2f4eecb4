"""Outlines of lights seen in mirrors and through smooth glass, against central differences, whatever moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import AreaLight, Material, PointLight, Scene, SunLight
from edgegrad.scene.light import Light
from tests.support.block_statistics import check_noticed
from tests.support.picture_differences import agreement, check_agreement, check_equal_bits, check_transpose
from tests.support.rich_scene import pose, turn
from tests.support.scenes.box_under_lights import DOWN
from tests.support.shapes import ball
from tests.support.small_scenes import Make, along, camera, glowing, moved, need, rectangle, white_world

MIRROR = Material(kind="GLOSSY", base_color=np.array([0.9, 0.8, 0.6]), roughness=0.0)
GLASS = Material(kind="GLASS", base_color=np.full(3, 0.95), roughness=0.0, ior=1.3)
AIM = turn(0.2, 0.0, 0.1) @ DOWN
LIGHTS: dict[str, Callable[[float], Light]] = {
    "rectangle": lambda t: AreaLight(pose(AIM, 0.1 + 0.3 * t, 1.8, t - 1), np.array([0.8 + t, 0.6]), "RECTANGLE", 8.0),
    "ellipse": lambda t: AreaLight(pose(turn(t, 0.0, t) @ AIM, 0.1, 1.8, -1.0), np.array([0.9, 0.6]), "ELLIPSE", 8.0),
    "disk": lambda t: PointLight(np.array([0.1 + t, 1.4, -0.9]), 20.0, 0.4 + 0.3 * t, False),
    "sphere": lambda t: PointLight(np.array([0.1 + t, 1.4, -0.9]), 20.0, 0.4 + 0.3 * t, True),
    "sun": lambda t: SunLight(np.array([-0.1 + t, -1.0, 0.75]), 0.5, 0.5 + 0.2 * t),
}
FIELDS = {"rectangle": ["to_world", "size"], "ellipse": ["to_world"], "disk": ["position", "radius"],
          "sphere": ["position", "radius"], "sun": ["direction", "angle"]}  # fmt: skip


def over_mirror(light: Light, mirror: Material = MIRROR) -> Scene:
    """A mirror that shows a light and a box, part of which is before the light."""
    scene = Scene(camera((0.0, 1.4, 1.6), (0.0, 0.0, 0.0), 16, 0.5),
                  {"floor": rectangle((0, 0, 0), (0.8, 0, 0), (0, 0.1, -0.8), "floor"),
                   "card": rectangle((0.3, 0.7, -0.45), (0.2, 0, 0), (0.0, 0.05, 0.2), "card")},
                  {"floor": mirror, "card": glowing(0.4)})  # fmt: skip
    scene.lights = {"lamp": light}
    scene.world = white_world(0.1)
    return scene


def behind_glass(light: Light) -> Scene:
    """A ball of glass before a light."""
    vertices, faces = ball(3, 0.5)
    made = edgegrad.Mesh(vertices, faces, ("glass",), smoothing=faces)
    scene = Scene(camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), 16, 0.5), {"ball": made}, {"glass": GLASS})
    scene.lights = {"lamp": light}
    scene.world = white_world(0.1)
    return scene


# Its lobe is followed (shading/bsdf/followed_lobes.h).
NARROW = replace(MIRROR, roughness=0.09)
COATED = Material(kind="PRINCIPLED", base_color=np.array([0.6, 0.3, 0.2]), roughness=0.6, coat_weight=1.0,
                  coat_roughness=0.06)  # fmt: skip


def wall_lamp(t: float) -> AreaLight:
    return AreaLight(pose(turn(np.pi, 0.0, 0.0), 0.05 + t, 0.1, -1.5), np.array([0.5, 0.4]), "RECTANGLE", 8.0)


def lamp_moves(kind: str, mirror: Material = MIRROR) -> tuple[Make, list[str]]:
    return lambda t: over_mirror(LIGHTS[kind](t), mirror), [f"lights.lamp.{field}" for field in FIELDS[kind]]


def mirror_moves(kind: str, mirror: Material = MIRROR) -> tuple[Make, list[str]]:
    def make(t: float) -> Scene:
        return moved(over_mirror(LIGHTS[kind](0.0), mirror), t, "floor", (0.3, 0.4, 0.2))

    return make, ["meshes.floor.vertices"]


def camera_moves(t: float) -> Scene:
    scene = over_mirror(LIGHTS["rectangle"](0.0))
    return replace(scene, camera=camera((0.4 * t, 1.4 + 0.3 * t, 1.6), (0.0, 0.0, 0.0), 16, 0.5))


def glass_moves(t: float) -> Scene:
    return moved(behind_glass(wall_lamp(0.0)), t, "ball", (0.5, 0.3, 0.0))


CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{kind} moves": lamp_moves(kind) for kind in LIGHTS},
    **{f"mirror moves: {kind}": mirror_moves(kind) for kind in LIGHTS},
    **{f"{kind} moves, narrow lobe": lamp_moves(kind, NARROW) for kind in LIGHTS},
    **{f"narrow lobe moves: {kind}": mirror_moves(kind, NARROW) for kind in LIGHTS},
    "coat moves": mirror_moves("ellipse", COATED),
    "lamp moves over a coat": lamp_moves("rectangle", COATED),
    "camera moves": (camera_moves, ["camera.to_world"]),
    "glass moves": (glass_moves, ["meshes.ball.vertices"]),
    "lamp moves behind glass": (lambda t: behind_glass(wall_lamp(t)), ["lights.lamp.to_world"]),
}
OPTIONS = {"max_depth": 4}


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_differences(case: str) -> None:
    need("native")
    check_agreement(along(*CASES[case]), **OPTIONS)


@pytest.mark.parametrize("case", ["rectangle moves", "mirror moves: sun", "glass moves"])
def test_differences_notice_a_missing_outline(case: str) -> None:
    need("native")
    check_noticed(agreement(along(*CASES[case]), max_depth=4, terms=("interior",)))


@pytest.mark.parametrize("case", CASES)
def test_modes_are_transposes(case: str) -> None:
    need("native")
    make, paths = CASES[case]
    check_transpose(make, paths, spp=16, seed=3, **OPTIONS)


def test_same_bits_for_any_number_of_threads() -> None:
    need("native")
    make, paths = CASES["mirror moves: sphere"]
    check_equal_bits(make, paths, spp=8, max_depth=4)

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


# Lobes too wide for their rays to find small lights (engine/decisions/followed_lobes_rule.h).
WIDER = replace(MIRROR, roughness=0.14)
SMALL: dict[str, Callable[[float], Light]] = {
    "rectangle": lambda t: AreaLight(pose(AIM, 0.1 + t, 1.8, t - 1), np.array([0.15 + t, 0.12]), "RECTANGLE", 2.0),
    "disk": lambda t: PointLight(np.array([0.1 + t, 1.4, -0.9]), 4.0, 0.08 + 0.1 * t, False),
    "sphere": lambda t: PointLight(np.array([0.1 + t, 1.4, -0.9]), 4.0, 0.08 + 0.1 * t, True),
    "sun": lambda t: SunLight(np.array([-0.1 + t, -1.0, 0.75]), 0.5, 0.1 + 0.1 * t),
}


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


def small_moves(kind: str) -> tuple[Make, list[str]]:
    return lambda t: over_mirror(SMALL[kind](t), WIDER), [f"lights.lamp.{field}" for field in FIELDS[kind]]


def over_small(kind: str, t: float, mirror: Material = WIDER, move: str = "floor") -> Scene:
    return moved(over_mirror(SMALL[kind](0.0), mirror), t, move, (0.3, 0.4, 0.2))


def beside_large(t: float) -> Scene:
    """A small light and a large one, which rays of the same lobe find, behind one card."""
    scene = over_small("sphere", t, move="card")
    scene.lights["large"] = LIGHTS["rectangle"](0.0)
    return scene


def between_lobes(t: float) -> Scene:
    """A small light and a card, which a second lobe shows to the first one, and a smooth mirror shows both."""
    scene = over_mirror(SMALL["sphere"](0.0), WIDER)
    scene.meshes["wall"] = rectangle((0, 0.6, -0.9), (0.9, 0, 0), (0, 0.6, 0.1), "wall")
    scene.meshes["mirror"] = rectangle((-0.9, 0.4, -0.2), (0, 0.3, 0), (0, 0, 0.6), "mirror")
    scene.materials["wall"] = replace(WIDER, roughness=0.1)
    scene.materials["mirror"] = MIRROR
    return moved(scene, t, "floor", (0.3, 0.4, 0.2))


def rough_glass(t: float) -> Scene:
    scene = behind_glass(wall_lamp(0.0))
    scene.materials["glass"] = replace(GLASS, roughness=0.14)
    return moved(scene, t, "ball", (0.5, 0.3, 0.0))


FLOOR = ["meshes.floor.vertices"]
CASES |= {
    **{f"small {kind} moves": small_moves(kind) for kind in SMALL},
    **{f"lobe moves: small {kind}": ((lambda t, kind=kind: over_small(kind, t)), FLOOR) for kind in SMALL},
    "coat moves: small sun": (lambda t: over_small("sun", t, replace(COATED, coat_roughness=0.14)), FLOOR),
    "card moves before a small disk": (lambda t: over_small("disk", t, move="card"), ["meshes.card.vertices"]),
    "card moves before lights of two sizes": (beside_large, ["meshes.card.vertices"]),
    "lobe before a lobe moves": (between_lobes, FLOOR),
    "rough glass moves": (rough_glass, ["meshes.ball.vertices"]),
}
OPTIONS = {"max_depth": 4}


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_differences(case: str) -> None:
    need("native")
    check_agreement(along(*CASES[case]), **OPTIONS)


@pytest.mark.slow
def test_rounding_loses_no_outline() -> None:
    """Two neighbouring chains may be so near to an outline that rounding puts both on one side of it."""
    need("native")
    check_agreement(along(*CASES["rectangle moves"]), seeds=64, reference_spp=1024, reference_seeds=64, **OPTIONS)


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

"""Outlines of lights in light that mirrors and smooth glass throw on other surfaces, against central differences."""

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
from tests.support.shapes import ball, sheet
from tests.support.small_scenes import Make, along, camera, matte, mesh_drifts, need, rectangle

MIRROR = Material(kind="GLOSSY", base_color=np.array([0.9, 0.8, 0.6]), roughness=0.0)
GLASS = Material(kind="GLASS", base_color=np.full(3, 0.95), roughness=0.0, ior=1.3)
CLAY, GLOSS = matte(0.6, 0.5, 0.4), Material(kind="GLOSSY", base_color=np.array([0.6, 0.5, 0.4]), roughness=0.5)
AIM = turn(0.2, 0.0, 0.1) @ DOWN
LIGHTS: dict[str, Callable[[float], Light]] = {
    "rectangle": lambda t: AreaLight(pose(AIM, 1.0 + t, 1.8, 0.3 + t / 2), np.array([0.8 + t, 0.6]), "RECTANGLE", 30.0),
    "ellipse": lambda t: AreaLight(pose(turn(t, 0.0, t) @ AIM, 1.0, 1.8, 0.3), np.array([0.9, 0.6]), "ELLIPSE", 30.0),
    "disk": lambda t: PointLight(np.array([1.0 + t, 1.8, 0.3]), 60.0, 0.4 + 0.3 * t, False),
    "sphere": lambda t: PointLight(np.array([1.0 + t, 1.8, 0.3]), 60.0, 0.4 + 0.3 * t, True),
    "sun": lambda t: SunLight(np.array([-0.6 + t, -1.0, -0.2]), 2.0, 0.3 + 0.2 * t),
}
FIELDS = {"rectangle": ["to_world", "size"], "ellipse": ["to_world"], "disk": ["position", "radius"],
          "sphere": ["position", "radius"], "sun": ["direction", "angle"]}  # fmt: skip


def beside_mirror(light: Light, floor: Material = CLAY) -> Scene:
    """A floor with a standing mirror beside it."""
    scene = Scene(camera((0.0, 2.5, 1.5), (0.0, 0.0, 0.0), 16, 0.5),
                  {"floor": rectangle((0, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"),
                   "mirror": rectangle((-0.9, 0.6, 0), (0, 0, -0.6), (0.1, 0.5, 0), "mirror")},
                  {"floor": floor, "mirror": MIRROR})  # fmt: skip
    scene.lights = {"lamp": light}
    return scene


def under_ball(light: Light, floor: Material = CLAY) -> Scene:
    """A smooth mirror ball above a floor, most of it beside the picture."""
    vertices, faces = ball(3, 0.4)
    made = edgegrad.Mesh(vertices + np.array([-0.5, 0.45, 0.0]), faces, ("body",), smoothing=faces)
    scene = Scene(camera((0.3, 2.5, 1.5), (0.3, 0.0, 0.0), 16, 0.5),
                  {"floor": rectangle((0, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"), "ball": made},
                  {"floor": floor, "body": MIRROR})  # fmt: skip
    scene.lights = {"lamp": light}
    return scene


HIGH_LIGHTS: dict[str, Callable[[float], Light]] = {
    "rectangle": lambda t: AreaLight(pose(AIM, 0.9 + t, 2.6, 0.2 + t / 2), np.array([0.8, 0.6]), "RECTANGLE", 60.0),
    "sphere": lambda t: PointLight(np.array([0.9 + t, 2.6, 0.2]), 60.0, 0.3, True),
    "sun": lambda t: SunLight(np.array([-0.2 + t, -1.0, -0.05]), 2.0, 0.3 + 0.2 * t),
}


def under_glass(light: Light, ior: float = 1.3) -> Scene:
    """A smooth ball of glass above the picture, which shows its light on a floor."""
    vertices, faces = ball(3, 0.3)
    made = edgegrad.Mesh(vertices + np.array([0.54, 1.2, 0.0]), faces, ("body",), smoothing=faces)
    scene = Scene(camera((0.3, 0.6, 2.2), (0.3, 0.0, -0.1), 16, 0.4),
                  {"floor": rectangle((0, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"), "ball": made},
                  {"floor": CLAY, "body": replace(GLASS, ior=ior)})  # fmt: skip
    scene.lights = {"lamp": light}
    return scene


def under_relief(light: Light, height: float = 0.05) -> Scene:
    """A floor under a sheet of glass whose lower side has a relief."""
    vertices, faces = sheet(12, 2.4)
    flat = np.stack([vertices[:, 0], np.zeros(len(vertices)), -vertices[:, 1]], axis=1)
    waves = height * np.sin(5.0 * flat[:, 0]) * np.cos(4.0 * flat[:, 2] + 0.5)
    top, under = flat + np.array([0, 1.0, 0]), flat + np.stack([0 * waves, 0.85 + waves, 0 * waves], axis=1)
    made = edgegrad.Mesh(np.concatenate([top, under]), np.concatenate([faces, faces[:, ::-1] + len(top)]), ("body",))
    scene = Scene(camera((0.0, 0.5, 1.5), (0.0, 0.0, -0.1), 16, 0.6),
                  {"floor": rectangle((0, 0, 0), (0, 0, 1.2), (1.2, 0, 0), "floor"), "sheet": made},
                  {"floor": CLAY, "body": GLASS})  # fmt: skip
    scene.lights = {"lamp": light}
    return scene


def side_lamp(t: float) -> Light:
    """A lamp that shines on a mirror alone."""
    place = pose(turn(0.0, np.pi / 2, 0.0), 0.2 + t / 2, 0.8 + t, 0.1)
    return AreaLight(place, np.array([0.5 + t, 0.4]), "RECTANGLE", 30.0)


def with_wall(floor: Material = CLAY, t: float = 0.0) -> Scene:
    """A floor and a wall which a mirror lights, and no lamp by itself."""
    scene = Scene(camera((1.0, 2.5, 0.6), (1.0, 0.0, 0.0), 16, 0.5),
                  {"floor": rectangle((1, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"),
                   "mirror": rectangle((-0.9, 0.9, 0), (0, 0, -0.6), (0.1, 0.6, 0), "mirror"),
                   "wall": rectangle((1.9, 0.75, 0), (0, 0, 1.5), (0, 0.75, 0), "wall")},
                  {"floor": floor, "mirror": MIRROR, "wall": matte(0.9, 0.9, 0.9)})  # fmt: skip
    scene.lights = {"lamp": side_lamp(t)}
    return scene


def light_moves(make: Callable[[Light], Scene], kind: str) -> tuple[Make, list[str]]:
    return lambda t: make(LIGHTS[kind](t)), [f"lights.lamp.{field}" for field in FIELDS[kind]]


def mesh_grows(make: Callable[[], Scene], mesh: str) -> tuple[Make, list[str]]:
    def at(t: float) -> Scene:
        scene = make()
        body = scene.meshes[mesh]
        middle = body.vertices.mean(axis=0)
        body.vertices = middle + (1.0 + t) * (body.vertices - middle)
        return scene

    return at, [f"meshes.{mesh}.vertices"]


def camera_moves(t: float) -> Scene:
    view = camera((0.4 * t, 2.5 + 0.3 * t, 1.5), (0.0, 0.0, 0.0), 16, 0.5)
    return replace(beside_mirror(LIGHTS["rectangle"](0.0)), camera=view)


def lamp_on_gloss(light: Light) -> Scene:
    return under_ball(light, GLOSS)


SUN, HIGH_SUN, RECTANGLE = LIGHTS["sun"](0.0), HIGH_LIGHTS["sun"](0.0), LIGHTS["rectangle"](0.0)
SUN_FIELDS = [f"lights.lamp.{field}" for field in FIELDS["sun"]]
# Each with the depth of its paths.
CASES: dict[str, tuple[tuple[Make, list[str]], int]] = {
    **{f"{kind} moves, flat mirror": (light_moves(beside_mirror, kind), 3) for kind in LIGHTS},
    **{f"{kind} moves, ball": (light_moves(under_ball, kind), 3) for kind in LIGHTS},
    "ball grows: rectangle": (mesh_grows(lambda: under_ball(RECTANGLE), "ball"), 3),
    "ball moves: sphere": (mesh_drifts(lambda: under_ball(LIGHTS["sphere"](0.0)), "ball"), 3),
    "ball moves: sun": (mesh_drifts(lambda: under_ball(SUN), "ball"), 3),
    "floor moves": (mesh_drifts(lambda: under_ball(RECTANGLE), "floor"), 3),
    "camera moves": ((camera_moves, ["camera.to_world"]), 3),
    "gloss: rectangle moves": (light_moves(lamp_on_gloss, "rectangle"), 3),
    "gloss: ball grows": (mesh_grows(lambda: lamp_on_gloss(RECTANGLE), "ball"), 3),
    "glass: rectangle moves": ((lambda t: under_glass(HIGH_LIGHTS["rectangle"](t)), ["lights.lamp.to_world"]), 4),
    "glass: sphere moves": ((lambda t: under_glass(HIGH_LIGHTS["sphere"](t)), ["lights.lamp.position"]), 4),
    "glass: sun moves": ((lambda t: under_glass(HIGH_LIGHTS["sun"](t)), SUN_FIELDS), 4),
    "glass moves: rectangle": (mesh_drifts(lambda: under_glass(HIGH_LIGHTS["rectangle"](0.0)), "ball"), 4),
    "index of glass": ((lambda t: under_glass(HIGH_SUN, 1.3 + t), ["materials.body.ior"]), 4),
    "relief: sun moves": (light_moves(under_relief, "sun"), 4),
    "relief rises": ((lambda t: under_relief(SUN, 0.05 + t / 4), ["meshes.sheet.vertices"]), 4),
    "two surfaces: mirror moves": (mesh_drifts(with_wall, "mirror"), 4),
}


# Of small derivatives: with four times the samples.
SMALL = ("ball grows: rectangle", "gloss: ball grows", "two surfaces: mirror moves")


@pytest.mark.parametrize("case", [pytest.param(c, marks=pytest.mark.slow) if c in SMALL else c for c in CASES])
def test_agrees_with_differences(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    spp = 512 if case in SMALL else 128
    check_agreement(along(make, paths), eps=0.1, seeds=16, spp=spp, reference_spp=8 * spp, max_depth=depth)


@pytest.mark.parametrize("case", ["sun moves, flat mirror", "disk moves, ball", "glass: sun moves",
                                  "two surfaces: mirror moves"])  # fmt: skip
def test_differences_notice_a_missing_outline(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    terms = ("interior", "primary", "shadow")
    check_noticed(agreement(along(make, paths), eps=0.1, seeds=16, spp=128, reference_spp=1024, max_depth=depth,
                            terms=terms))  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_modes_are_transposes(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    check_transpose(make, paths, spp=16, seed=3, max_depth=depth, terms=("indirect",))


def test_same_bits_for_any_number_of_threads() -> None:
    need("native")
    (make, paths), depth = CASES["glass moves: rectangle"]
    check_equal_bits(make, paths, spp=8, max_depth=depth)

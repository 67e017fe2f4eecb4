"""Derivatives of light that media scatter: beside differences, between both modes, and what the plan names."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.picture_differences import check_equal_bits, check_transpose, sums_of_differences
from tests.support.small_scenes import box, camera, glowing, rectangle

THIN = 1e-3  # 1/m: such a medium keeps nearly all light, so that its transmittance hardly changes


def foggy_room(scattering: float = 0.3, gloss: bool = False) -> edgegrad.Scene:
    """A floor and a wall in fog, under a lamp, a glowing block and a sky."""
    fog = edgegrad.Material(np.ones(3), kind="TRANSPARENT",
                            medium=edgegrad.Medium((scattering,) * 3, (0.5 * scattering,) * 3, 0.3))  # fmt: skip
    floor = (edgegrad.Material(np.array([0.7, 0.5, 0.3]), kind="GLOSSY", roughness=0.5) if gloss
             else edgegrad.Material(np.array([0.7, 0.5, 0.3]), kind="DIFFUSE"))  # fmt: skip
    return edgegrad.Scene(
        camera((0, 1.2, 3.5), size=8, fov=0.8),
        {"fog": box((0, 0.5, 0), (1.5, 1.0, 1.5), "fog"),
         "floor": rectangle((0, 0, 0), (1.2, 0, 0), (0, 0, -1.2), "floor"),
         "block": box((0.5, 0.4, -0.3), (0.1, 0.1, 0.1), "glow")},
        {"fog": fog, "floor": floor, "glow": glowing(4.0)},
        {"lamp": edgegrad.PointLight(np.array([-0.4, 0.9, 0.2]), 20.0, radius=0.05)},
        edgegrad.World(np.array([0.3, 0.2, 0.4])),
    )  # fmt: skip


@pytest.mark.parametrize(("path", "direction", "gloss"), [
    ("materials.floor.base_color", np.array([0.3, 1.0, 0.5]), False),
    ("materials.floor.base_color", np.array([0.3, 1.0, 0.5]), True),
    ("materials.glow.emission", np.array([2.0, 1.0, 0.5]), False),
    ("lights.lamp.power", 10.0, False),
    ("world.color", np.array([0.3, 0.1, 0.2]), False),
])  # fmt: skip
def test_colors_and_strengths(path: str, direction: Any, gloss: bool) -> None:
    found, exact = sums_of_differences(foggy_room(gloss=gloss), path, direction, 0.02, max_depth=6, spp=512)
    check(mean_p_value(found - exact, 0.0, rounding=2e-3 * abs(found.mean())))
    assert half_width(found - exact) < 0.5 * abs(exact.mean())


@pytest.mark.parametrize("name", ["lights.lamp.position", "materials.glow.emission"])
def test_lamps_move_over_what_thin_fog_scatters(name: str) -> None:
    """No surface but the fog: the camera sees the light that it scatters, and no shadows."""
    scene = foggy_room(THIN)
    del scene.meshes["floor"]
    if name == "lights.lamp.position":
        del scene.meshes["block"]
        scene.lights["lamp"].position = np.array([0.2, 1.9, 0.3])  # outside: its light has no peak in the fog
        scene.world = edgegrad.World(np.zeros(3))
        direction: Any = np.array([0.7, 0.3, 1.0])
    else:
        direction = np.ones(3)
    found, exact = sums_of_differences(scene, name, direction, 0.02, max_depth=2, spp=1024)
    check(mean_p_value(found - exact, 0.0, rounding=5e-3 * abs(found.mean())))
    assert half_width(found - exact) < 0.5 * abs(exact.mean())


PATHS = ("materials.floor.base_color", "materials.glow.emission", "lights.lamp.power", "lights.lamp.position",
         "meshes.floor.vertices", "camera.to_world", "world.color")  # fmt: skip


@pytest.mark.parametrize("path", PATHS)
def test_modes_are_transposed(path: str) -> None:
    check_transpose(lambda _: foggy_room(), [path], spp=8, max_depth=5)


def test_equal_bits_for_any_number_of_threads() -> None:
    check_equal_bits(lambda _: foggy_room(), list(PATHS), spp=4, max_depth=4)


def test_the_plan_names_what_motions_lack() -> None:
    scene = foggy_room()
    by_colors = edgegrad.plan(scene, ["materials.floor.base_color", "lights.lamp.power"])
    assert "media scatter or absorb light" in str(by_colors) and "in media" not in str(by_colors)
    for path in ("meshes.floor.vertices", "lights.lamp.position", "camera.to_world"):
        assert "in media (fog)" in str(edgegrad.plan(scene, [path])), path
    scene.world.medium = scene.materials["fog"].medium
    scene.materials["fog"].medium = None
    assert "in media (the world's)" in str(edgegrad.plan(scene, ["meshes.floor.vertices"]))

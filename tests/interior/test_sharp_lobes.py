"""Sharp lobes under sized lights: emitter samples along the lobes, and pairs of samples that mirror each other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from edgegrad import AreaLight, Material, PointLight, Renderer, Scene, SunLight
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.rich_scene import pose, turn
from tests.support.scenes.box_under_lights import DOWN
from tests.support.small_scenes import Make, along, camera, matte, moved, rectangle, white_world

FLOOR = ["meshes.floor.vertices"]


def lit(sheet: Material, *, seen: bool = True) -> Scene:
    """A floor and a sheet over it, one of them seen, beneath two lamps, one before the other."""
    scene = Scene(camera((0.0, 1.4, 1.6), (0.0, 0.0, 0.0), 16, 0.5),
                  {"floor": rectangle((0, 0, 0), (0.8, 0, 0), (0, 0.1, -0.8), "floor")},
                  {"floor": sheet if seen else matte(0.7, 0.6, 0.5)})  # fmt: skip
    if not seen:
        scene.meshes["sheet"] = rectangle((0.0, 0.7, -0.9), (0.8, 0, 0), (0.0, 0.5, 0.2), "sheet")
        scene.materials["sheet"] = sheet
    scene.lights = {
        "lamp": AreaLight(pose(turn(0.2, 0.0, 0.1) @ DOWN, 0.1, 1.8, -1.0), np.array([0.8, 0.6]), "RECTANGLE", 30.0),
        "other": AreaLight(pose(turn(0.2, 0.0, 0.1) @ DOWN, 0.3, 2.2, -1.2), np.array([0.5, 0.5]), "ELLIPSE", 20.0),
        "ball": PointLight(np.array([-0.7, 1.2, -0.6]), 40.0, 0.15, True),
        "sun": SunLight(np.array([0.2, -1.0, 0.4]), 0.5, 0.2),
        "point": PointLight(np.array([0.6, 1.0, 0.8]), 10.0),
    }
    scene.world = white_world(0.2)
    return scene


def moves(make: Callable[[], Scene], *rate: float) -> Make:
    return lambda theta: moved(make(), theta, "floor", rate)


METAL = Material(kind="GLOSSY", base_color=np.array([0.9, 0.8, 0.6]), roughness=0.3)
PLASTIC = Material(kind="PRINCIPLED", base_color=np.array([0.6, 0.3, 0.2]), roughness=0.35)
COATED = Material(kind="PRINCIPLED", base_color=np.array([0.6, 0.3, 0.2]), roughness=0.6, coat_weight=1.0,
                  coat_roughness=0.25)  # fmt: skip
FROSTED = Material(kind="GLASS", base_color=np.full(3, 0.9), roughness=0.4)
CASES: dict[str, tuple[Make, dict[str, Any]]] = {
    "metal": (moves(lambda: lit(METAL), 0.3, 0.4, 0.2), {"max_depth": 2}),
    "plastic": (moves(lambda: lit(PLASTIC), 0.3, 0.4, 0.2), {"max_depth": 2}),
    "coated": (moves(lambda: lit(COATED), 0.3, 0.4, 0.2), {"max_depth": 2}),
    "glass": (moves(lambda: lit(FROSTED), 0.3, 0.4, 0.2), {"max_depth": 3}),
    "metal beside the floor": (moves(lambda: lit(METAL, seen=False), 0.3, 0.4, 0.2), {"max_depth": 3}),
}


@pytest.mark.parametrize("name", CASES)
def test_motion_agrees_with_central_differences(name: str) -> None:
    need_every_table()
    make, options = CASES[name]
    check_agreement(along(make, FLOOR), **options)


@pytest.mark.parametrize("name", CASES)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    make, options = CASES[name]
    check_transpose(make, FLOOR, spp=8, **options)


def test_bits_are_equal() -> None:
    need_every_table()
    check_equal_bits(CASES["metal beside the floor"][0], FLOOR, spp=5, max_depth=4)


@pytest.mark.parametrize(("seen", "limit"), [(True, 1.5), (False, 0.5)])
def test_narrow_lobes_bring_little_noise(seen: bool, limit: float) -> None:
    """Of a lamp in metal, which points of the lamp that are chosen without regard to the lobe mostly miss, and of an
    even sky in metal that lights a floor, where samples on both sides of a lobe's middle cancel. Without either the
    noise is more than the derivative."""
    need_every_table()
    metal = Material(kind="GLOSSY", base_color=np.full(3, 0.9), roughness=0.25 if seen else 0.1)

    def make() -> Scene:
        scene = lit(metal, seen=seen)
        scene.lights = {"lamp": scene.lights["lamp"]}
        return scene

    scene, rate = along(moves(make, 0.3, 0.4, 0.2), FLOOR)(0.0)
    renderer = Renderer(scene)
    pictures = np.array([renderer.render_forward(rate, spp=32, seed=k, max_depth=2 if seen else 3, terms=["interior"])
                         for k in range(48)], np.float64)  # fmt: skip
    sums = pictures.reshape(48, 4, 4, 4, 4, 3).sum(axis=(2, 4))
    variance = sums.var(axis=0, ddof=1).mean()
    square = (sums.mean(axis=0) ** 2).mean() - variance / 48
    assert variance < limit**2 * max(square, 0.0)

"""Light that reaches surfaces through transparent ones that move, against central differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.rich_scene import turn
from tests.support.scenes.transparent_sheets import (
    DRIFT,
    between,
    changed,
    copies,
    dozen,
    facets,
    in_a_mirror,
    in_metal,
    lifted,
    masked,
    moved,
    rippled,
)
from tests.support.small_scenes import Make, along


def light_turns() -> tuple[Make, list[str]]:
    scene = rippled("rectangle")
    to_world = np.array(scene.lights["lamp"].to_world)

    def make(theta: float) -> edgegrad.Scene:
        scene = rippled("rectangle")
        turned = to_world.copy()
        turned[:3, :3] = turn(0.5 * theta, 0.3 * theta, -0.4 * theta) @ to_world[:3, :3]
        turned[:3, 3] += theta * np.array([0.5, 0.2, -0.3])
        scene.lights["lamp"] = replace(scene.lights["lamp"], to_world=turned)
        return scene

    return make, ["lights.lamp.to_world"]


def camera_moves() -> tuple[Make, list[str]]:
    def make(theta: float) -> edgegrad.Scene:
        scene = rippled("point")
        to_world = np.array(scene.camera.to_world)
        to_world[:3, 3] += theta * np.array([0.4, 0.3, -0.2])
        scene.camera = replace(scene.camera, to_world=to_world)
        return scene

    return make, ["camera.to_world"]


SCATTERED: dict[str, tuple[Make, list[str]]] = {
    "seen in metal": moved(in_metal, "veil", DRIFT),
    "metal moves": moved(in_metal, "floor", DRIFT),
    "seen in a mirror": moved(in_a_mirror, "mirror", DRIFT),
    "between surfaces": moved(between, "veil", DRIFT),
}


@pytest.mark.parametrize("name", SCATTERED)
def test_paths_change_with_where_they_pass(name: str) -> None:
    """Rays that surfaces scatter go through sheets by chance."""
    need_every_table()
    depth = 3 if name.startswith("between") else 2
    check_agreement(along(*SCATTERED[name]), eps=0.04, spp=128, max_depth=depth)


@pytest.mark.parametrize("make", [in_metal, in_a_mirror, between])
def test_modes_are_transposes_along_paths(make: Callable[[], edgegrad.Scene]) -> None:
    need_every_table()
    paths = [f"meshes.{name}.vertices" for name in make().meshes]
    check_transpose(lambda _: make(), [*paths, "camera.to_world"], spp=16, max_depth=4)


SHIFT = np.zeros((2, 4, 4))
SHIFT[:, :3] = np.random.default_rng(2).normal(size=(2, 3, 4)) * 0.3
MOTIONS: dict[str, tuple[Make, list[str]]] = {
    **{f"sheet moves under {light}": moved(lambda light=light: rippled(light), "veil", DRIFT)
       for light in ("point", "rectangle", "sun", "mesh", "sky", "sky image")},
    "floor moves": moved(lambda: rippled("rectangle"), "floor", np.array([0.2, 0.5, 0.3])),
    "light moves": changed(lambda: rippled("point"), "lights.lamp.position", np.array([0.8, -0.3, 0.6])),
    "sun turns": changed(lambda: rippled("hard sun"), "lights.lamp.direction", np.array([0.2, 0.0, -0.3])),
    "sheet moves over a ball": moved(lifted, "veil", DRIFT),
    "facets move": moved(facets, "veil", DRIFT),
    "copies move": moved(copies, "veil", DRIFT),
    "copies are placed anew": changed(copies, "meshes.veil.instances", SHIFT),
    "rectangle turns": light_turns(),
    "camera moves": camera_moves(),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_shadows_change_with_where_they_are_cast(name: str) -> None:
    need_every_table()
    check_agreement(along(*MOTIONS[name]), seeds=8, reference_spp=256, max_depth=2)


@pytest.mark.parametrize("make", [lambda _: rippled("sky image"), lambda _: masked("mesh"), lambda _: dozen()])
def test_modes_are_transposes_by_place(make: Make) -> None:
    need_every_table()
    paths = ["meshes.veil.vertices", "meshes.floor.vertices", "materials.floor.base_color", "camera.to_world"]
    check_transpose(make, paths, spp=16, max_depth=3)

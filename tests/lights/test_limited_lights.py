"""Lights with a limit of bounces, lights that take light away, and paths that end in ambient light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.scene.light import Light
from tests.support.block_statistics import check, compare
from tests.support.light_directions import facing
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import box, camera, matte, rectangle

AT = np.array([0.6, -0.8, 1.7])
LIGHTS: dict[str, Callable[[], Light]] = {
    "point": lambda: edgegrad.PointLight(AT, 60.0),
    "disk": lambda: edgegrad.PointLight(AT, 60.0, 0.3),
    "sphere": lambda: edgegrad.PointLight(AT, 60.0, 0.3, True),
    "sun's disk": lambda: edgegrad.SunLight(-AT, 2.0, 0.3),
    "rectangle": lambda: edgegrad.AreaLight(facing(AT, (0, 0, 0)), np.array([0.5, 0.4]), power=60.0),
}


def corner(light: Light) -> edgegrad.Scene:
    """A box on a floor before a wall, one of rough metal and one a mirror."""
    return edgegrad.Scene(
        camera((0.3, -3.0, 1.6), (0, 0, 0.4), size=24, up=(0, 0, 1)),
        {"floor": rectangle((0, 0, 0), (1.4, 0, 0), (0, 1.4, 0), "grey"),
         "wall": rectangle((0, 1.0, 1.0), (1.4, 0, 0), (0, 0, 1.0), "metal"),
         "side": rectangle((-1.2, 0, 1.0), (0, 1.2, 0), (0, 0, 1.0), "mirror"),
         "box": box((0.0, 0.1, 0.45), (0.3, 0.25, 0.25), "grey", 0.4)},
        {"grey": matte(0.7, 0.6, 0.5),
         "metal": edgegrad.Material(np.array([0.8, 0.8, 0.7]), metallic=1.0, roughness=0.4),
         "mirror": edgegrad.Material(np.array([0.9, 0.9, 0.9]), metallic=1.0, roughness=0.0)},
        {"light": light}, edgegrad.World(np.zeros(3)),
    )  # fmt: skip


@pytest.mark.parametrize("kind", list(LIGHTS))
@pytest.mark.parametrize("limit", [0, 1])
def test_a_limit_of_bounces_ends_paths_of_the_light(kind: str, limit: int) -> None:
    """A light that alone lights a scene, up to k bounces, gives the picture of paths of k + 2 segments."""
    need_every_table()
    bounded, free = (edgegrad.Renderer(corner(replace(LIGHTS[kind](), max_bounces=k))) for k in (limit, None))
    strength = "strength" if kind == "sun's disk" else "power"
    shift = np.zeros_like(bounded.scene.meshes["box"].vertices) + [0.5, 0.3, 0.2]
    tangent = {"meshes.box.vertices": shift, f"lights.light.{strength}": 0.3 * getattr(LIGHTS[kind](), strength)}

    def pictures(renderer: edgegrad.Renderer, depth: int, first: int) -> tuple[list[Any], list[Any]]:
        seeds = range(first, first + 8)
        return ([renderer.render(spp=32, seed=k, max_depth=depth) for k in seeds],
                [renderer.render_forward(tangent, spp=32, seed=k, max_depth=depth) for k in seeds])  # fmt: skip

    for found, expected in zip(pictures(bounded, 5, 0), pictures(free, limit + 2, 100), strict=True):
        reference = np.array(expected, np.float64)
        check(compare(found, reference.mean(axis=0), reference.std(axis=0, ddof=1) / np.sqrt(len(reference))))


@pytest.mark.parametrize("kind", list(LIGHTS))
def test_negative_lights_take_away_what_positive_ones_give(kind: str) -> None:
    need_every_table()
    field = "strength" if kind == "sun's disk" else "power"
    light = LIGHTS[kind]()
    given, taken = (edgegrad.Renderer(corner(replace(light, **{field: sign * getattr(light, field)})))
                    for sign in (1.0, -1.0))  # fmt: skip
    tangent = {"meshes.box.transform": np.eye(4), "meshes.floor.vertices": np.full((4, 3), 0.3)}
    np.testing.assert_array_equal(given.render(spp=16, max_depth=4), -taken.render(spp=16, max_depth=4))
    options: dict[str, Any] = {"spp": 16, "max_depth": 4}
    np.testing.assert_array_equal(given.render_forward(tangent, **options), -taken.render_forward(tangent, **options))
    seed = np.random.default_rng(0).normal(size=(24, 24, 3)).astype(np.float32)
    there, back = (r.render_backward(seed, ["meshes.box.vertices"], **options) for r in (given, taken))
    np.testing.assert_array_equal(there["meshes.box.vertices"], -back["meshes.box.vertices"])


@pytest.mark.parametrize("limit", [1, 2])
def test_diffuse_paths_end_at_the_limit(limit: int) -> None:
    """Among matte surfaces, `ambient` bounces are as many diffuse ones less one: the ray after them ends."""
    need_every_table()
    scene = corner(LIGHTS["point"]())
    scene.materials |= dict.fromkeys(("metal", "mirror"), scene.materials["grey"])
    scene.world = edgegrad.World(np.full(3, 0.3))
    renderer = edgegrad.Renderer(scene)
    tangent = {"meshes.box.vertices": np.zeros_like(scene.meshes["box"].vertices) + [0.5, 0.3, 0.2]}

    def pictures(bounces: edgegrad.Bounces, first: int) -> tuple[Any, Any]:
        options: dict[str, Any] = {"spp": 32, "max_depth": 6, "bounces": bounces}
        seeds = range(first, first + 8)
        return (np.array([renderer.render(seed=k, **options) for k in seeds]),
                np.array([renderer.render_forward(tangent, seed=k, **options) for k in seeds]))  # fmt: skip

    ambient = pictures(edgegrad.Bounces(ambient=limit), 0)
    for found, expected in zip(ambient, pictures(edgegrad.Bounces(diffuse=limit - 1), 100), strict=True):
        check(compare(found, expected.mean(axis=0), expected.std(axis=0, ddof=1) / np.sqrt(len(expected))))


def test_the_first_glossy_bounce_and_transmission_do_not_count() -> None:
    need_every_table()
    scene = corner(LIGHTS["point"]())
    scene.materials["grey"] = edgegrad.Material(np.full(3, 0.8), metallic=1.0, roughness=0.3)
    renderer = edgegrad.Renderer(scene)
    first, both = (renderer.render(spp=16, max_depth=6, bounces=limit)
                   for limit in (edgegrad.Bounces(ambient=1), edgegrad.Bounces(glossy=1)))  # fmt: skip
    np.testing.assert_array_equal(first, both)

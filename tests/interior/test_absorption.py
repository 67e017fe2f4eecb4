"""Absorption in closed meshes: Beer's law, and its derivatives by the absorption and by the vertices."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from tests.support import shapes
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.picture_differences import need_every_table, sums_of_differences
from tests.support.small_scenes import box, camera, glowing, matte, rectangle

ABSORPTION = np.array([0.5, 1.0, 0.2])
KEPT = np.exp(-ABSORPTION)  # by one metre


def slab(kind: str) -> edgegrad.Scene:
    """The camera sees a lamp through one metre of a mesh that hardly bends light."""
    return edgegrad.Scene(
        camera((0, 0, 4), size=8, fov=0.1),
        {"slab": box((0, 0, 0), (2, 2, 0.5), "slab"), "lamp": rectangle((0, 0, -2), (3, 0, 0), (0, 3, 0), "lamp")},
        {"slab": edgegrad.Material(np.ones(3), kind=kind, ior=1.0001, roughness=0.0, absorption=ABSORPTION),
         "lamp": glowing(1.0, True)}, {}, edgegrad.World(np.zeros(3)),
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["REFRACTION", "TRANSPARENT"])
def test_light_is_absorbed_by_its_way_through_a_mesh(kind: str) -> None:
    need_every_table()
    renderer = edgegrad.Renderer(slab(kind))
    options = {"spp": 16, "max_depth": 4}
    np.testing.assert_allclose(renderer.render(**options)[4, 4], KEPT, rtol=2e-3)
    by_absorption = renderer.render_forward({"materials.slab.absorption": np.array([1.0, 2.0, 3.0])}, **options)
    np.testing.assert_allclose(by_absorption[4, 4], -KEPT * [1.0, 2.0, 3.0], rtol=2e-3)
    if kind == "REFRACTION":
        vertices = renderer.scene.meshes["slab"].vertices
        thicker = np.where(np.arange(3) == 2, np.sign(vertices), 0.0)
        found = renderer.render_forward({"meshes.slab.vertices": thicker}, **options)
        np.testing.assert_allclose(found[4, 4], -KEPT * ABSORPTION * 2.0, rtol=2e-3)


def test_shadow_rays_are_absorbed_in_transparent_meshes() -> None:
    need_every_table()
    floor = []
    for absorption in (ABSORPTION, np.zeros(3)):
        scene = slab("TRANSPARENT")
        scene.camera = camera((0, -3, -1.2), (0, 0, -2), size=8, fov=0.1, up=(0, 0, 1))
        scene.materials |= {"slab": edgegrad.Material(np.ones(3), kind="TRANSPARENT", absorption=absorption),
                            "lamp": matte(0.5, 0.5, 0.5)}  # fmt: skip
        scene.lights = {"sun": edgegrad.SunLight(np.array([0.0, 0.0, -1.0]), 2.0)}
        floor.append(edgegrad.Renderer(scene).render(spp=4)[4, 4])
    np.testing.assert_allclose(floor[0] / floor[1], KEPT, rtol=1e-3)


def ball(rough: bool) -> edgegrad.Scene:
    """A ball of rough glass, or of a matter that hardly bends light, in a constant environment."""
    scene = shapes.scene(*shapes.ball(2))
    scene.lights = {}
    scene.camera.width, scene.camera.height = 12, 9
    scene.materials["clay"] = edgegrad.Material(
        np.full(3, 0.95), kind="GLASS" if rough else "REFRACTION", ior=1.4 if rough else 1.0001,
        roughness=0.5 if rough else 0.0, absorption=0.8 * ABSORPTION)  # fmt: skip
    return scene


@pytest.mark.parametrize("rough", [False, True])
@pytest.mark.parametrize("field", ["materials.clay.absorption", "vertices"])
def test_pictures_change_as_their_derivatives_say(field: str, rough: bool) -> None:
    """By the absorption, and by vertices that move away from the middle of the ball."""
    need_every_table()
    scene = ball(rough)
    if field == "vertices":
        (name, mesh), = scene.meshes.items()
        field, direction = f"meshes.{name}.vertices", mesh.vertices * 1.0
    else:
        direction = np.array([0.7, 1.0, 0.4])
    found, exact = sums_of_differences(scene, field, direction, 0.02, max_depth=5)
    check(mean_p_value(found - exact, 0.0, rounding=2e-3 * abs(found.mean())))
    assert half_width(found - exact) < 0.5 * abs(exact.mean())


@pytest.mark.parametrize(("roughness", "spp"), [(0.0, 256), (0.4, 2048)])
def test_edges_behind_an_absorbing_slab(roughness: float, spp: int) -> None:
    """A small lamp moves behind the slab: smooth glass shows its edges by scan lines, rough glass by chains."""
    need_every_table()
    scene = slab("GLASS")
    scene.camera = camera((0, 0, 4), size=12, fov=0.5)
    scene.materials["slab"].roughness, scene.materials["slab"].ior = roughness, 1.4
    scene.meshes["lamp"] = rectangle((0, 0, -1.2), (0.4, 0, 0), (0, 0.3, 0), "lamp")
    direction = np.zeros((4, 3)) + [0.3, 0.1, 0.4]
    found, exact = sums_of_differences(scene, "meshes.lamp.vertices", direction, 0.03, max_depth=4, spp=spp)
    check(mean_p_value(found - exact, 0.0, rounding=2e-3 * abs(found.mean())))
    # Without absorption on the way, the derivative would be larger by two thirds.
    assert half_width(found - exact) < 0.6 * abs(exact.mean())

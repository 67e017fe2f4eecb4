"""Lights in pictures: their links, their visibility, and both ways to sample them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene.light import Light
from tests.support.light_directions import facing
from tests.support.small_scenes import camera, glowing, matte, pixel_at, rectangle


def room(light: Light) -> edgegrad.Scene:
    """One pixel of a floor, and a screen on the way to the light."""
    return edgegrad.Scene(
        pixel_at((0.0, -3.0, 2.0), (0, 0, 0), (0, 0, 1)),
        {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor"),
         "screen": rectangle((0, 0, 1.0), (0.2, 0, 0), (0, 0.2, 0), "floor")},
        {"floor": matte(0.5, 0.5, 0.5)}, {"light": light},
    )  # fmt: skip


def test_linking_shadows_and_receivers() -> None:
    at = np.array([0.0, 0.0, 2.0])
    free = 0.5 / np.pi * 10.0 / (4.0 * np.pi) / 4.0

    def pixel(**fields: Any) -> float:
        return float(Renderer(room(edgegrad.PointLight(at, 10.0, **fields))).render(spp=4)[0, 0, 0])

    assert pixel() == 0.0
    assert pixel(casts_shadow=False) == pytest.approx(free, rel=1e-3)
    assert pixel(blockers=("floor",)) == pytest.approx(free, rel=1e-3)
    assert pixel(blockers=("screen",)) == 0.0
    assert pixel(casts_shadow=False, receivers=("floor",)) == pytest.approx(free, rel=1e-3)
    assert pixel(casts_shadow=False, receivers=("screen",)) == 0.0
    assert pixel(casts_shadow=False, visible_to=frozenset(("camera", "glossy"))) == 0.0


@pytest.mark.parametrize(("kind", "hidden"), [("diffuse", "diffuse"), ("glossy", "glossy"), ("diffuse", "glossy"),
                                             ("glossy", "diffuse")])  # fmt: skip
def test_emissive_meshes_light_lobes_whose_rays_can_hit_them(kind: str, hidden: str) -> None:
    rough = edgegrad.Material(np.full(3, 0.5), roughness=0.6, kind="GLOSSY")
    floor = matte(0.5, 0.5, 0.5) if kind == "diffuse" else rough

    def pixel(without: str) -> float:
        panel = rectangle((0, 0, 2.0), (1, 0, 0), (0, 1, 0), "panel")
        panel.visible_to -= {without}
        scene = edgegrad.Scene(pixel_at((0.0, -3.0, 2.0), (0, 0, 0), (0, 0, 1)),
                               {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor"), "panel": panel},
                               {"floor": floor, "panel": glowing(2.0, True)})  # fmt: skip
        return float(Renderer(scene).render(spp=256, max_depth=2)[0, 0, 0])

    assert pixel(hidden) == (0.0 if kind == hidden else pytest.approx(pixel("shadow"), rel=0.02))


@pytest.mark.parametrize("hidden", ["diffuse", "transmission"])
def test_samples_of_lights_count_translucent_surfaces_as_diffuse(hidden: str) -> None:
    def pixel(without: str) -> float:
        light = edgegrad.PointLight(np.array([0.0, 0.0, -2.0]), 10.0)
        light.visible_to -= {without}
        scene = edgegrad.Scene(pixel_at((0.0, 0.0, 2.0), (0, 0, 0), (0, 1, 0)),
                               {"leaf": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "leaf")},
                               {"leaf": edgegrad.Material(np.full(3, 0.5), kind="TRANSLUCENT")},
                               {"light": light})  # fmt: skip
        return float(Renderer(scene).render(spp=16, max_depth=2)[0, 0, 0])

    assert pixel("glossy") > 0.0
    assert pixel(hidden) == (0.0 if hidden == "diffuse" else pytest.approx(pixel("glossy")))


def test_lights_with_a_size_are_seen_where_they_may_be() -> None:
    """The camera sees the light's radiance, and surfaces behind it as well; the light casts no shadow."""
    floor = {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor")}
    everything = frozenset(("camera", "diffuse", "glossy", "transmission", "shadow"))
    for light, radiance in (
        (edgegrad.AreaLight(facing((0, 0, 1), (0, 0, 2)), np.array([1.0, 1.0]), power=4.0), 4.0 / np.pi),
        (edgegrad.PointLight(np.array([0, 0, 1.0]), 4.0, 0.5, True), 4.0 / (4 * np.pi**2 * 0.25)),
    ):
        for seen in (True, False):
            light.visible_to = everything if seen else everything - {"camera"}
            scene = edgegrad.Scene(pixel_at((0, 0, 3.0), (0, 0, 0)), floor, {"floor": matte(0, 0, 0)}, {"light": light})
            assert Renderer(scene).render(spp=4)[0, 0, 0] == pytest.approx(radiance if seen else 0.0, rel=1e-4)


def test_both_strategies_give_the_light() -> None:
    """A rough mirror finds a sized light by its own rays too: the picture of a glossy floor under a sphere doesn't
    depend on whether samples of the light are possible for it."""
    lamp = edgegrad.PointLight(np.array([0.0, 0.6, 0.8]), 20.0, 0.4, True)
    glossy = edgegrad.Material(np.full(3, 0.8), kind="GLOSSY", roughness=0.3)
    view = camera((0, -2.0, 1.2), (0, 0, 0), size=8, fov=0.4, up=(0, 0, 1))
    floor = {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor")}
    scene = edgegrad.Scene(view, floor, {"floor": glossy}, {"light": lamp})
    # A mesh of the same radiance instead: small triangles around the sphere.
    n = 40
    v, faces = sphere_mesh(n)
    ball = edgegrad.Mesh(v * 0.4 + lamp.position, faces, ("hot",))
    hot = glowing(20.0 / (4 * np.pi**2 * 0.16))
    other = edgegrad.Scene(view, {**floor, "ball": ball}, {"floor": glossy, "hot": hot}, {})
    a, b = (np.mean([Renderer(s).render(spp=256, seed=k) for k in range(4)], axis=0)[4:] for s in (scene, other))
    assert a.mean() > 0.1
    assert a.mean() == pytest.approx(b.mean(), rel=0.01)


def sphere_mesh(n: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Unit sphere of n x 2n quads in triangles, wound outwards, with the sphere's area."""
    t, p = np.meshgrid(np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, 2 * n + 1), indexing="ij")
    v = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    i, j = (a.reshape(-1) for a in np.meshgrid(np.arange(n), np.arange(2 * n), indexing="ij"))
    a, b = i * (2 * n + 1) + j, (i + 1) * (2 * n + 1) + j
    faces = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)])
    m = np.cross(v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]])
    kept = np.linalg.norm(m, axis=1) > 1e-9
    area = np.linalg.norm(m, axis=1).sum() / 2
    return v * math.sqrt(4 * math.pi / area), faces[kept].astype(np.int32)

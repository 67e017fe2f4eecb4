"""What fields hide of the light of narrow lobes: followed, also beside textured fields and lights, or named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from edgegrad import AreaLight, Material, PointLight, Scene, World, plan
from edgegrad.expression import Attribute, Checker, Coordinates
from tests.support.fields.splines import Floats, exact_sphere
from tests.support.picture_differences import check_agreement, need_every_table
from tests.support.small_scenes import camera, rectangle

PATH = "fields.ball.transform"


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def over_a_gloss(roughness: float, lit: bool, theta: float = 0.0) -> Scene:
    """A ball with a colour on a grid, mirrored by a glossy floor."""
    rng = np.random.default_rng(1)
    paint = rng.uniform(0.2, 0.8, (3, 3, 3, 3)).astype(np.float32)
    place, lamp = np.eye(4), np.eye(4)
    place[:3, 3] = theta, 0.5 * theta, 0.1
    lamp[:3, 3] = 0.4, 0.3, 2.5
    materials = {"clay": Material(textures={"base_color": Attribute("paint", required=False)}),
                 "floor": Material(np.full(3, 0.9), kind="GLOSSY", roughness=roughness)}
    lights = {"lamp": AreaLight(lamp, np.array([0.6, 0.8]), power=40.0)} if lit else {}
    return Scene(camera((0.4, -2.6, 1.6), (0, 0, -0.4), size=16, fov=0.7, up=(0, 0, 1)),
                 {"floor": rectangle((0, 0, -0.8), (2.5, 0, 0), (0, 2.5, 0), "floor")}, materials, lights,
                 World(np.array([0.5, 0.4, 0.3])),
                 fields={"ball": replace(exact_sphere(0.6, 16), transform=place, attributes={"paint": paint})})


@pytest.mark.parametrize(("roughness", "lit"), [(0.06, True), (0.2, True), (0.2, False)])
def test_fields_in_narrow_lobes(roughness: float, lit: bool) -> None:
    tangent = np.zeros((4, 4))
    tangent[:2, 3] = 1.0, 0.5

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return over_a_gloss(roughness, lit, theta), {PATH: tangent}

    check_agreement(at, max_depth=2, eps=0.04, seeds=8, reference_spp=256)
    assert not any("narrow lobes" in sentence for sentence in plan(at(0.0)[0], [PATH], max_depth=2).missing)


def test_narrow_lobes_that_are_not_followed_are_named() -> None:
    """A texture that jumps keeps lobes from being followed."""
    scene = over_a_gloss(0.1, True)
    squares = Checker(Coordinates("POSITION"), scale=3.0)
    scene.materials = {**scene.materials, "clay": Material(textures={"base_color": squares})}
    assert any("hide of the light of narrow lobes (floor)" in sentence
               for sentence in plan(scene, [PATH], max_depth=2).missing)
    scene.materials["floor"].roughness = 0.5
    assert not any("narrow lobes" in sentence for sentence in plan(scene, [PATH], max_depth=2).missing)


def beside_a_highlight(radius: float, theta: float, moving: str) -> Scene:
    """A part of a polished sheet beside the highlight of a lamp: rays of the lobe rarely meet the lamp there.

    A small ball stands between this part and the lamp.
    """
    steps = {which: theta * np.array([0.5, 0.3, -0.2]) * (which == moving) for which in ("lamp", "ball")}
    lamp = PointLight(np.array([0.9, 0.9, 0.6]) + steps["lamp"], power=20.0, radius=radius, sphere=True)
    place = np.eye(4)
    place[:3, 3] = np.array([0.45, 0.45, 0.3]) + steps["ball"]
    return Scene(camera((-0.9, 1.2, 0.4), (0.0, 0.0, 0.0), 12, 0.12),
                 {"sheet": rectangle((0, 0, 0), (0, 0, 0.6), (0.6, 0, 0), "metal")},
                 {"metal": Material(np.array([0.9, 0.7, 0.5]), metallic=1.0, roughness=0.1),
                  "clay": Material(np.zeros(3))},
                 {"lamp": lamp}, World(np.zeros(3)),
                 fields={"ball": replace(exact_sphere(0.04, 12), transform=place)})


@pytest.mark.parametrize("radius", [0.02, 0.1])
@pytest.mark.parametrize("moving", ["lamp", "ball"])
def test_tails_of_highlights(radius: float, moving: str) -> None:
    """Emitter samples find the light of lamps, and what fields hide of it, in the tails of followed lobes."""
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = 0.5, 0.3, -0.2
    rates = {"lamp": {"lights.lamp.position": tangent[:3, 3]}, "ball": {PATH: tangent}}

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return beside_a_highlight(radius, theta, moving), rates[moving]

    check_agreement(at, max_depth=2, eps=0.01, seeds=8, spp=256, reference_spp=2048, thetas=4)

"""Shadows of distance fields, and on them, that mirrors and smooth glass show, beside central differences.

The mirror and the glass are visible to the camera alone: they hide no light from what they show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from edgegrad import AreaLight, PointLight, Scene, SunLight, World
from tests.support.block_statistics import check_noticed
from tests.support.fields.in_mirrors import changed
from tests.support.fields.splines import Floats, exact_sphere
from tests.support.picture_differences import (
    agreement,
    check_agreement,
    check_equal_bits,
    check_transpose,
    need_every_table,
)
from tests.support.scenes.mirrors_and_glass import GLASS, MIRROR
from tests.support.small_scenes import box, camera, matte, rectangle

UNSEEN = frozenset(["diffuse", "shadow"])
ABOVE = np.eye(4)
ABOVE[:3, 3] = 0.4, 0.3, 3.0
LIGHTS = {
    "point": PointLight(np.array([0.4, 0.3, 3.0]), power=300.0),
    "sun": SunLight(np.array([0.2, 0.1, -1.0]), strength=5.0, angle=0.0),
    "area": AreaLight(ABOVE, power=200.0, size=np.array([0.8, 0.5]), visible_to=UNSEEN),
    "sky": None,
}
OPTIONS = {"eps": 0.02, "seeds": 8, "thetas": 4, "reference_spp": 256, "max_depth": 4}


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def shown(optics: str, light: str, clear: bool = False) -> Scene:
    """The shadow of a field on a floor, which the camera sees by way of a mirror or glass alone."""
    lamp = LIGHTS[light]
    body = replace(exact_sphere(0.45, 20), transform=np.array(
        [[0.8, 0, 0, 0], [0, 0.8, 0, 0], [0, 0, 0.8, 0.8], [0, 0, 0, 1.0]]), visible_to=UNSEEN)
    if optics == "mirror":
        optic = rectangle((0, 1.6, 0.9), (1.5, 0, 0), (0, 0, 0.9), "mirror")
        view = camera((0.3, -1.0, 2.0), (0.0, 1.6, 0.9), 16, 0.5)
    else:
        optic = box((0, 0, 2.4), (1.2, 1.2, 0.1), "glass", 0.3)
        view = camera((0.3, -0.2, 4.0), (0.0, 0.0, 0.0), 16, 0.55, up=(0, 1, 0))
    optic.visible_to = frozenset(["camera", "transmission"])
    clay = replace(matte(0.8, 0.3, 0.3), kind="PRINCIPLED", alpha=0.5) if clear else matte(0.0, 0.0, 0.0)
    return Scene(view, {"floor": rectangle((0, 0, 0), (3, 0, 0), (0, 3, 0), "floor"), optics: optic},
                 {"floor": matte(0.7, 0.6, 0.5), "clay": clay, "mirror": MIRROR, "glass": GLASS},
                 fields={"body": body}, lights={} if lamp is None else {"lamp": lamp},
                 world=World(np.array([0.6, 0.8, 1.0]) if lamp is None else np.zeros(3)))


def on_a_field(light: str) -> Scene:
    """A leaf throws its shadow on a ball, which a mirror shows."""
    scene = shown("mirror", light)
    leaf = rectangle((0.1, 0.0, 2.0), (0.25, 0.1, 0.0), (0.0, 0.3, 0.1), "clay")
    leaf.visible_to = UNSEEN
    del scene.meshes["floor"]
    scene.meshes["sheet"] = leaf
    scene.fields["body"] = replace(exact_sphere(0.9, 20, material="floor"), transform=np.array(
        [[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0.3], [0, 0, 0, 1.0]]))
    scene.camera = camera((0.3, -1.4, 3.0), (0.0, 1.6, 0.9), 16, 0.5)
    return scene


@pytest.mark.parametrize(("optics", "light", "what", "clear"), [
    ("mirror", "point", "values", False), ("mirror", "area", "transform", False), ("mirror", "sun", "values", False),
    ("mirror", "sky", "values", False), ("mirror", "point", "camera", False), ("mirror", "area", "optic", False),
    ("glass", "point", "values", False), ("glass", "area", "values", False), ("mirror", "point", "values", True)])
def test_the_shadow_of_a_field(optics: str, light: str, what: str, clear: bool) -> None:
    scene = shown(optics, light, clear)
    check_agreement(lambda theta: changed(scene, what, theta), **OPTIONS)


@pytest.mark.parametrize(("light", "what"), [("point", "values"), ("area", "transform"), ("point", "sheet")])
def test_the_shadow_on_a_field(light: str, what: str) -> None:
    scene = on_a_field(light)
    check_agreement(lambda theta: changed(scene, what, theta), **OPTIONS)


def test_differences_notice_a_missing_term() -> None:
    def moving(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return changed(shown("mirror", "point"), "values", theta)

    check_noticed(agreement(moving, terms=("interior", "primary", "indirect"), **OPTIONS))


@pytest.mark.parametrize("light", ["point", "area"])
def test_modes_are_transposes(light: str) -> None:
    scene = shown("mirror", light)
    paths = ["fields.body.values", "fields.body.transform", "camera.to_world", "meshes.mirror.vertices"]
    check_transpose(lambda _: scene, paths, spp=16, seed=3, max_depth=4)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=4)

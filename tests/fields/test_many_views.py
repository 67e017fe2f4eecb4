"""A field seen in a glossy floor, in a mirror and through glass, in each kind of light, by cameras that move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from edgegrad import AreaLight, Material, PointLight, Scene, SpotLight, SunLight, World
from tests.support.fields.in_mirrors import changed
from tests.support.fields.outlined import doughnut
from tests.support.fields.splines import Floats
from tests.support.picture_differences import check_agreement, need_every_table
from tests.support.scenes.mirrors_and_glass import GLASS, MIRROR
from tests.support.small_scenes import box, camera, matte, rectangle

UNSEEN = frozenset(["diffuse", "shadow"])
ABOVE = np.eye(4)
ABOVE[:3, 3] = 0.5, -0.4, 3.2
LIGHTS: dict[str, Any] = {
    "point": PointLight(ABOVE[:3, 3].copy(), power=300.0),
    "spot": SpotLight(ABOVE[:3, 3].copy(), np.array([-0.1, 0.1, -1.0]), power=600.0, angle=1.6, blend=1.0),
    "sun": SunLight(np.array([0.2, 0.3, -1.0]), strength=4.0, angle=0.1, visible_to=UNSEEN),  # no caustics
    "area": AreaLight(ABOVE, power=200.0, size=np.array([0.8, 0.5]), visible_to=UNSEEN),
}
FLOORS = {"glossy": Material(np.array([0.8, 0.7, 0.6]), kind="GLOSSY", roughness=0.3),
          "sharp": Material(np.array([0.8, 0.7, 0.6]), kind="GLOSSY", roughness=0.1), "mirror": MIRROR,
          "glass": matte(0.7, 0.6, 0.5)}
CASES = [
    *product(("glossy", "mirror", "glass"), ("point", "spot", "sun", "area", "sky"), ("values",), ("still",)),
    *product(("glossy", "mirror", "glass"), ("sky",), ("transform", "camera"), ("still",)),
    *product(("glossy", "mirror", "glass"), ("sky",), ("values", "camera"), ("orthographic", "lens")),
    ("sharp", "sky", "values", "still"), ("sharp", "area", "transform", "still"), ("sharp", "sky", "camera", "still"),
]
QUICK = [("glossy", "sky", "values", "still"), ("mirror", "area", "values", "still"),
         ("glass", "sun", "values", "still"), ("mirror", "sky", "camera", "lens"),
         ("glass", "sky", "camera", "orthographic"), ("sharp", "sky", "values", "still")]


def shown(floor: str, light: str, view: str) -> Scene:
    """A torus over a floor; or the same behind a pane of glass."""
    seen_by = camera((0.5, -2.8, 1.9), (0.0, 0.1, 0.3), 16, 0.7)
    if view == "orthographic":
        seen_by = replace(seen_by, kind="ORTHOGRAPHIC", ortho_width=2.6)
    elif view == "lens":
        seen_by = replace(seen_by, aperture_radius=0.1, focus_distance=2.4)
    stands = np.array([[0.7, 0.0, 0.0, 0.0], [0.0, 0.3, -0.63, 0.1], [0.0, 0.63, 0.3, 0.8], [0.0, 0.0, 0.0, 1.0]])
    meshes = {"floor": rectangle((0, 0.3, 0), (1.6, 0, 0), (0, 1.6, 0), "floor")}
    if floor == "glass":
        meshes["glass"] = box((0.3, -1.5, 1.1), (1.0, 0.1, 1.0), "glass", 0.4)
        meshes["glass"].visible_to = frozenset(["camera", "transmission"])
    lamp = LIGHTS.get(light)
    return Scene(seen_by, meshes, {"floor": FLOORS[floor], "clay": matte(0.6, 0.7, 0.8), "glass": GLASS},
                 fields={"body": doughnut(transform=stands)}, lights={"lamp": lamp} if lamp else {},
                 world=World(np.zeros(3) if lamp else np.array([0.6, 0.8, 1.0])))


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


@pytest.mark.parametrize(("floor", "light", "what", "view"), [
    case if case in QUICK else pytest.param(*case, marks=pytest.mark.slow) for case in CASES])
def test_agrees_with_differences(floor: str, light: str, what: str, view: str) -> None:
    scene = shown(floor, light, view)

    def moving(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return changed(scene, what, theta)

    # One segment for the camera, one for each surface on the way, and one to the light
    depth = {"glass": 4}.get(floor, 3)
    check_agreement(moving, eps=0.02, seeds=16, thetas=8, reference_spp=512, spp=128, max_depth=depth)

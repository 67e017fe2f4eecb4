"""The plan names what it cannot render without noise."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Material, Scene, plan
from edgegrad import expression as e
from tests.support.scenes.concave_bodies import CLAY, lit, room_corner
from tests.support.small_scenes import box, matte, need, rectangle


def noisy(scene: Scene, max_depth: int = 3) -> list[str]:
    """The plan's sentences on noise, of a shift of the body."""
    found = plan(scene, wrt=["meshes.body.vertices"], max_depth=max_depth)
    return [why for term in found.terms for why in term.why if why.startswith("noisy")]


@pytest.mark.parametrize("material", [Material(np.ones(3), metallic=1.0, roughness=0.0),
                                      Material(np.full(3, 0.5), kind="PRINCIPLED", alpha=0.5)])
def test_concave_corners_of_mirrors_and_transparent_surfaces_are_named(material: Material) -> None:
    need("native")
    assert len(noisy(lit(room_corner(), material))) == 1
    assert not noisy(lit(room_corner(), CLAY))
    assert not noisy(lit(room_corner(), material), max_depth=2)  # no light between its faces
    assert not noisy(lit(box((0, 0.3, 0), (0.3, 0.3, 0.3), "body"), material))  # convex


@pytest.mark.parametrize("height", [0.0, 0.5])
def test_checked_floors_that_other_meshes_touch_are_named(height: float) -> None:
    need("native")
    scene = lit(box((0, 0.3 + height, 0), (0.3, 0.3, 0.3), "body"))
    scene.meshes["floor"] = rectangle((0, 0, 0), (0, 0, 2), (2, 0, 0), "floor")
    scene.materials["floor"] = matte(0.5, 0.5, 0.5)
    assert not noisy(scene)
    checks = e.Checker(e.Coordinates("POSITION"), (0.8, 0.8, 0.8), (0.2, 0.2, 0.2), 5.0)
    scene.materials["floor"] = Material(kind="DIFFUSE", textures={"base_color": checks})
    assert len(noisy(scene)) == (height == 0.0)


@pytest.mark.parametrize("roughness", [0.1, 0.5])
def test_narrow_lobes_that_light_other_surfaces_are_named(roughness: float) -> None:
    need("native")
    scene = lit(box((0, 0.8, 0), (0.3, 0.3, 0.3), "body"), Material(np.ones(3), metallic=1.0, roughness=roughness))
    assert len(noisy(scene)) == (roughness == 0.1)
    assert not noisy(scene, max_depth=2)

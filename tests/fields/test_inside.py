"""Outlines that bound rays within fields: of clear and translucent ones, and of those that are negative all around."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from edgegrad import AreaLight, Field, Material, Renderer, Scene, SunLight, World
from tests.support.fields.splines import Floats, sampled, torus
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.small_scenes import camera, matte, rectangle

FLOOR = rectangle((0, 0, -0.8), (2.5, 0, 0), (0, 2.5, 0), "floor")
TURNED = np.array([[0.8, 0.0, 0.6, 0.0], [0.36, 0.8, -0.48, 0.0], [-0.48, 0.6, 0.64, 0.1], [0.0, 0.0, 0.0, 1.0]])
MATERIALS = {"veil": Material(np.array([0.7, 0.6, 0.5]), alpha=0.4), "clay": matte(0.7, 0.6, 0.5),
             "paper": Material(np.array([0.9, 0.8, 0.7]), kind="TRANSLUCENT"), "floor": matte(0.6, 0.5, 0.4)}
SKY = World(np.array([0.3, 0.4, 0.5]))


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def shell(p: Floats) -> Floats:
    """A ball with a hollow: the rays of a camera touch the hollow from within the wall."""
    return np.asarray(np.abs(np.linalg.norm(p, axis=-1) - 0.6) - 0.15)


def lit_by(light: str) -> dict[str, Any]:
    """The world, the lights and the meshes of a scene."""
    lamp = np.eye(4)
    lamp[:3, 3] = 0.4, 0.3, 2.5
    match light:
        case "sky":
            return {"world": SKY}
        case "sun":
            return {"lights": {"sun": SunLight(np.array([0.4, 0.3, -1.0]), 3.0)}, "meshes": {"floor": FLOOR}}
    return {"lights": {"lamp": AreaLight(lamp, np.array([0.6, 0.8]), power=40.0)}, "meshes": {"floor": FLOOR}}


def scene(field: Field, theta: float, light: str) -> Scene:
    """The field moved by theta along each coordinate in a different measure."""
    placed = TURNED.copy()
    placed[:3, 3] += theta * np.array([1.0, 0.5, 0.4])
    given: dict[str, Any] = {
        "camera": camera((0.4, -2.6, 2.4), size=16, fov=0.65, up=(0, 0, 1)), "materials": MATERIALS,
        "fields": {"thing": replace(field, transform=placed)}}  # fmt: skip
    return Scene(**(given | lit_by(light)))


@pytest.mark.parametrize(
    ("shape", "material", "light", "depth"),
    [("shell", "veil", "sky", 2), ("shell", "veil", "sun", 2), ("shell", "veil", "rectangle", 2),
     ("torus", "paper", "sky", 3)])
def test_rays_that_touch_the_surface_from_inside(shape: str, material: str, light: str, depth: int) -> None:
    field = sampled({"shell": shell, "torus": torus}[shape], 28, material=material)
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = 1.0, 0.5, 0.4

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return scene(field, theta, light), {"fields.thing.transform": tangent}

    check_agreement(at, max_depth=depth, eps=0.04, seeds=8, reference_spp=256)
    check_transpose(lambda t: scene(field, t, light), ["fields.thing.values", "fields.thing.transform"], spp=8,
                    max_depth=depth)


@pytest.mark.parametrize(("light", "depth"), [("sky", 1), ("rectangle", 2)])
def test_a_field_with_its_sign_exchanged(light: str, depth: int) -> None:
    """It is negative around a torus, so that all that the camera sees lies inside of the field."""
    field = sampled(lambda p: -torus(p), 28)
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = 1.0, 0.5, 0.4

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return scene(field, theta, light), {"fields.thing.transform": tangent}

    check_agreement(at, max_depth=depth, eps=0.04, seeds=8, reference_spp=256)


def test_a_change_of_material_and_camera_counts() -> None:
    """Outlines inside that one call leaves out are found by the next one, when the surface has become clear."""
    field = sampled(shell, 28, material="veil")
    tangent = np.zeros((4, 4))
    tangent[0, 3] = 1.0
    whole = Renderer(scene(field, 0.0, "sky")).render_forward({"fields.thing.transform": tangent}, spp=8, max_depth=2)
    opaque = scene(field, 0.0, "sky")
    opaque.materials = {**opaque.materials, "veil": replace(MATERIALS["veil"], alpha=1.0)}
    renderer = Renderer(opaque)
    renderer.render_forward({"fields.thing.transform": tangent}, spp=8, max_depth=2)
    opaque.materials["veil"].alpha = 0.4
    renderer.update(["materials.veil.alpha"])
    found = renderer.render_forward({"fields.thing.transform": tangent}, spp=8, max_depth=2)
    np.testing.assert_array_equal(found, whole)

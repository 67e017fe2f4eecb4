"""Cycles' Filter Glossy: narrow lobes are wider where paths reach them by diffuse bounces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Bounces
from edgegrad import expression as e
from tests.support.picture_differences import (
    check_agreement,
    check_equal_bits,
    check_transpose,
    need_every_table,
)
from tests.support.scenes.box_under_lights import at
from tests.support.small_scenes import Floats, along, camera, mesh_drifts, rectangle

MATTE = edgegrad.Material(np.array([0.8, 0.7, 0.6]), kind="DIFFUSE")
POLISHED = edgegrad.Material(np.array([0.7, 0.6, 0.5]), roughness=0.1, specular_ior_level=1.0)
ROUGH = edgegrad.Material(np.array([0.8, 0.7, 0.6]), kind="GLOSSY", roughness=0.6)


def gloss(roughness: float) -> edgegrad.Material:
    return edgegrad.Material(np.full(3, 0.9), kind="GLOSSY", roughness=roughness, multiscatter=False)


def glass(roughness: float) -> edgegrad.Material:
    return edgegrad.Material(np.full(3, 0.95), kind="GLASS", roughness=roughness, ior=1.4, multiscatter=False)


def coat(roughness: float) -> edgegrad.Material:
    return edgegrad.Material(np.array([0.6, 0.3, 0.2]), coat_weight=1.0, coat_roughness=roughness, coat_ior=2.0)


def leaning(angle: float) -> Floats:
    return np.array([0.0, np.cos(angle), np.sin(angle)])


def room(wall: edgegrad.Material, floor: edgegrad.Material = MATTE, light: str = "area") -> edgegrad.Scene:
    """A wall that throws light on a floor before it, and a card over the floor, seen from above."""
    scene = edgegrad.Scene(
        camera((0, 0, 6), (0, 1e-3, 0), 32, 0.9),
        {
            "floor": rectangle((0, 0, 0), (5, 0, 0), (0, 5, 0), "floor"),
            "wall": rectangle((0, 1.2, 1), (1.5, 0, 0), tuple(1.5 * leaning(1.2)), "wall"),
            "card": rectangle((0.3, -0.3, 0.9), (0.5, 0, 0), tuple(0.5 * leaning(0.5)), "card"),
        },
        {"floor": floor, "wall": wall, "card": edgegrad.Material(np.array([0.2, 0.7, 0.3]), kind="DIFFUSE")},
    )
    if light == "area":
        c, s = np.cos(1.2), np.sin(1.2)
        pose = at(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.array([0.0, -3.0, 2.0]))
        scene.lights["lamp"] = edgegrad.AreaLight(pose, np.ones(2), power=100.0)
    elif light == "point":
        scene.lights["lamp"] = edgegrad.PointLight(np.array([0.4, -2.0, 1.5]), 100.0, 0.3)
    else:
        scene.world = edgegrad.World(np.array([0.5, 0.6, 0.9]))
    return scene


def least_alpha(value: float) -> float:
    """Mean of Cycles' least alpha over the cosine distribution of a diffuse bounce."""
    cosine = (np.arange(200_000) + 0.5) / 200_000
    least = 0.5 * np.sqrt(np.maximum(1.0 - cosine / (np.pi * value), 0.0))
    return float(np.mean(2.0 * cosine * least))


@pytest.mark.parametrize("wall", [gloss(0.0), gloss(0.1), gloss(0.9), glass(0.1)],
                         ids=lambda m: f"{m.kind} {m.roughness}")
@pytest.mark.parametrize("value", [0.1, 1.0, 10.0])
def test_lobes_have_a_least_roughness_behind_diffuse_bounces(wall: edgegrad.Material, value: float) -> None:
    """The picture is that of a roughness which reads the number of diffuse bounces."""
    need_every_table()
    behind = e.Math("GREATER_THAN", e.RayBounces("DIFFUSE"), 0.5)
    wider = e.Math("MAXIMUM", wall.roughness, e.Math("MULTIPLY", behind, float(np.sqrt(least_alpha(value)))))
    by_nodes = room(replace(wall, textures={"roughness": wider}))
    options = {"spp": 32, "max_depth": 5, "seed": 2}
    wanted = edgegrad.render(by_nodes, **options)
    picture = edgegrad.render(room(wall), bounces=Bounces(filter_glossy=value), **options)
    np.testing.assert_allclose(picture, wanted, atol=1e-4, rtol=1e-3)


def test_coats_are_wider_too() -> None:
    need_every_table()
    options = {"spp": 256, "max_depth": 4, "seed": 1}
    sharp, wide = room(coat(0.03)), room(coat(float(np.sqrt(least_alpha(1.0)))))
    filtered = edgegrad.render(sharp, bounces=Bounces(filter_glossy=1.0), **options)
    floor = np.s_[20:, :]  # sees the wall's coat by diffuse bounces alone
    away = abs(filtered - edgegrad.render(wide, **options))[floor].mean()
    # The layers' weights are those of the sharp coat
    assert away < 0.5 * abs(filtered - edgegrad.render(sharp, **options))[floor].mean()


def test_what_the_camera_sees_directly_stays() -> None:
    options = {"spp": 8, "max_depth": 2}
    scene = room(gloss(0.1))
    np.testing.assert_array_equal(edgegrad.render(scene, bounces=Bounces(filter_glossy=1.0), **options),
                                  edgegrad.render(scene, **options))


def test_it_cannot_be_negative() -> None:
    with pytest.raises(ValueError, match="filter_glossy must not be below 0"):
        edgegrad.render(room(gloss(0.1)), spp=1, bounces=Bounces(filter_glossy=-1.0))


ON = Bounces(filter_glossy=1.0)
CASES = {
    "mirror over matte": (mesh_drifts(lambda: room(gloss(0.0), MATTE, "area"), "card"), ON),
    "mirror over polished": (mesh_drifts(lambda: room(gloss(0.0), POLISHED, "area"), "card"), ON),
    "gloss over rough": (mesh_drifts(lambda: room(gloss(0.1), ROUGH, "point"), "card"), ON),
    "glass over matte": (mesh_drifts(lambda: room(glass(0.0), MATTE, "point"), "card"), ON),
    "coat over polished": (mesh_drifts(lambda: room(coat(0.1), POLISHED, "sky"), "wall"), ON),
    "limits": (mesh_drifts(lambda: room(gloss(0.1), POLISHED, "area"), "card"), replace(ON, diffuse=1, glossy=2)),
}


@pytest.mark.parametrize("name", CASES)
def test_derivatives_agree_with_differences(name: str) -> None:
    need_every_table()
    (make, paths), bounces = CASES[name]
    check_agreement(along(make, paths), eps=0.05, spp=128, reference_spp=1024, max_depth=4, bounces=bounces)


@pytest.mark.parametrize("name", ["mirror over polished", "limits"])
def test_modes_are_transposes(name: str) -> None:
    (make, paths), bounces = CASES[name]
    check_transpose(make, paths, spp=16, max_depth=5, bounces=bounces)


def test_bits_are_equal() -> None:
    (make, paths), bounces = CASES["mirror over polished"]
    check_equal_bits(make, paths, spp=4, max_depth=5, bounces=bounces)

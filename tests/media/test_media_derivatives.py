"""Derivatives of light that media scatter: beside differences, between both modes, and what the plan names."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.scene import parameters
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.picture_differences import check_equal_bits, check_transpose, sums_of_differences
from tests.support.scenes.gloss import glossy_ball
from tests.support.small_scenes import box, camera, glowing, rectangle

THIN = 1e-3  # 1/m: such a medium keeps nearly all light, so that its transmittance hardly changes


def foggy_room(scattering: float = 0.3, gloss: bool = False) -> edgegrad.Scene:
    """A floor and a wall in fog, under a lamp, a glowing block and a sky."""
    fog = edgegrad.Material(np.ones(3), kind="TRANSPARENT",
                            medium=edgegrad.Medium((scattering,) * 3, (0.5 * scattering,) * 3, 0.3))  # fmt: skip
    floor = (edgegrad.Material(np.array([0.7, 0.5, 0.3]), kind="GLOSSY", roughness=0.5) if gloss
             else edgegrad.Material(np.array([0.7, 0.5, 0.3]), kind="DIFFUSE"))  # fmt: skip
    return edgegrad.Scene(
        camera((0, 1.2, 3.5), size=8, fov=0.8),
        {"fog": box((0, 0.5, 0), (1.5, 1.0, 1.5), "fog"),
         "floor": rectangle((0, 0, 0), (1.2, 0, 0), (0, 0, -1.2), "floor"),
         "block": box((0.5, 0.4, -0.3), (0.1, 0.1, 0.1), "glow")},
        {"fog": fog, "floor": floor, "glow": glowing(4.0)},
        {"lamp": edgegrad.PointLight(np.array([-0.4, 0.9, 0.2]), 20.0, radius=0.05)},
        edgegrad.World(np.array([0.3, 0.2, 0.4])),
    )  # fmt: skip


@pytest.mark.parametrize(("path", "direction", "gloss"), [
    ("materials.floor.base_color", np.array([0.3, 1.0, 0.5]), False),
    ("materials.floor.base_color", np.array([0.3, 1.0, 0.5]), True),
    ("materials.glow.emission", np.array([2.0, 1.0, 0.5]), False),
    ("lights.lamp.power", 10.0, False),
    ("world.color", np.array([0.3, 0.1, 0.2]), False),
])  # fmt: skip
def test_colors_and_strengths(path: str, direction: Any, gloss: bool) -> None:
    found, exact = sums_of_differences(foggy_room(gloss=gloss), path, direction, 0.02, max_depth=6, spp=512)
    check(mean_p_value(found - exact, 0.0, rounding=2e-3 * abs(found.mean())))
    assert half_width(found - exact) < 0.5 * abs(exact.mean())


@pytest.mark.parametrize("name", ["lights.lamp.position", "materials.glow.emission"])
def test_lamps_move_over_what_thin_fog_scatters(name: str) -> None:
    """No surface but the fog: the camera sees the light that it scatters, and no shadows."""
    scene = foggy_room(THIN)
    del scene.meshes["floor"]
    if name == "lights.lamp.position":
        del scene.meshes["block"]
        scene.lights["lamp"].position = np.array([0.2, 1.9, 0.3])  # outside: its light has no peak in the fog
        scene.world = edgegrad.World(np.zeros(3))
        direction: Any = np.array([0.7, 0.3, 1.0])
    else:
        direction = np.ones(3)
    found, exact = sums_of_differences(scene, name, direction, 0.02, max_depth=2, spp=1024)
    check(mean_p_value(found - exact, 0.0, rounding=5e-3 * abs(found.mean())))
    assert half_width(found - exact) < 0.5 * abs(exact.mean())


def smoke_between(*, overlap: bool = False) -> edgegrad.Scene:
    """Smoke between a lamp and a floor in a sky, beside the camera: only shadow rays and bounces pass it."""
    smoke = edgegrad.Medium((0.4, 0.2, 0.1), (0.3, 0.5, 0.4), 0.2)
    scene = edgegrad.Scene(
        camera((0, 1.5, 3.5), size=8, fov=0.5),
        {"smoke": box((0, 1.8, 0), (0.8, 0.4, 0.8), "smoke"),
         "floor": rectangle((0, 0, 0), (1.2, 0, 0), (0, 0, -1.2), "floor")},
        {"smoke": edgegrad.Material(np.ones(3), kind="TRANSPARENT", medium=smoke),
         "floor": edgegrad.Material(np.array([0.7, 0.5, 0.3]), kind="DIFFUSE")},
        {"lamp": edgegrad.PointLight(np.array([0.1, 3.0, 0.2]), 60.0, radius=0.05)},
        edgegrad.World(np.array([0.3, 0.2, 0.4])),
    )  # fmt: skip
    if overlap:
        scene.meshes["more"] = box((0.2, 1.7, 0.1), (0.7, 0.4, 0.7), "more")
        scene.materials["more"] = edgegrad.Material(
            np.ones(3), kind="TRANSPARENT", medium=edgegrad.Medium((0.3, 0.3, 0.6), (0.1, 0.2, 0.1), -0.4))
    return scene


COEFFICIENTS = {"scattering": np.array([1.0, 0.5, 0.3]), "absorption": np.array([0.4, 1.0, 0.6]), "anisotropy": 1.0}


def check_coefficient(scene: edgegrad.Scene, holder: str, field: str, **options: Any) -> None:
    """The derivative by a medium's coefficient agrees with differences, whose noise is small."""
    found, exact = sums_of_differences(scene, f"{holder}.medium.{field}", COEFFICIENTS[field], 0.02, **options)
    light = float(edgegrad.render(scene, spp=64, max_depth=options["max_depth"]).sum())
    check(mean_p_value(found - exact, 0.0, rounding=2e-3 * abs(found.mean())))
    assert half_width(exact) < 0.25 * abs(found.mean()) + 0.1 * light


@pytest.mark.parametrize("field", COEFFICIENTS)
@pytest.mark.parametrize("gloss", [False, True])
def test_coefficients_of_fog_in_a_mesh(field: str, gloss: bool) -> None:
    check_coefficient(foggy_room(gloss=gloss), "materials.fog", field, max_depth=5, spp=256)


@pytest.mark.parametrize("field", COEFFICIENTS)
def test_coefficients_of_fog_in_the_world(field: str) -> None:
    scene = foggy_room()
    scene.world.medium, scene.materials["fog"].medium = scene.materials["fog"].medium, None
    check_coefficient(scene, "world", field, max_depth=5, spp=256)


@pytest.mark.parametrize(("field", "overlap"), [("scattering", False), ("absorption", False), ("absorption", True)])
def test_coefficients_of_smoke_that_only_shadow_rays_pass(field: str, overlap: bool) -> None:
    """Paths of two segments: light of the lamp and of the sky that reaches the floor through the smoke."""
    scene = smoke_between(overlap=overlap)
    check_coefficient(scene, "materials.smoke", field, max_depth=2, spp=256)


@pytest.mark.parametrize("field", COEFFICIENTS)
def test_coefficients_where_media_overlap(field: str) -> None:
    scene = smoke_between(overlap=True)
    scene.camera.to_world = camera((0, 1.8, 2.5), size=8, fov=0.6).to_world
    check_coefficient(scene, "materials.more", field, max_depth=4, spp=512)


def test_scattering_of_a_channel_that_scatters_nothing_yet() -> None:
    """The one-sided derivative at 0, of which pictures have no samples."""
    scene = smoke_between()
    scene.materials["smoke"].medium = edgegrad.Medium((0.4, 0.2, 0.0), (0.3, 0.5, 0.4), 0.2)
    scene.camera.to_world = camera((0, 1.8, 2.5), size=8, fov=0.6).to_world
    blue = np.array([0.0, 0.0, 1.0])
    found, exact = sums_of_differences(scene, "materials.smoke.medium.scattering", blue, 0.02, one_sided=True,
                                       spp=1024, max_depth=4)  # fmt: skip
    # The difference has the second derivative, too: an extinction of .4 grows by .02 over ways of at most 1 m
    check(mean_p_value(found - exact, 0.0, rounding=0.03 * abs(found.mean())))
    assert half_width(exact) < 0.25 * abs(found.mean())


def test_parts_of_mixtures_pass_on_the_mediums_derivative() -> None:
    """A mixture has the medium of its first part."""
    plain = foggy_room()
    mixed = foggy_room()
    fog = mixed.materials["fog"]
    mixed.materials |= {"a": fog, "b": edgegrad.Material(np.ones(3), kind="TRANSPARENT", medium=fog.medium),
                        "fog": edgegrad.Mixture(("a", "b"), np.array([0.5, 0.5]))}  # fmt: skip
    adjoint = np.ones((8, 8, 3), np.float32)
    one = edgegrad.Renderer(plain).render_backward(adjoint, ["materials.fog.medium.absorption"], spp=64, max_depth=4)
    parts = [f"materials.{name}.medium.absorption" for name in "ab"]
    two = edgegrad.Renderer(mixed).render_backward(adjoint, parts, spp=64, max_depth=4)
    np.testing.assert_allclose(two[parts[0]], one["materials.fog.medium.absorption"], rtol=0.2)
    assert not two[parts[1]].any()


def test_a_medium_without_coefficients_is_refused() -> None:
    scene = foggy_room()
    scene.world.medium = edgegrad.Medium()
    with pytest.raises(ValueError, match="world: all coefficients of its medium are 0"):
        edgegrad.plan(scene, ["world.medium.scattering"])


def test_a_fit_finds_the_density() -> None:
    scene = smoke_between()
    target = edgegrad.render(scene, spp=256, max_depth=3)
    path = "materials.smoke.medium.absorption"
    truth = parameters.get(scene, path)
    parameters.put(scene, path, 0.5 * truth)
    edgegrad.fit(scene, target, [path], iterations=60, spp=16, max_depth=3)
    np.testing.assert_allclose(parameters.get(scene, path), truth, rtol=0.1)


PATHS = ("materials.fog.medium.scattering", "materials.fog.medium.anisotropy", "materials.floor.base_color",
         "materials.glow.emission", "lights.lamp.power", "lights.lamp.position",
         "meshes.floor.vertices", "camera.to_world", "world.color")  # fmt: skip


@pytest.mark.parametrize("path", PATHS)
def test_modes_are_transposed(path: str) -> None:
    check_transpose(lambda _: foggy_room(), [path], spp=8, max_depth=5)


def test_equal_bits_for_any_number_of_threads() -> None:
    check_equal_bits(lambda _: foggy_room(), list(PATHS), spp=4, max_depth=4)


def test_the_plan_names_what_motions_lack() -> None:
    scene = foggy_room()
    by_colors = edgegrad.plan(scene, ["materials.floor.base_color", "lights.lamp.power"])
    assert "media scatter or absorb light" in str(by_colors) and "in media" not in str(by_colors)
    for path in ("meshes.floor.vertices", "lights.lamp.position", "camera.to_world"):
        assert "in media (fog)" in str(edgegrad.plan(scene, [path])), path
    scene.world.medium = scene.materials["fog"].medium
    scene.materials["fog"].medium = None
    assert "in media (the world's)" in str(edgegrad.plan(scene, ["meshes.floor.vertices"]))


def test_an_update_that_gives_the_parts_of_a_mixture_different_media_is_refused() -> None:
    scene = foggy_room()
    fog = scene.materials["fog"]
    scene.materials |= {"a": fog, "b": edgegrad.Material(np.ones(3), kind="TRANSPARENT", medium=fog.medium),
                        "fog": edgegrad.Mixture(("a", "b"), np.array([0.5, 0.5]))}  # fmt: skip
    renderer = edgegrad.Renderer(scene)
    path = "materials.b.medium.absorption"
    parameters.put(scene, path, np.ones(3))
    with pytest.raises(ValueError, match="material 'fog': its parts have different media"):
        renderer.update([path])
        renderer.render(spp=1)


@pytest.mark.parametrize("path", ["world.medium.absorption", "world.medium.scattering", "materials.lamp.emission"])
def test_values_beside_motions_in_fog(path: str) -> None:
    """Where the ball may move, faces seen edge-on are sampled by area: without light scattered before them."""
    scene = glossy_ball.scene("metal", 0.5, "area", "none")
    scene.materials["ball"] = edgegrad.Material(np.full(3, 0.7), kind="DIFFUSE")
    scene.world = edgegrad.World(np.zeros(3), medium=edgegrad.Medium((0.1,) * 3, (0.3,) * 3))
    options: dict[str, Any] = {"spp": 32, "max_depth": 3, "terms": ("interior",)}
    alone, beside = (
        np.array([edgegrad.Renderer(scene).render_forward({path: np.ones(3), **more}, seed=seed, **options).sum()
                  for seed in range(16)]) for more in ({}, {"meshes.ball.transform": np.zeros((4, 4))})
    )  # fmt: skip
    check(mean_p_value(beside - alone, 0.0, rounding=2e-3 * abs(alone.mean())))
    assert half_width(beside - alone) < 0.2 * abs(alone.mean())

"""Paths of many segments against closed forms: inter-reflection, transparency, mixtures, crops, instances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Bounces, Camera, Material, Mesh, Mixture, Renderer, Scene, World, expression
from edgegrad._check import RAYS
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.picture_differences import seed_of_picture
from tests.support.small_scenes import box, camera, matte, need, rectangle, white_world


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def furnace(albedo: float, emission: float = 1.0) -> Scene:
    """The inside of a glowing box: the radiance of paths of n segments is e (1 + rho + ... + rho^(n-1))."""
    shell = box((0, 0, 0), (1, 1, 1), "wall")
    material = replace(matte(albedo, albedo, albedo), emission=np.full(3, emission))
    return Scene(Camera(np.eye(4), width=16, height=16), {"shell": shell}, {"wall": material})


@pytest.mark.parametrize("depth", [1, 2, 3, 5, 9])
def test_radiance_in_a_furnace_is_the_geometric_series(depth: int) -> None:
    images = np.array([Renderer(furnace(0.5)).render(spp=16, max_depth=depth, seed=k) for k in range(16)])
    expected = sum(0.5**k for k in range(depth))
    check(mean_p_value(images.mean(axis=(1, 2, 3)), expected, rounding=1e-4))


def test_roulette_is_unbiased() -> None:
    # 200 segments at albedo 0.9: the series is summed to 1e-9, nearly all of it under roulette.
    images = np.array([Renderer(furnace(0.9)).render(spp=64, max_depth=200, seed=k) for k in range(24)])
    means = images.mean(axis=(1, 2, 3))
    check(mean_p_value(means, 10.0))
    assert half_width(means) < 0.5  # roulette that loses or gains a twentieth of the light is noticed


def test_a_bounce_limit_ends_paths_like_depth() -> None:
    r = Renderer(furnace(0.5))
    limited = r.render(spp=64, max_depth=20, bounces=Bounces(diffuse=2), seed=1)
    assert limited.mean() == pytest.approx(r.render(spp=64, max_depth=4, seed=1).mean(), rel=3e-3)


def test_bounce_limits_hold_for_derivatives() -> None:
    # e (1 + rho + rho^2), since a ray that is scattered once and meets a wall once more brings its light.
    r, options = Renderer(furnace(0.5)), {"spp": 16, "max_depth": 20, "bounces": Bounces(diffuse=1)}
    images = [r.render_forward({"materials.wall.base_color": np.ones(3)}, seed=k, **options) for k in range(16)]
    means = np.array(images).mean(axis=(1, 2, 3))
    check(mean_p_value(means, 1.0 + 2.0 * 0.5, rounding=1e-4))
    gradient = r.render_backward(np.ones((16, 16, 3)), ["materials.wall.base_color"], seed=0, **options)
    assert gradient["materials.wall.base_color"].sum() == pytest.approx(images[0].sum(), rel=1e-4)


def sheets(**top: object) -> Scene:
    """A see-through sheet before a glowing one, seen head-on."""
    return Scene(
        camera((0, 0, 3), (0, 0, 0), fov=0.3),
        {
            "front": rectangle((0, 0, 1), (2, 0, 0), (0, 2, 0), "front"),
            "back": rectangle((0, 0, -1), (4, 0, 0), (0, 4, 0), "back"),
        },
        {"front": Material(**top), "back": Material(np.zeros(3), np.full(3, 2.0))},  # type: ignore[arg-type]
    )


def test_alpha_blends_emission() -> None:
    scene = sheets(base_color=np.zeros(3), emission=np.array([1.0, 0.5, 0.0]), alpha=0.25)
    image = Renderer(scene).render(spp=1024, max_depth=1)
    expected = 0.25 * np.array([1.0, 0.5, 0.0]) + 0.75 * 2.0
    np.testing.assert_allclose(image.mean(axis=(0, 1)), expected, rtol=2e-3)


def test_a_transparent_shader_filters_and_is_no_segment() -> None:
    scene = sheets(base_color=np.array([0.9, 0.5, 0.1]), kind="TRANSPARENT")
    image = Renderer(scene).render(spp=16, max_depth=1)
    np.testing.assert_allclose(image.reshape(-1, 3), np.tile([1.8, 1.0, 0.2], (image.size // 3, 1)), rtol=1e-5)
    stopped = Renderer(scene).render(spp=16, max_depth=1, bounces=Bounces(transparent=0))
    assert not stopped.any()


def test_a_mixture_is_the_weighted_sum() -> None:
    scene = sheets(base_color=np.zeros(3))
    scene.materials = {
        "front": Mixture(("glow", "clear"), np.array([0.3, 0.7])),
        "back": scene.materials["back"],
        "glow": Material(np.zeros(3), np.array([1.0, 2.0, 3.0])),
        "clear": Material(np.array([0.5, 0.5, 1.0]), kind="TRANSPARENT"),
    }
    image = Renderer(scene).render(spp=2048, max_depth=1)
    expected = 0.3 * np.array([1.0, 2.0, 3.0]) + 0.7 * np.array([0.5, 0.5, 1.0]) * 2.0
    np.testing.assert_allclose(image.mean(axis=(0, 1)), expected, rtol=3e-3)


def test_a_mixture_of_one_part_has_its_weight() -> None:
    scene = sheets(base_color=np.zeros(3))
    scene.materials = {
        "front": Mixture(("glow",), np.array([0.3])),
        "back": scene.materials["back"],
        "glow": Material(np.zeros(3), np.array([1.0, 2.0, 3.0])),
    }
    renderer = Renderer(scene)
    assert renderer.render(spp=4, max_depth=1).mean(axis=(0, 1)) == pytest.approx([0.3, 0.6, 0.9], rel=1e-5)
    path = "materials.front.weights"
    change = renderer.render_forward({path: np.ones(1)}, spp=4, max_depth=1)
    assert change.mean(axis=(0, 1)) == pytest.approx([1.0, 2.0, 3.0], rel=1e-5)
    scene.materials["front"].textures = {"0": expression.Math("ADD", 0.2, 0.3)}
    assert Renderer(scene).render(spp=4, max_depth=1).mean(axis=(0, 1)) == pytest.approx([0.5, 1.0, 1.5], rel=1e-5)


@pytest.mark.parametrize("sky", [True, False])
def test_shadows_of_clear_sheets_multiply(sky: bool) -> None:
    """Light of a lamp, or of the sky, that must pass three sheets of different colours."""
    tints = [np.array([0.9, 0.5, 0.2]), np.array([0.8, 0.8, 0.8]), np.array([0.5, 1.0, 0.7])]
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor")
    lamp = {} if sky else {"sun": edgegrad.SunLight(np.array([0.0, 0.0, -1.0]), 2.0)}
    world = white_world() if sky else World()
    meshes, materials = {"floor": floor}, {"floor": matte(0.6, 0.6, 0.6)}
    for k, tint in enumerate(tints):
        # Boxes without a floor of their own would let the sky in from the side.
        meshes[f"sheet{k}"] = box((0, 0, 0.5), (2 + k, 2 + k, 1.5 + k), f"tint{k}")
        materials[f"tint{k}"] = Material(tint, kind="TRANSPARENT")
    scene = Scene(camera((0, 0.01, 1), (0, 0, 0), fov=0.5), meshes, materials, lamp, world)
    image = Renderer(scene).render(spp=64, max_depth=2)
    light = 1.0 if sky else 2.0 / np.pi
    np.testing.assert_allclose(image.mean(axis=(0, 1)), 0.6 * light * np.prod(tints, axis=0), rtol=1e-3)


def test_a_crop_is_a_part_of_the_picture() -> None:
    scene = furnace(0.5)
    scene.camera = Camera(np.eye(4), width=40, height=30)
    full = Renderer(scene).render(spp=3, max_depth=3)
    scene.camera.crop = (7, 4, 29, 23)
    part = Renderer(scene).render(spp=3, max_depth=3)
    # The same samples; rounding alone differs, as picture points are counted from the crop's corner.
    np.testing.assert_allclose(part, full[4:23, 7:29], rtol=1e-6)


def placed(count: int, mirrored: bool) -> Mesh:
    places = np.tile(np.eye(4), (count, 1, 1))
    for k in range(count):
        angle = 0.7 * k
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
        places[k, :3, :3] = turn * (0.6 + 0.1 * k) * (-1.0 if mirrored and k % 2 else 1.0)
        places[k, :3, 3] = 1.1 * (k - 1), 0.2 * k, 0.4
    ball = box((0, 0, 0), (0.6, 0.4, 0.5), "clay", 0.3)
    return replace(ball, smoothing=ball.faces, instances=places)


@pytest.mark.parametrize("mirrored", [False, True])
def test_instances_are_copies(mirrored: bool) -> None:
    from edgegrad.scene.placement import expanded

    mesh = placed(3, mirrored)
    images = []
    for each in (mesh, expanded(mesh)):
        scene = Scene(
            camera((0, -4, 3), (0, 0, 0)),
            {"ball": each, "floor": rectangle((0, 0, -0.3), (3, 0, 0), (0, 3, 0), "clay")},
            {"clay": matte(0.7, 0.6, 0.5)},
            {"lamp": edgegrad.PointLight(np.array([2.0, -3.0, 4.0]), 300.0)},
            white_world(),
        )
        images.append(Renderer(scene).render(spp=16, max_depth=4))
    # The same samples: only rounding differs, and rays within rounding of an edge.
    different = np.abs(images[0] - images[1]) > 1e-3 * np.abs(images[0]).max()
    assert different.mean() < 0.02
    assert images[0].mean() == pytest.approx(images[1].mean(), rel=2e-3)


def test_textured_emission_lights_as_it_looks() -> None:
    """A lamp whose emission is a mesh's attribute: a white wall far off sees its mean."""
    scene = sheets(base_color=np.full(3, 0.5))
    lamp = rectangle((0, 0, 2.9), (0.05, 0, 0), (0, -0.05, 0), "lamp")
    values = np.zeros((2, 3, 3), np.float32)
    values[0] = [3.0, 1.0, 2.0]
    scene.meshes = {"wall": rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0), "wall"), "lamp": replace(
        lamp, attributes={"glow": values}, visible_to=frozenset(("diffuse", "shadow")))}
    glow = Material(np.zeros(3), textures={"emission": expression.Attribute("glow")})
    scene.materials = {"wall": matte(0.5, 0.5, 0.5), "lamp": glow}
    textured = Renderer(scene).render(spp=256).mean(axis=(0, 1))
    scene.materials = {"wall": matte(0.5, 0.5, 0.5), "lamp": Material(np.zeros(3), np.array([1.5, 0.5, 1.0]))}
    constant = Renderer(scene).render(spp=256).mean(axis=(0, 1))
    np.testing.assert_allclose(textured, constant, rtol=1e-2)


def test_scenes_are_simplified_to_flat_diffuse_ones_in_words() -> None:
    scene = sheets(base_color=np.full(3, 0.5), alpha=0.5)
    scene.meshes["front"] = replace(scene.meshes["front"], smoothing=scene.meshes["front"].faces)
    shadow = edgegrad.plan(scene, ["meshes.front.vertices"]).terms[2]
    assert any("horizons of the faces of front" in words for words in shadow.why)
    simple, notes = edgegrad.differentiable(scene)
    assert len(notes) == 2
    shape = Renderer(simple).render(spp=1).shape
    gradient = Renderer(simple).render_backward(np.ones(shape), ["materials.back.emission"], spp=1)
    assert np.all(gradient["materials.back.emission"] >= 0.0)
    assert edgegrad.differentiable(simple)[1] == []


def test_pictures_are_the_same_bits_for_any_number_of_threads() -> None:
    scene = sheets(base_color=np.full(3, 0.6), specular_ior_level=0.5, roughness=0.3, alpha=0.7)
    scene.meshes["ball"] = placed(3, True)
    scene.materials["clay"] = Material(np.full(3, 0.9), kind="GLASS", roughness=0.1)
    scene.lights = {
        "spot": edgegrad.SpotLight(np.array([0.5, 0.5, 2.5]), np.array([0.0, 0.0, -1.0]), 200.0, radius=0.2),
        "sun": edgegrad.SunLight(np.array([0.3, 0.2, -1.0]), 2.0, angle=0.1),
    }
    images = [Renderer(scene, threads=n).render(spp=5, max_depth=7, seed=3) for n in (1, 2, 2, 3)]
    assert images[0].any()
    for image in images[1:]:
        np.testing.assert_array_equal(image, images[0])


@pytest.mark.parametrize("z", [2.0, 0.0])
def test_derivatives_see_a_lamp_once_before_and_behind_a_transparent_surface(z: float) -> None:
    """The picture is linear in the lamp's power: its derivative times the power is the picture."""
    scene = sheets(base_color=np.array([0.9, 0.5, 0.1]), kind="TRANSPARENT")
    scene.materials["back"] = Material(np.zeros(3))
    scene.lights = {"lamp": edgegrad.PointLight(np.array([0.0, 0.0, z]), 30.0, radius=0.1, visible_to=frozenset(RAYS))}
    renderer = Renderer(scene)
    image = renderer.render(spp=16, max_depth=1)
    assert image.any()
    change = renderer.render_forward({"lights.lamp.power": 30.0}, spp=16, max_depth=1, seed=seed_of_picture(0))
    np.testing.assert_allclose(change, image, rtol=1e-4, atol=1e-5)

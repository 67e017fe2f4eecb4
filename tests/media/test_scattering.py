"""Media that scatter light: closed forms of transmittance and single scattering, and energy over all bounces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import edgegrad
from tests.support import shapes
from tests.support.block_statistics import check, mean_p_value
from tests.support.small_scenes import box, camera, glowing, rectangle, white_world

COEFFICIENT = np.array([0.3, 0.8, 0.1])
NO_LIGHT = edgegrad.World(np.zeros(3))


def smoke(scattering: ArrayLike, absorption: ArrayLike = (0, 0, 0), anisotropy: float = 0.0) -> edgegrad.Material:
    """A material whose surface has no effect."""
    medium = edgegrad.Medium(tuple(np.broadcast_to(scattering, 3)), tuple(np.broadcast_to(absorption, 3)), anisotropy)
    return edgegrad.Material(np.ones(3), kind="TRANSPARENT", medium=medium)


def cloud(material: edgegrad.Material, **scene: Any) -> edgegrad.Scene:
    """A cube with sides of 2 m about the origin, which one pixel sees along z from a distance of 4 m."""
    meshes = {"cloud": box((0, 0, 0), (1, 1, 1), "smoke"), **scene.pop("meshes", {})}
    materials = {"smoke": material, **scene.pop("materials", {})}
    return edgegrad.Scene(scene.pop("camera", camera((0, 0, 4), size=2, fov=1e-3)), meshes, materials,
                          scene.pop("lights", {}), scene.pop("world", NO_LIGHT))  # fmt: skip


def pictures(scene: edgegrad.Scene, count: int = 16, **options: Any) -> NDArray[np.float64]:
    """(count, 3) means of pictures with independent seeds."""
    renderer = edgegrad.Renderer(scene)
    return np.array([renderer.render(seed=seed, **options).mean((0, 1)) for seed in range(count)], np.float64)


def phase(cosine: NDArray[np.float64] | float, g: float) -> Any:
    return (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)


def integral(values: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Over the middles of equal intervals."""
    return values.sum(0) * (at[1] - at[0])


MIDDLES = (np.arange(20000) + 0.5) / 10000  # of the way of 2 m through the cloud


def test_absorbing_media_keep_the_light_that_beers_law_says() -> None:
    scene = cloud(smoke(0.0, COEFFICIENT), meshes={"lamp": rectangle((0, 0, -2), (3, 0, 0), (0, 3, 0), "lamp")},
                  materials={"lamp": glowing(1.0, True)})  # fmt: skip
    np.testing.assert_allclose(pictures(scene, 1, spp=4)[0], np.exp(-2 * COEFFICIENT), rtol=1e-5)
    scene.meshes["lamp"] = rectangle((0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), "lamp")  # inside: half of the way
    np.testing.assert_allclose(pictures(scene, 1, spp=4)[0], np.exp(-COEFFICIENT), rtol=1e-5)
    scene.camera = camera((0, 0, 0.5), size=2, fov=1e-3)  # the camera is inside, too
    scene.camera.clip_start = 0.1  # as in Cycles, the medium before the near plane has no effect
    np.testing.assert_allclose(pictures(scene, 1, spp=4)[0], np.exp(-0.4 * COEFFICIENT), rtol=1e-5)


def test_shadow_rays_pass_media_from_inside_and_from_outside() -> None:
    """A floor inside of the cloud under a sun, and one below it."""
    for height, way in ((0.0, 1.0), (-2.0, 2.0)):
        scene = cloud(
            smoke(0.0, COEFFICIENT),
            meshes={"floor": rectangle((0, height, 0), (0.5, 0, 0), (0, 0, -0.5), "floor")},
            materials={"floor": edgegrad.Material(np.full(3, 0.5), kind="DIFFUSE")},
            lights={"sun": edgegrad.SunLight(np.array([0.0, -1.0, 0.0]), 2.0)},
            camera=camera((0, height + 0.5, 0.0), (0, height, 0), size=2, fov=1e-3, up=(0, 0, 1)),
        )
        way += 0.5 - scene.camera.clip_start if height == 0.0 else 0.0  # to the near plane
        np.testing.assert_allclose(pictures(scene, 1, spp=4)[0], np.exp(-COEFFICIENT * way) / np.pi, rtol=1e-4)


@pytest.mark.parametrize("g", [0.0, 0.6, -0.4])
def test_a_sun_is_scattered_once_as_the_integral_says(g: float) -> None:
    """It shines along x and z, so that the way to the sun is 1 m, or the depth in the cloud."""
    medium = smoke(COEFFICIENT, 0.2, g)
    extinction = COEFFICIENT + 0.2
    t = MIDDLES[:, None]
    for direction, way, cosine in ((np.array([1.0, 0, 0]), 1.0, 0.0), (np.array([0, 0, -1.0]), t, -1.0)):
        scene = cloud(medium, lights={"sun": edgegrad.SunLight(direction, 3.0)})
        exact = integral(COEFFICIENT * np.exp(-extinction * (t + way)) * 3.0 * phase(cosine, g), MIDDLES)
        check(mean_p_value(pictures(scene, spp=512, max_depth=2), exact, rounding=1e-4 * exact))


@pytest.mark.parametrize("size", [0.0, 0.05])
def test_lamps_inside_are_scattered_once_as_the_integral_says(size: float) -> None:
    """A point 0.1 m beside the ray, whose light would have an infinite variance without its own samples."""
    at = np.array([0.1, 0.0, 0.3])
    scene = cloud(smoke(COEFFICIENT, 0.2), lights={"lamp": edgegrad.PointLight(at, 10.0, radius=size)})
    t = MIDDLES[:, None]
    way = np.stack(np.broadcast_arrays(at[0], at[1], at[2] - (1 - t)), -1)
    distance = np.linalg.norm(way, axis=-1)
    kept = np.exp(-(COEFFICIENT + 0.2) * (t + distance))
    tangent2 = np.maximum(size / distance, 1e-3) ** 2
    # The lamp is a disk that faces the receiver: its solid angle divided by that of a distant one
    share = 2 * (1 - 1 / np.sqrt(1 + tangent2)) / tangent2
    exact = integral(COEFFICIENT * kept * share * 10.0 / (4 * np.pi) / distance**2 / (4 * np.pi), MIDDLES)
    found = pictures(scene, spp=512, max_depth=2)
    check(mean_p_value(found, exact, rounding=(0.01 if size else 1e-4) * exact))
    assert np.all(found.std(0) < 0.1 * exact)


@pytest.mark.parametrize("g", [0.0, 0.7])
@pytest.mark.parametrize("emitter", ["world", "mesh", "image"])
def test_white_media_look_like_the_light_around_them(g: float, emitter: str) -> None:
    """Light of one radiance from all sides stays as it is."""
    scene = cloud(smoke(1.5, 0.0, g), world=white_world())
    scene.camera = camera((0, 0, 4), size=2, fov=0.2)
    if emitter == "image":
        scene.images = {"sky": edgegrad.Image(np.ones((4, 8, 3), np.float32))}
        scene.world.image = "sky"
    if emitter == "mesh":
        scene.world = NO_LIGHT
        scene.meshes |= {"room": box((0, 0, 0), (5, 5, 5), "lamp")}
        scene.materials |= {"lamp": glowing(1.0, True)}
    check(mean_p_value(pictures(scene, spp=256, max_depth=200), 1.0, rounding=2e-3))


@pytest.mark.parametrize("lamp", ["sphere", "mesh"])
def test_thrown_light_is_absorbed_on_all_of_its_way(lamp: str) -> None:
    """A small ball of rough metal throws the light of a lamp on a floor that a plate hides from the lamp."""
    vertices, faces = shapes.ball(2)
    vertices = 0.1 * vertices / np.linalg.norm(vertices, axis=1).max() + [1.0, 0.3, 0.0]
    at = np.array([-3.0, 3.0, 0.0])
    scene = cloud(
        edgegrad.Material(np.full(3, 0.8), kind="GLOSSY", roughness=0.3),
        meshes={"cloud": edgegrad.Mesh(vertices, faces.astype(np.int32), ("smoke",)),
                "floor": rectangle((0, 0, 0), (0.2, 0, 0), (0, 0, -0.2), "floor"),
                "plate": rectangle((-1.2, 1.2, 0), (0, 0.4, 0), (0, 0, 0.4), "black")},
        materials={"floor": edgegrad.Material(np.full(3, 0.8), kind="DIFFUSE"),
                   "black": edgegrad.Material(np.zeros(3), kind="DIFFUSE"), "glow": glowing(30.0, True)},
        camera=camera((0, 3, 0), (0, 0, 0), size=1, fov=1e-4, up=(0, 0, 1)),
    )  # fmt: skip
    if lamp == "mesh":
        scene.meshes["lamp"] = rectangle(at, (0.1, 0.1, 0), (0, 0, 0.1), "glow")
    else:
        scene.lights = {"lamp": edgegrad.PointLight(at, 300.0, radius=0.1)}
    renderer = edgegrad.Renderer(scene)
    clear = renderer.render(spp=1 << 14, max_depth=3)[0, 0]
    scene.world = edgegrad.World(np.zeros(3), medium=edgegrad.Medium(absorption=(0.1, 0.1, 0.1)))
    way = np.linalg.norm(at - [1.0, 0.3, 0.0]) + np.hypot(1.0, 0.3) + 3.0 - scene.camera.clip_start
    kept = edgegrad.Renderer(scene).render(spp=1 << 14, max_depth=3)[0, 0] / clear
    assert kept == pytest.approx(np.exp(-0.1 * way), rel=0.03)  # the ball and the lamp have sizes of 0.2 m


def test_media_that_overlap_add_up() -> None:
    one = cloud(smoke(0.5, 0.2), lights={"lamp": edgegrad.PointLight(np.array([0.3, 1.5, 0.2]), 50.0)})
    two = cloud(smoke(0.25, 0.1), lights=one.lights,
                meshes={"other": box((0, 0, 0), (1.0001, 1.0001, 1.0001), "smoke")})  # fmt: skip
    found = [pictures(scene, spp=256, max_depth=5) for scene in (one, two)]
    check(mean_p_value(found[0] - found[1], 0.0, rounding=1e-3 * found[0].mean(0)))


def test_a_medium_of_the_world_has_no_end() -> None:
    scene = cloud(edgegrad.Material(np.zeros(3), kind="TRANSPARENT"), world=white_world())
    scene.world.medium = edgegrad.Medium((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    scene.camera = camera((0, 0, 4), size=2, fov=0.1)
    assert not edgegrad.Renderer(scene).render(spp=16).any()  # it hides the world
    scene.meshes = {"lamp": rectangle((0, 0, -2), (3, 0, 0), (0, 3, 0), "lamp")}
    scene.materials = {"lamp": glowing(1.0, True)}
    np.testing.assert_allclose(pictures(scene, 1, spp=4, max_depth=1)[0], np.exp(-0.6), rtol=2e-3)


def test_bounces_in_media_have_a_limit() -> None:
    """With no bounce behind the first one, longer paths bring nothing more."""
    scene = cloud(smoke(1.0), lights={"lamp": edgegrad.PointLight(np.array([0.3, 1.5, 0.2]), 50.0)})
    bounces = edgegrad.Bounces(medium=0)
    once = pictures(scene, spp=64, max_depth=2)
    np.testing.assert_array_equal(pictures(scene, spp=64, max_depth=8, bounces=bounces), once)
    assert np.all(pictures(scene, spp=64, max_depth=8).mean(0) > 1.1 * once.mean(0))


def test_wrong_media_are_refused() -> None:
    scene = cloud(smoke(1.0))
    scene.lights = {"lamp": edgegrad.PointLight(np.zeros(3), 50.0)}
    for field, value, says in (("scattering", (-1.0, 0, 0), "smoke.*medium.*scattering"),
                               ("anisotropy", 1.5, "smoke.*medium.*anisotropy"),
                               ("absorption", (np.nan, 0, 0), "smoke.*medium.*absorption")):  # fmt: skip
        scene.materials["smoke"].medium = edgegrad.Medium(**{field: value})
        with pytest.raises(ValueError, match=says):
            scene.validate()
    scene.materials["smoke"].medium = edgegrad.Medium()
    scene.materials["smoke"].absorption = np.ones(3)
    with pytest.raises(ValueError, match=r"smoke.*absorption into the medium"):
        scene.validate()

"""Caustics: light that surfaces receive by way of perfect mirrors and smooth glass. Its part of the picture is known,
and a plan says that its derivative is incomplete."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.one_shot import caustic_share
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import camera, glowing, matte, rectangle

MIRROR = edgegrad.Material(np.ones(3), kind="GLOSSY", roughness=0.0)
GLASS = edgegrad.Material(np.ones(3), kind="GLASS", roughness=0.0, ior=1.4)


def floor_by_a_mirror(mirror: edgegrad.Material, both_sides: bool = False) -> edgegrad.Scene:
    """A floor beside a standing mirror. A lamp between them shines on the mirror; on `both_sides`, on the floor too."""
    meshes = {
        "floor": rectangle((0, 0, 0), (0, 0, 0.5), (0.5, 0, 0), "clay"),
        "mirror": rectangle((1.0, 1.0, 0), (0, 1.0, 0), (0, 0, 1.0), "mirror"),
        "lamp": rectangle((0.7, 1.2, 0), (0, 0.2, 0), (0, 0, 0.2), "lamp"),
    }
    return edgegrad.Scene(
        camera((0, 3, 0.01), (0, 0, 0), 8, 0.2),
        meshes,
        {"clay": matte(), "mirror": mirror, "lamp": glowing(5.0, both_sides)},
    )


def parts(scene: edgegrad.Scene, spp: int = 64, max_depth: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """The picture and the part of it that is caustics."""
    renderer = edgegrad.Renderer(scene)
    return renderer.render(spp=spp, max_depth=max_depth), renderer.render_caustics(spp=spp, max_depth=max_depth)


def test_all_light_that_a_mirror_throws_is_caustics() -> None:
    """The lamp shines away from the floor: all light comes by the mirror, to the bit."""
    need_every_table()
    picture, caustics = parts(floor_by_a_mirror(MIRROR))
    assert picture.sum() > 0.0
    np.testing.assert_array_equal(picture, caustics)
    assert caustic_share(floor_by_a_mirror(MIRROR), spp=64, max_depth=4) == 1.0


@pytest.mark.parametrize("rough", [0.3, 1.0])
def test_rough_metal_throws_no_caustics(rough: float) -> None:
    need_every_table()
    scene = floor_by_a_mirror(edgegrad.Material(np.ones(3), kind="GLOSSY", roughness=rough))
    picture, caustics = parts(scene)
    assert picture.sum() > 0.0
    assert not caustics.any()
    assert caustic_share(scene, max_depth=4) == 0.0


def test_what_the_camera_sees_in_a_mirror_is_no_caustic() -> None:
    """The mirror lies before the camera, and shows a floor that is lit directly."""
    need_every_table()
    scene = edgegrad.Scene(
        camera((0, 2, 2), (0, 0, 0), 8, 0.3),
        {
            "mirror": rectangle((0, 0, 0), (0, 0, 1), (1, 0, 0), "mirror"),
            "wall": rectangle((0, 2, -3), (1, 0, 0), (0, 2, 0), "clay"),
        },
        {"mirror": MIRROR, "clay": matte()},
        {"sun": edgegrad.SunLight(np.array([0.0, -0.2, -1.0]), 3.0, angle=0.1)},
    )
    picture, caustics = parts(scene)
    assert picture.sum() > 0.0
    assert not caustics.any()


def test_caustics_and_the_rest_are_the_picture() -> None:
    """With a black mirror only direct light remains, and caustics are the difference."""
    need_every_table()
    both = floor_by_a_mirror(MIRROR, both_sides=True)
    picture, caustics = parts(both, spp=1024)
    black = floor_by_a_mirror(matte(0, 0, 0), both_sides=True)
    direct = edgegrad.render(black, spp=1024, max_depth=4)
    share = caustics.sum() / picture.sum()
    assert 0.02 < share < 0.9
    assert picture.sum() == pytest.approx(direct.sum() + caustics.sum(), rel=0.02)


def missing(scene: edgegrad.Scene, path: str, max_depth: int = 4, measure: int = 0) -> list[str]:
    plan = edgegrad.plan(scene, [path], max_depth=max_depth, measure=measure)
    return [sentence for sentence in plan.missing if sentence.startswith("caustics")]


def test_a_plan_says_how_much_of_the_picture_has_no_complete_derivative() -> None:
    need_every_table()
    scene = floor_by_a_mirror(MIRROR)
    (unmeasured,) = missing(scene, "meshes.mirror.vertices")
    assert "mirror" in unmeasured and "measure=" in unmeasured
    (measured,) = missing(scene, "meshes.mirror.vertices", measure=64)
    assert "they are 1 of the picture" in measured
    assert not missing(scene, "meshes.mirror.vertices", max_depth=2)  # the mirror's own ray, but no floor before it
    assert not missing(scene, "materials.clay.base_color")  # moves nothing
    assert not missing(floor_by_a_mirror(matte()), "meshes.mirror.vertices")


def test_a_plan_says_which_jumps_of_caustics_are_left_out() -> None:
    need_every_table()
    scene = floor_by_a_mirror(MIRROR)
    (some,) = missing(scene, "meshes.mirror.vertices")
    assert "themselves seen in mirrors" in some
    scene.meshes["lamp"].visible_to = frozenset({"camera", "diffuse", "shadow"})
    (all_of_them,) = missing(scene, "meshes.mirror.vertices")
    assert "can hit lamp and others cannot" in all_of_them
    scene = floor_by_a_mirror(MIRROR)
    scene.meshes["floor"].materials = ("mirror",)  # no surface is lit by the mirrors
    assert not missing(scene, "meshes.mirror.vertices")


def test_a_plan_names_the_caustics_of_glass_whose_index_is_asked_for() -> None:
    """No vertex and no light moves, but the light that the glass throws does."""
    need_every_table()
    assert missing(floor_by_a_mirror(GLASS), "materials.mirror.ior")


def noisy(scene: edgegrad.Scene, path: str, max_depth: int = 4) -> list[str]:
    plan = edgegrad.plan(scene, [path], max_depth=max_depth)
    return [why for term in plan.terms for why in term.why if why.startswith("noisy: light that narrow lobes")]


@pytest.mark.parametrize("field", ["roughness", "ior"])
def test_a_plan_names_the_noise_of_caustics_of_narrow_lobes_that_change_their_width_or_direction(field: str) -> None:
    """No vertex, light or camera moves, but what the lobes throw on the floor does: by an index of refraction or a
    roughness, samples of the derivative are many times larger than this light, as they are by a motion."""
    need_every_table()
    frosted = edgegrad.Material(np.ones(3), kind="GLASS", roughness=0.05, ior=1.4)
    assert noisy(floor_by_a_mirror(frosted), f"materials.mirror.{field}")
    assert not noisy(floor_by_a_mirror(frosted), f"materials.mirror.{field}", max_depth=2)
    assert not noisy(floor_by_a_mirror(frosted), "materials.mirror.base_color")
    wide = edgegrad.Material(np.ones(3), kind="GLASS", roughness=0.6, ior=1.4)
    assert not noisy(floor_by_a_mirror(wide), f"materials.mirror.{field}")


def test_a_plan_names_the_caustics_of_an_environment_that_turns() -> None:
    need_every_table()
    scene = floor_by_a_mirror(MIRROR)
    scene.images = {"sky": edgegrad.Image(np.random.default_rng(0).random((4, 8, 3), np.float32))}
    scene.world = edgegrad.World(np.ones(3), 1.0, "sky")
    assert missing(scene, "world.rotation")

"""Estimators of the outlines of distance fields, besides samples of the outlines: the warped picture, which is
unbiased, and relaxed boundaries, whose bias is bounded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import AreaLight, Field, PointLight, Renderer, Scene, World
from tests.support.fields.outlined import FIELDS, bent, doughnut, over_a_sheet, shifted
from tests.support.fields.splines import Floats, exact_sphere
from tests.support.picture_differences import (
    agreement,
    check_agreement,
    check_equal_bits,
    check_transpose,
    need_every_table,
)
from tests.support.small_scenes import camera, rectangle

WARP = "reparameterised"


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def alone(fields: Mapping[str, Field], **others: Any) -> Scene:
    """Fields before a sky of one colour, and nothing else."""
    return over_a_sheet(fields, **({"meshes": {}} | others))


@pytest.mark.parametrize("shape", ["sphere", "torus"])
def test_the_warp_of_one_field(shape: str) -> None:
    """Emitters alone: only the outline changes the picture."""
    scene = alone(FIELDS[shape]())
    check_agreement(lambda theta: bent(scene, theta, "values"), max_depth=1, eps=0.02, seeds=8, spp=128,
                    field_edges=WARP)


@pytest.mark.parametrize("what", ["values", "transform"])
def test_the_warp_before_textures_and_edges(what: str) -> None:
    """The warp moves rays over a textured sheet behind the field, and over the static edges of one before it."""
    scene = over_a_sheet(FIELDS["torus"]())
    check_agreement(lambda theta: bent(scene, theta, what), max_depth=1, eps=0.02, seeds=8, spp=128, field_edges=WARP)


@pytest.mark.parametrize("pixel_filter", ["BOX", "BLACKMAN_HARRIS"])
def test_single_pixels_of_the_warp(pixel_filter: str) -> None:
    """Weights that differ between pairs of pixels see what the warp moves across their borders."""
    seen_by = replace(camera((0.4, -0.5, 3.0), size=16), filter=pixel_filter,
                      filter_width=1.0 if pixel_filter == "BOX" else 1.5)
    renderer = Renderer(over_a_sheet(FIELDS["torus"](), camera=seen_by))
    weight = np.repeat(np.repeat(np.random.default_rng(2).normal(size=(8, 8, 3)), 2, axis=0), 2, axis=1)
    _, tangent = bent(renderer.scene, 0.0, "values")
    sums = {edges: np.array([np.sum(weight * renderer.render_forward(
        tangent, spp=256, seed=seed, max_depth=1, field_edges=edges)) for seed in range(12)])
        for edges in ("outlines", WARP)}
    mean = {edges: float(values.mean()) for edges, values in sums.items()}
    error = float(np.sqrt(sum(values.var(ddof=1) / len(values) for values in sums.values())))
    print(mean, error)
    assert error < 0.04 * abs(mean["outlines"])
    assert abs(mean["outlines"] - mean[WARP]) < 5.0 * error


def two_fields() -> Mapping[str, Field]:
    """A ball that hides a part of a torus."""
    return {"ball": replace(exact_sphere(0.5, 20), transform=np.array(
        [[1.0, 0, 0, 0.2], [0, 1.0, 0, -0.5], [0, 0, 1.0, 0.9], [0, 0, 0, 1.0]])), "ring": doughnut()}


@pytest.mark.parametrize("moving", ["ball", "ring"])
def test_the_warp_of_two_fields(moving: str) -> None:
    """Each field's outline crosses that of the other one."""
    scene = over_a_sheet(two_fields())
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = 0.5, -0.2, 0.4

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        field = scene.fields[moving]
        moved = replace(field, transform=field.transform + theta * tangent)
        return replace(scene, fields={**scene.fields, moving: moved}), {f"fields.{moving}.transform": tangent}

    check_agreement(at, max_depth=1, eps=0.02, seeds=8, spp=128, field_edges=WARP)


@pytest.mark.parametrize("light", ["sky", "point", "area"])
def test_shadows_of_the_warp(light: str) -> None:
    """Shadows of the field on itself and on the sheet behind: the warp carries rays over their borders."""
    dark, place = World(np.zeros(3)), np.eye(4)
    place[:3, 3] = 0.5, 1.2, 3.0
    lamp = PointLight(np.array([0.9, 1.6, 3.0]), power=150.0)
    lit: dict[str, Any] = {"sky": {}, "point": {"world": dark, "lights": {"lamp": lamp}},
                           "area": {"world": dark, "lights": {"lamp": AreaLight(place, power=100.0)}}}[light]
    sheet = rectangle((0.0, 0.0, -0.6), (3.0, 0.0, 0.0), (0.0, 3.0, 0.0), "clay")
    scene = alone(FIELDS["torus"](), meshes={} if light == "sky" else {"behind": sheet}, **lit)
    check_agreement(lambda theta: bent(scene, theta, "values"), max_depth=2, eps=0.02, seeds=8, spp=128,
                    field_edges=WARP)


@pytest.mark.parametrize("seen", ["parallel rays", "smooth filter", "lens"])
def test_cameras_of_the_warp(seen: str) -> None:
    """A lens sees a different outline from each of its points: only bands have derivatives of that."""
    seen_by = camera((0.4, -0.5, 3.0), size=16)
    if seen == "parallel rays":
        seen_by = replace(seen_by, kind="ORTHOGRAPHIC", ortho_width=2.2)
    elif seen == "lens":
        seen_by = replace(seen_by, aperture_radius=0.15, focus_distance=2.0)
    else:
        seen_by = replace(seen_by, filter="BLACKMAN_HARRIS", filter_width=2.0)
    scene = over_a_sheet(FIELDS["torus"](), camera=seen_by)
    check_agreement(lambda theta: bent(scene, theta, "values"), max_depth=1, eps=0.02, seeds=8, spp=128,
                    field_edges=WARP)


@pytest.mark.parametrize("what", ["values", "camera"])
def test_the_bias_of_relaxed_boundaries(what: str) -> None:
    """The bias is below a fifth of the derivative, where one that keeps one side of the band would have half."""
    scene = over_a_sheet(FIELDS["torus"]())
    found = agreement((lambda theta: bent(scene, theta, what)) if what == "values" else
                      (lambda theta: shifted(scene, theta)), max_depth=1, seeds=8, field_edges="relaxed")
    print(found)
    assert found.error < 0.2


@pytest.mark.parametrize("edges", [WARP, "relaxed"])
def test_both_modes(edges: str) -> None:
    scene = over_a_sheet({"ring": doughnut()}, lights={"lamp": PointLight(np.array([0.9, 1.6, 3.0]), power=50.0)})
    paths = ["fields.ring.values", "fields.ring.transform", "camera.to_world"]
    check_transpose(lambda _: scene, paths, spp=8, max_depth=3, field_edges=edges)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=3, field_edges=edges)


def test_wrong_names() -> None:
    scene = alone(FIELDS["sphere"]())
    with pytest.raises(ValueError, match="must be one of outlines, reparameterised, relaxed, but is 'warp'"):
        edgegrad.render_forward(scene, {"fields.ball.transform": np.zeros((4, 4))}, field_edges="warp")


def test_scenes_that_the_warp_does_not_cover() -> None:
    """A panorama's outlines are sampled, with the same bits."""
    seen_by = replace(camera((0.3, -0.2, 1.7), size=16), kind="EQUIRECTANGULAR", longitude=np.array([-0.6, 0.6]),
                      latitude=np.array([-0.6, 0.6]))
    renderer = Renderer(alone(FIELDS["torus"](), camera=seen_by))
    tangent = {"fields.ring.transform": np.eye(4)}
    sampled = renderer.render_forward(tangent, spp=4)
    for edges in (WARP, "relaxed"):
        np.testing.assert_array_equal(renderer.render_forward(tangent, spp=4, field_edges=edges), sampled)
        decided = {d.part: d.reason for d in renderer.last_decisions}
        assert decided["field outlines"] == "needed"
        assert decided["field bands"] == "outlines serve"


def test_the_plan_names_the_estimator() -> None:
    scene = over_a_sheet({"ring": doughnut()})
    said = str(edgegrad.plan(scene, ["fields.ring.values"], max_depth=1, field_edges=WARP))
    assert "the outlines of the distance fields ring, from bands about them" in said
    said = str(edgegrad.plan(scene, ["camera.to_world"], max_depth=1, field_edges=WARP))
    assert "the outlines of the distance fields ring are sampled, whatever field_edges" in said

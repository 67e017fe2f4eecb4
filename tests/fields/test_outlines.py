"""The outlines of distance fields that the camera sees: derivatives of pictures by what moves them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from edgegrad import PointLight, Renderer, Scene, World, plan
from tests.support.fields.outlined import FIELDS, SHIFT, bent, doughnut, over_a_sheet, shifted
from tests.support.fields.splines import Floats, exact_sphere
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.small_scenes import camera, matte


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


@pytest.mark.parametrize("shape", list(FIELDS))
def test_the_camera_moves(shape: str) -> None:
    """Emitters alone: the outline is nearly all that changes, before a sheet and behind the edges of another."""
    scene = over_a_sheet(FIELDS[shape]())
    check_agreement(lambda theta: shifted(scene, theta), max_depth=1, eps=0.02, seeds=8)


@pytest.mark.parametrize("what", ["values", "transform"])
@pytest.mark.parametrize("shape", ["sphere", "torus", "placed"])
def test_the_field_moves(shape: str, what: str) -> None:
    """Emitters alone, so that the outline is all that changes."""
    scene = over_a_sheet(FIELDS[shape]())
    check_agreement(lambda theta: bent(scene, theta, what), max_depth=1, eps=0.02, seeds=8)


@pytest.mark.parametrize("what", ["values", "transform"])
def test_shading_of_a_field_that_moves(what: str) -> None:
    """A lamp at the camera alone lights the field: no shadow is in view, but shading and outline change."""
    scene = over_a_sheet(FIELDS["sphere"](), world=World(np.zeros(3)), lights={
        "lamp": PointLight(np.array([0.4, -0.5, 3.0]), power=150.0)})
    del scene.meshes["before"]
    scene.meshes["behind"].visible_to = frozenset(["camera"])
    check_agreement(lambda theta: bent(scene, theta, what), max_depth=2, eps=0.02, seeds=8)


def test_both_modes_by_the_field() -> None:
    scene = over_a_sheet({"ring": doughnut()})
    paths = ["fields.ring.values", "fields.ring.transform", "camera.to_world"]
    check_transpose(lambda _: scene, paths, spp=8, max_depth=3)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=3)


def test_two_fields() -> None:
    """One field hides a part of the outline of the other."""
    fields = {"ball": replace(exact_sphere(0.5, 20), transform=np.array(
        [[1.0, 0, 0, 0.2], [0, 1.0, 0, -0.5], [0, 0, 1.0, 0.9], [0, 0, 0, 1.0]])), "ring": doughnut(material="red")}
    scene = over_a_sheet(fields)
    scene.materials["red"] = matte(0.9, 0.1, 0.1)
    check_agreement(lambda theta: shifted(scene, theta), max_depth=1, eps=0.02, seeds=8)


@pytest.mark.parametrize("kind", ["ORTHOGRAPHIC", "EQUIRECTANGULAR"])
def test_cameras(kind: str) -> None:
    """Parallel rays, whose camera turns, and a panorama from nearby."""
    seen_by = camera((0.4, -0.5, 3.0), size=16)
    if kind == "ORTHOGRAPHIC":
        seen_by = replace(seen_by, kind=kind, ortho_width=2.2)
    else:
        seen_by = replace(camera((0.3, -0.2, 1.7), size=16), kind=kind, longitude=np.array([-0.6, 0.6]),
                          latitude=np.array([-0.6, 0.6]))
    scene = over_a_sheet({"ring": doughnut()}, camera=seen_by)
    check_agreement(lambda theta: shifted(scene, theta), max_depth=1, eps=0.02, seeds=8)


@pytest.mark.parametrize("shape", ["sphere", "torus"])
def test_shading_at_the_outline(shape: str) -> None:
    """A light moves with the camera, which therefore sees no shadow. Nothing else lights the field."""
    scene = over_a_sheet(FIELDS[shape](), world=World(np.zeros(3)))
    del scene.meshes["before"]
    scene.meshes["behind"].visible_to = frozenset(["camera"])

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        moved, tangent = shifted(scene, theta)
        lamp = PointLight(moved.camera.to_world[:3, 3].copy(), power=150.0)
        return replace(moved, lights={"lamp": lamp}), {**tangent, "lights.lamp.position": np.array(SHIFT)}

    check_agreement(at, max_depth=2, eps=0.02, seeds=8)


def test_both_modes() -> None:
    scene = over_a_sheet({"ring": doughnut()})
    check_transpose(lambda _: scene, ["camera.to_world"], spp=8, max_depth=3)
    check_equal_bits(lambda _: scene, ["camera.to_world"], spp=4, max_depth=3)


def test_the_plan_names_what_is_computed() -> None:
    scene = over_a_sheet({"ring": doughnut()})
    assert "the outlines of the distance fields ring" in str(plan(scene, ["camera.to_world"], max_depth=1))
    assert not any("outlines" in said for said in plan(scene, ["camera.to_world"], max_depth=1).missing)
    scene.camera.aperture_radius = 0.1
    scene.camera.focus_distance = 3.0
    assert not plan(scene, ["camera.to_world"], max_depth=1).missing


def through_a_lens(kind: str, shape: str) -> Scene:
    """A field out of focus, in front of a sheet in focus."""
    seen_by = replace(camera((0.4, -0.5, 3.0), size=16), aperture_radius=0.12, focus_distance=4.2)
    if kind == "ORTHOGRAPHIC":
        seen_by = replace(seen_by, kind=kind, ortho_width=2.4)
    elif kind == "blades":
        seen_by = replace(seen_by, aperture_blades=3, aperture_rotation=0.4, aperture_ratio=1.5)
    return over_a_sheet(FIELDS[shape](), camera=seen_by)


@pytest.mark.parametrize(("kind", "shape"), [("round", "torus"), ("blades", "sphere"), ("ORTHOGRAPHIC", "torus")])
@pytest.mark.parametrize("what", ["camera", "values"])
def test_a_lens(kind: str, shape: str, what: str) -> None:
    """Each point of the lens sees another outline."""
    scene = through_a_lens(kind, shape)
    check_agreement(lambda theta: shifted(scene, theta) if what == "camera" else bent(scene, theta, what), max_depth=1,
                    eps=0.02, seeds=16)


def test_both_modes_through_a_lens() -> None:
    scene = through_a_lens("round", "torus")
    paths = ["fields.ring.values", "camera.to_world", "camera.aperture_radius"]
    check_transpose(lambda _: scene, paths, spp=8, max_depth=2)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=2)


def test_pixels_on_an_outline_have_more_samples() -> None:
    """Hits that graze a field have large derivatives: pixels that its outline passes have eight times the samples."""
    size, spp = 64, 4
    scene = Scene(camera(size=size), materials={"clay": matte(0.6, 0.4, 0.3)}, world=World(np.ones(3)),
                  fields={"ball": exact_sphere(0.7, 20)})

    def samples(wrt: str) -> float:
        renderer = Renderer(scene)
        renderer.render_backward(np.ones((size, size, 3)), [wrt], spp=spp, terms=("interior",))
        return float(next(d.samples for d in renderer.last_decisions if d.part == "shading"))

    assert samples("materials.clay.base_color") == size**2 * spp
    dense = (samples("fields.ball.values") / spp - size**2) / 7
    # A convex curve passes about as many pixels as the box around it has along its sides
    black = replace(scene, materials={"clay": matte(0.0, 0.0, 0.0)})
    covered = Renderer(black).render(spp=16)[..., 0] < 0.5
    box = 2 * int(covered.any(axis=0).sum() + covered.any(axis=1).sum())
    assert 0.8 * box < dense < 2.5 * box

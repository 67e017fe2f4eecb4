"""Horizons of smooth-shaded meshes, where their flat faces block light: for lights of every kind, the environment and
other surfaces, and for every motion, compared with central differences.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad.scene import parameters
from tests.support.block_statistics import check_noticed
from tests.support.picture_differences import agreement, check_agreement, check_transpose, need_every_table
from tests.support.rich_scene import pose
from tests.support.scenes.horizons import BODY, CASES, DEEP, SIDE, body, body_under
from tests.support.shapes import cube
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import along, camera, rectangle

QUICK = ("sphere: body moves", "rectangle: body moves", "ellipse: body moves", "mesh: body moves", "sky: body moves",
         "disk: light moves", "sun: light turns", "sky image: light turns", "disk: camera moves", "translucent",
         "instances")


@pytest.mark.parametrize("name", slow_but(CASES, QUICK))
def test_horizons_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]))


@pytest.mark.parametrize("name", ["rectangle: body moves", "sun: light turns"])
def test_a_body_that_hides_no_light_from_itself_has_no_other_shadow(name: str) -> None:
    """Without the term the same comparison fails."""
    need_every_table()
    make, paths = CASES[name]
    outcome = agreement(along(make, paths), terms=("interior", "primary", "indirect"))
    check_noticed(outcome)


def test_a_light_at_right_angles_to_a_face_leaves_derivatives_finite() -> None:
    """The face's plane does not meet it, at any distance; other samples of the same packet find light."""
    need_every_table()
    vertices, faces = cube()
    scene = body_under("sky")
    scene.meshes["body"] = edgegrad.Mesh(vertices, faces, ("clay",), smoothing=faces)
    scene.camera = camera((3.0, -2.5, 4.0), (0.0, 0.0, 0.0), size=24)
    above = edgegrad.AreaLight(pose(np.eye(3), -0.8, -0.3, 1.3), np.array([0.4, 40.0]), power=60.0, smooth=1e-3)
    scene.lights = {"above": above}
    for path in BODY:
        tangent = {path: np.ones(np.shape(parameters.get(scene, path)))}
        picture = edgegrad.Renderer(scene).render_forward(tangent, spp=16, max_depth=2, terms=("shadow",))
        assert np.isfinite(picture).all()


def test_the_plan_names_horizons() -> None:
    def words(scene: edgegrad.Scene, *wrt: str) -> str:
        return "; ".join(edgegrad.plan(scene, list(wrt), max_depth=2).terms[2].why)

    scene = body_under("rectangle")
    assert "besides edges: the horizons of the faces of body, where they cut off light of the lights lamp" in words(
        scene, *BODY)
    assert "the horizons of" not in words(scene, "camera.to_world")
    for light in ("sphere", "disk"):
        assert "body" in words(body_under(light), "camera.to_world"), "it turns with what it lights"
    scene.meshes["floor"] = rectangle((0, -2, 0), (0, 0, 1), (1, 0, 0), "clay")
    assert "skipped: horizons, since neither" in words(scene, "camera.to_world")
    scene.lights["lamp"] = edgegrad.PointLight(SIDE, 90.0)
    assert "skipped: horizons, since all lights are without size" in words(scene, *BODY)
    scene.meshes["body"] = replace(body(), smoothing=None)
    assert "skipped: horizons, since no mesh" in words(scene, *BODY)


@pytest.mark.parametrize(
    "name", ["wall moves", "seen by way of a wall", pytest.param("body before a wall", marks=pytest.mark.slow)])
def test_horizons_of_later_vertices_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*DEEP[name]), max_depth=3)


@pytest.mark.parametrize("name", ["disk: light moves", "disk: camera moves", "sphere: camera moves", "sun: light turns",
                                  "mesh: body moves", "sky image: light turns", "instances", "body before a wall"])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*{**CASES, **DEEP}[name], spp=32, terms=("shadow", "indirect"), max_depth=4)

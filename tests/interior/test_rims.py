"""Rims of lobes: directions beyond which they scatter no light, at which it jumps.

Rough diffuse lobes end at their shading normal's plane where they are seen from below it. Gloss with a bent normal ends
at the plane of the smooth normal for light of lamps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Material, Mesh, PointLight, Scene, World
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose
from tests.support.scenes.gloss import bumpy_gloss
from tests.support.scenes.gloss.bumpy_gloss import GLOSS, LAMP, LAYERS, SUN, bumpy
from tests.support.shapes import ball
from tests.support.small_scenes import Make, along, camera, moved, need

BALL = ["meshes.ball.vertices"]
ROUGH = Material(np.array([0.6, 0.5, 0.7]), kind="DIFFUSE", roughness=0.0, diffuse_roughness=0.9)
LAYERED = Material(np.array([0.6, 0.5, 0.7]), kind="PRINCIPLED", roughness=0.6, diffuse_roughness=0.9)


def coarse(material: Material) -> Scene:
    """A ball of few faces, whose smooth normals face away from the camera at many places, beside a large light."""
    vertices, faces = ball(1, 0.5)
    made = Mesh(vertices, faces, ("ball",), smoothing=faces)
    scene = Scene(camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), 16, 0.4), {"ball": made}, {"ball": material})
    scene.lights = {"lamp": PointLight(np.array([0.8, 1.2, 2.2]), 400.0, 1.0, True)}
    return scene


def under_small_lamp(material: Material) -> Scene:
    scene = coarse(material)
    scene.lights = {"lamp": PointLight(np.array([0.8, 1.0, 1.2]), 40.0, 0.12, True)}
    return scene


def under_sky(material: Material) -> Scene:
    scene = coarse(material)
    scene.lights, scene.world = {}, World(np.ones(3))
    return scene


def moves(make: Callable[[Material], Scene], material: Material) -> Make:
    return lambda theta: moved(make(material), theta, "ball", (0.4, 0.3, 0.2))


CASES = {"diffuse": moves(coarse, ROUGH), "principled": moves(coarse, LAYERED), "sky": moves(under_sky, ROUGH),
         "small lamp": moves(under_small_lamp, ROUGH)}


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_differences(case: str) -> None:
    need("native")
    check_agreement(along(CASES[case], BALL), max_depth=2, spp=128)


@pytest.mark.parametrize("case", CASES)
def test_modes_are_transposes(case: str) -> None:
    need("native")
    check_transpose(CASES[case], BALL, spp=16, max_depth=2, terms=("interior",))


def test_bits_are_equal() -> None:
    need("native")
    check_equal_bits(CASES["principled"], BALL, spp=8, max_depth=3)


@pytest.mark.parametrize("case", bumpy_gloss.CASES)
def test_lit_gloss_ends_at_the_smooth_surface(case: str) -> None:
    need("native")
    check_agreement(along(*bumpy_gloss.CASES[case]), max_depth=2)


def test_modes_are_transposes_for_lit_gloss() -> None:
    need("native")
    check_transpose(lambda theta: bumpy(LAYERS, lamp=LAMP, sun=SUN),
                    ["camera.to_world", "images.map.pixels", "lights.lamp.position"], spp=16, max_depth=3,
                    terms=("interior",))


def test_the_plan_tells_of_lit_gloss() -> None:
    need("native")
    told = "the directions beyond which lobes of ball scatter no light"
    assert told in str(edgegrad.plan(bumpy(GLOSS, lamp=LAMP), ["camera.to_world"]))
    assert told not in str(edgegrad.plan(bumpy(GLOSS, lamp=LAMP), ["materials.ball.roughness"]))
    sharp = str(edgegrad.plan(bumpy(GLOSS, lamp=PointLight(LAMP.position, 300.0)), ["camera.to_world"]))
    assert told not in sharp and "lines on ball beyond which their lobes scatter no light of lights without" in sharp
    smooth = bumpy(replace(GLOSS, kind="VELVET"), lamp=LAMP)
    assert "normals of ball begin to point away from the viewer" in str(edgegrad.plan(smooth, ["camera.to_world"]))


def test_the_plan_tells_of_normals_below_their_faces() -> None:
    need("native")
    scene, told = coarse(GLOSS), "the borders where normals of ball begin to point away from the viewer"
    assert told not in str(edgegrad.plan(scene, BALL, max_depth=2))
    scene.meshes["ball"].normals = -scene.meshes["ball"].vertices
    assert told in str(edgegrad.plan(scene, BALL, max_depth=2))


def test_the_plan_tells_of_it() -> None:
    need("native")
    said = "the directions beyond which lobes of ball scatter no light"
    assert said in str(edgegrad.plan(coarse(ROUGH), BALL, max_depth=2))
    smooth = Material(np.array([0.6, 0.5, 0.7]), kind="DIFFUSE")
    assert said not in str(edgegrad.plan(coarse(smooth), BALL, max_depth=2))

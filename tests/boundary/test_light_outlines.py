"""Outlines of lights of every shape, seen by cameras of every kind, compared with central differences."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

import edgegrad
from edgegrad._check import RAYS
from edgegrad.planning.scene_plan import plan
from tests.support.block_statistics import check_noticed
from tests.support.motions import camera_moves, lamp_changes
from tests.support.picture_differences import agreement, check_agreement, check_transpose, need_every_table
from tests.support.scenes.seen_lights import LIGHTS, PAIRS, VIEW, VIEWS
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along, matte, rectangle


def scene_with(light: str, view: str) -> edgegrad.Scene:
    """A light behind a black card that hides a corner of it."""
    card = rectangle((-0.3, 0.6, 0.9), (0.4, 0.05, 0), (0, 0.4, 0.1), "black")
    if light == "wide disk":  # farther than its centre, but not than where parallel rays meet it
        card = rectangle((-0.63, 0.1, 1.2), (0.16, 0, 0), (0, 0.5, 0), "black")
    return edgegrad.Scene(
        deepcopy(VIEWS[view]), {"card": card},
        {"black": matte(0.0, 0.0, 0.0)}, {"lamp": replace(LIGHTS[light], visible_to=frozenset(RAYS))},
    )


def light_changes(light: str, view: str, field: str, rate: ArrayLike) -> tuple[Make, list[str]]:
    return lamp_changes(lambda: scene_with(light, view), field, rate)


def view_moves(light: str, view: str) -> tuple[Make, list[str]]:
    turns = np.array([0.2, 0.3, 0.4]) * (VIEWS[view].fov_x / VIEW.fov_x)
    return camera_moves(lambda: scene_with(light, view), turns), ["camera.to_world"]


def moves(light: str, view: str) -> tuple[Make, list[str]]:
    if isinstance(LIGHTS[light], edgegrad.AreaLight):
        return light_changes(light, view, "to_world", np.array([0.4, 0.3, -0.2]))
    if light == "small sun":
        return light_changes(light, view, "direction", np.array([0.004, -0.002, 0.006]))
    field = "direction" if light == "sun" else "position"
    return light_changes(light, view, field, np.array([1.0, -0.4, 0.3]))


def decays(make: Make, paths: list[str]) -> tuple[Make, list[str]]:
    def made(theta: float) -> edgegrad.Scene:
        scene = make(theta)
        scene.lights = {name: replace(light, decay="LINEAR", smooth=0.5) for name, light in scene.lights.items()}
        return scene

    return made, paths


CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}, {view}: light moves": moves(light, view) for light, view in PAIRS},
    **{f"{light}, {view}: camera moves": view_moves(light, view) for light, view in PAIRS},
    "sphere: light grows": light_changes("sphere", "perspective", "radius", 0.6),
    "rectangle of linear decay: light moves": decays(*moves("rectangle", "perspective")),
    "disk: light grows": light_changes("disk", "perspective", "radius", 0.6),
    "disk, orthographic: light grows": light_changes("disk", "orthographic", "radius", 0.6),
    "rectangle: light grows": light_changes("rectangle", "perspective", "size", np.array([0.7, -0.3])),
    "wide disk, high: light grows": light_changes("wide disk", "high", "radius", 0.6),
    "small sun: light grows": light_changes("small sun", "telescope", "angle", 0.002),
    "sun: light grows": light_changes("sun", "perspective", "angle", 0.5),
    "sun, panorama: light grows": light_changes("sun", "panorama", "angle", 0.5),
}
QUICK = ("sphere, perspective: light moves", "disk, lens: camera moves", "spot, panorama: light moves",
         "rectangle, orthographic: light moves", "ellipse, wide filter: camera moves",
         "sphere, orthographic: camera moves", "rectangle: light grows", "disk, orthographic: camera moves",
         "spot, orthographic: light moves", "disk, orthographic: light grows", "sun, perspective: light moves",
         "sun, lens: camera moves", "sun, panorama: camera moves", "sun: light grows",
         "wide disk, high: camera moves", "wide disk, high: light moves", "small sun, telescope: camera moves",
         "small sun: light grows")


@pytest.mark.parametrize("name", slow_but(CASES, QUICK))
def test_outlines_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]))


def test_the_plan_names_outlines_that_are_computed_and_those_that_are_not() -> None:
    def words(light: str, view: edgegrad.Camera, path: str) -> tuple[str, str]:
        scene = scene_with(light, "perspective")
        scene.camera = view
        made = plan(scene, [path])
        primary = next(term for term in made.terms if term.name == "primary")
        return " ".join(primary.why), " ".join(made.missing)

    computed = "besides edges: the outlines of lamp"
    for path in ("lights.lamp.direction", "lights.lamp.angle", "camera.to_world"):
        for view in ("perspective", "lens", "panorama"):
            why, missing = words("sun", VIEWS[view], path)
            assert computed in why and "outlines" not in missing
        why, missing = words("sun", VIEWS["orthographic"], path)
        assert "outlines" not in why + missing, "parallel rays see all of a sun, or nothing"
    why, missing = words("sun", VIEWS["perspective"], "lights.lamp.strength")
    assert "outlines" not in why + missing
    why, missing = words("disk", VIEWS["orthographic"], "lights.lamp.position")
    assert computed in why and "outlines" not in missing
    blurred = replace(VIEWS["orthographic"], aperture_radius=0.1)
    for light in ("disk", "sun"):
        why, missing = words(light, blurred, "camera.to_world")
        assert computed not in why and "the outlines of lamp, suns or disks that an orthographic" in missing
    assert computed in words("sphere", blurred, "camera.to_world")[0]


def test_without_the_term_the_comparison_fails() -> None:
    need_every_table()
    outcome = agreement(along(*CASES["sphere, perspective: light moves"]), terms=("interior", "shadow"))
    check_noticed(outcome)


def test_a_sun_does_not_move_with_the_camera() -> None:
    """A camera that moves without turning sees it where it was."""
    need_every_table()
    scene = scene_with("sun", "lens")
    scene.meshes["card"].vertices += [0.0, 0.0, 9.0]  # behind the camera
    renderer = edgegrad.Renderer(scene)
    turned, moved = np.zeros((2, 4, 4))
    turned[:3, :3] = np.array([[0, 1, 0], [-1, 0, 2], [0, -2, 0]]) @ scene.camera.to_world[:3, :3]
    moved[:3, 3] = [0.3, -0.2, 0.4]
    turns, stays = (renderer.render_forward({"camera.to_world": tangent}, spp=16, terms=("primary",))
                    for tangent in (turned, moved))
    assert np.abs(stays).max() < 1e-5 * np.abs(turns).max()


@pytest.mark.parametrize("name", ["disk, lens: camera moves", "rectangle, panorama: light moves",
                                  "sphere, orthographic: camera moves", "disk: light grows",
                                  "disk, orthographic: camera moves", "sun, lens: camera moves",
                                  "sun, panorama: light moves", "sun: light grows"])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*CASES[name], spp=16, terms=("primary",))

"""The outlines of lights that the camera sees, against central differences: of every shape, by every camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad._check import RAYS
from tests.block_statistics import ALARM
from tests.picture_differences import agreement, check_agreement, check_transpose, need_every_table
from tests.rich_scene import pose, turn
from tests.slow_cases import slow_but
from tests.small_scenes import Floats, Make, along, camera, matte, rectangle

PLACE = np.array([0.2, 0.1, 0.3])
FACING = pose(turn(0.3, 0.4, 0.2) @ np.diag([1.0, -1.0, -1.0]), *PLACE.tolist())  # shines along -Z: at the camera
LIGHTS: dict[str, edgegrad.PointLight | edgegrad.SpotLight | edgegrad.AreaLight] = {
    "sphere": edgegrad.PointLight(PLACE, 60.0, 0.5, True),
    "disk": edgegrad.PointLight(PLACE, 60.0, 0.5, False),
    "spot": edgegrad.SpotLight(PLACE, np.array([-0.1, 0.2, 1.0]), 60.0, 1.2, 0.8, 0.5),
    "rectangle": edgegrad.AreaLight(FACING, np.array([0.9, 0.6]), "RECTANGLE", 30.0),
    "ellipse": edgegrad.AreaLight(FACING, np.array([0.9, 0.6]), "ELLIPSE", 30.0),
}
VIEW = camera((0.2, 0.3, 2.5), (0, 0, 0), 24, 0.9)
VIEWS = {
    "perspective": VIEW,
    "lens": replace(VIEW, aperture_radius=0.1, focus_distance=2.0),
    "orthographic": replace(VIEW, kind="ORTHOGRAPHIC", ortho_width=2.2),
    "panorama": replace(VIEW, kind="EQUIRECTANGULAR", width=48),
    "wide filter": replace(VIEW, filter="BLACKMAN_HARRIS", filter_width=3.0),
}


def scene_with(light: str, view: str) -> edgegrad.Scene:
    """A light behind a black card that hides a corner of it."""
    return edgegrad.Scene(
        VIEWS[view], {"card": rectangle((-0.3, 0.6, 0.9), (0.4, 0.05, 0), (0, 0.4, 0.1), "black")},
        {"black": matte(0.0, 0.0, 0.0)}, {"lamp": replace(LIGHTS[light], visible_to=frozenset(RAYS))},
    )


def light_changes(light: str, view: str, field: str, rate: float | Floats) -> tuple[Make, list[str]]:
    def make(theta: float) -> edgegrad.Scene:
        scene = scene_with(light, view)
        lamp = scene.lights["lamp"]
        if field == "to_world":
            value = np.array(lamp.to_world)
            value[:3, :3] = turn(*(theta * np.asarray(rate))) @ value[:3, :3]
            value[:3, 3] += theta * np.array([0.6, -0.4, 0.3])
        else:
            value = getattr(lamp, field) + theta * np.asarray(rate)
        scene.lights["lamp"] = replace(lamp, **{field: float(value) if np.ndim(value) == 0 else value})
        return scene

    return make, [f"lights.lamp.{field}"]


def camera_moves(light: str, view: str) -> tuple[Make, list[str]]:
    def make(theta: float) -> edgegrad.Scene:
        scene = scene_with(light, view)
        to_world = np.array(scene.camera.to_world)
        to_world[:3, :3] = turn(0.2 * theta, 0.3 * theta, 0.4 * theta) @ to_world[:3, :3]
        to_world[:3, 3] += theta * np.array([0.5, -0.3, 0.4])
        scene.camera = replace(scene.camera, to_world=to_world)
        return scene

    return make, ["camera.to_world"]


def moves(light: str, view: str) -> tuple[Make, list[str]]:
    if isinstance(LIGHTS[light], edgegrad.AreaLight):
        return light_changes(light, view, "to_world", np.array([0.4, 0.3, -0.2]))
    return light_changes(light, view, "position", np.array([1.0, -0.4, 0.3]))


# A disk has another side for each of parallel rays: `plan` names it.
PAIRS = [(light, view) for light in LIGHTS for view in VIEWS
         if not (view == "orthographic" and light in ("disk", "spot"))]
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}, {view}: light moves": moves(light, view) for light, view in PAIRS},
    **{f"{light}, {view}: camera moves": camera_moves(light, view) for light, view in PAIRS},
    "sphere: light grows": light_changes("sphere", "perspective", "radius", 0.6),
    "disk: light grows": light_changes("disk", "perspective", "radius", 0.6),
    "rectangle: light grows": light_changes("rectangle", "perspective", "size", np.array([0.7, -0.3])),
}
QUICK = ("sphere, perspective: light moves", "disk, lens: camera moves", "spot, panorama: light moves",
         "rectangle, orthographic: light moves", "ellipse, wide filter: camera moves",
         "sphere, orthographic: camera moves", "rectangle: light grows")


@pytest.mark.parametrize("name", slow_but(CASES, QUICK))
def test_outlines_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]))


def test_without_the_term_the_comparison_fails() -> None:
    need_every_table()
    outcome = agreement(along(*CASES["sphere, perspective: light moves"]), terms=("interior", "shadow"))
    assert outcome.p_value < ALARM, str(outcome)


@pytest.mark.parametrize("name", ["disk, lens: camera moves", "rectangle, panorama: light moves",
                                  "sphere, orthographic: camera moves", "disk: light grows"])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*CASES[name], spp=16, terms=("primary",))

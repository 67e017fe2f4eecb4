"""Lights of every shape that the camera sees and that meshes intersect, compared with central differences."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike

import edgegrad
from tests.support.motions import camera_moves, lamp_changes
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.scenes.seen_lights import LIGHTS, PIERCED, VIEWS, sheet_through
from tests.support.scenes.seen_lights import PAIRS as ALL_PAIRS
from tests.support.scenes.sheets_through_lights import moves
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along

SHEET = ["meshes.sheet.vertices"]
# Excludes disks seen by parallel rays.
PAIRS = [(light, view) for light, view in ALL_PAIRS
         if light in PIERCED and (getattr(LIGHTS[light], "sphere", True) or VIEWS[view].kind != "ORTHOGRAPHIC")]


def sheet_moves(light: str, view: str, alpha: float = 1.0) -> tuple[Make, list[str]]:
    return moves(lambda: sheet_through(light, view, alpha), "sheet", (0.6, 0.2, 0.3)), SHEET


def light_changes(light: str, view: str, field: str, rate: ArrayLike) -> tuple[Make, list[str]]:
    return lamp_changes(lambda: sheet_through(light, view), field, rate)


def light_moves(light: str, view: str) -> tuple[Make, list[str]]:
    if isinstance(LIGHTS[light], edgegrad.AreaLight):
        return light_changes(light, view, "to_world", np.array([0.4, 0.3, -0.2]))
    return light_changes(light, view, "position", np.array([1.0, -0.4, 0.3]))


def view_moves(light: str, view: str) -> tuple[Make, list[str]]:
    return camera_moves(lambda: sheet_through(light, view), (0.2, 0.3, 0.4)), ["camera.to_world"]


CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}, {view}: sheet moves": sheet_moves(light, view) for light, view in PAIRS},
    **{f"{light}, {view}: light moves": light_moves(light, view) for light, view in PAIRS},
    **{f"{light}, {view}: camera moves": view_moves(light, view) for light, view in PAIRS},
    **{f"{light}, veil moves": sheet_moves(light, "perspective", 0.6) for light in PIERCED},
    "sphere: light grows": light_changes("sphere", "perspective", "radius", 0.6),
    "disk: light grows": light_changes("disk", "perspective", "radius", 0.6),
    "rectangle: light grows": light_changes("rectangle", "perspective", "size", np.array([0.7, -0.3])),
}
QUICK = ("rectangle, perspective: sheet moves", "ellipse, lens: sheet moves", "rectangle, wide filter: camera moves",
         "sphere, perspective: camera moves", "sphere, orthographic: light moves", "disk, perspective: sheet moves",
         "disk, lens: camera moves", "spot, panorama: light moves", "rectangle, orthographic: sheet moves",
         "sphere, veil moves", "rectangle, veil moves", "disk: light grows")


@pytest.mark.parametrize("name", slow_but(CASES, QUICK))
def test_intersected_outlines_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]), spp=256, reference_spp=2048)


@pytest.mark.parametrize("name", QUICK)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*CASES[name], spp=16, terms=("primary",))


@pytest.mark.parametrize("light", PIERCED)
def test_plan_names_what_is_computed(light: str) -> None:
    need_every_table()
    words = "besides edges: the lines where sheet pass through the light 'lamp'"
    for path in (*SHEET, "camera.to_world", light_moves(light, "perspective")[1][0]):
        scene = sheet_through(light, "perspective")
        primary = {term.name: term for term in edgegrad.plan(scene, [path]).terms}["primary"]
        assert primary.computed and words in primary.why
        scene.lights["lamp"] = LIGHTS[light]  # which the camera doesn't see
        primary = {term.name: term for term in edgegrad.plan(scene, [path]).terms}["primary"]
        assert words not in primary.why


def test_plan_names_disks_that_face_parallel_rays() -> None:
    need_every_table()
    scene = sheet_through("disk", "orthographic")
    assert any("where sheet pass through it: a disk that faces parallel rays" in words
               for words in edgegrad.plan(scene, SHEET).missing)

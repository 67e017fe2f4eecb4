"""Occlusion of spheres, and of disks that face the shaded point, by surfaces that intersect them, compared with
central differences.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

import edgegrad
from tests.support.motions import camera_moves, lamp_changes
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.scenes.sheets_through_lights import moves
from tests.support.scenes.sheets_through_round_lights import LAMPS, sheet_through, veiled
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along, matte, rectangle


def ending_inside(lamp: str) -> edgegrad.Scene:
    """A sheet that ends inside of the lamp: seen from outside of a sphere, that edge hides nothing."""
    scene = sheet_through(lamp)
    scene.meshes["sheet"].vertices[1:3] -= (0.28, 0.95, 0.1)
    return scene


def low(lamp: str) -> edgegrad.Scene:
    """A lamp so near to the floor that it turns much where the floor moves."""
    scene = sheet_through(lamp)
    scene.lights["lamp"] = replace(LAMPS[lamp], position=np.array([0.0, 0.7, 0.0]), radius=0.6)
    scene.meshes["sheet"].vertices = rectangle((0.05, 0.8, 0.0), (0.1, 0.45, 0.05), (0.0, 0.0, 2.5), "black").vertices
    return scene


def lit_from_all_around() -> edgegrad.Scene:
    """The visible part of the scene lies inside of a sphere light. The sheet extends out of the sphere."""
    scene = sheet_through("sphere")
    scene.lights["lamp"] = replace(LAMPS["sphere"], radius=2.0)
    return scene


def seen_by_a_wall(lamp: str) -> edgegrad.Scene:
    """The lamp shines on a wall alone, which lights the floor."""
    scene = sheet_through(lamp)
    scene.meshes["wall"] = rectangle((-1.2, 0.6, 0.0), (0.0, 0.6, 0.0), (0.0, 0.1, 1.2), "wall")
    scene.materials["wall"] = matte(0.8, 0.8, 0.8)
    scene.lights["lamp"] = replace(LAMPS[lamp], receivers=("wall",))
    return scene


def number_changes(lamp: str, field: str, rate: ArrayLike) -> tuple[Make, list[str]]:
    return lamp_changes(lambda: sheet_through(lamp), field, rate)


def view_moves(make_scene: Callable[[], edgegrad.Scene]) -> tuple[Make, list[str]]:
    return camera_moves(make_scene, (0.2, 0.3, 0.4)), ["camera.to_world"]


def lamp_moves(lamp: str) -> tuple[Make, list[str]]:
    return number_changes(lamp, "position", np.array([0.6, -0.4, 0.3]))


SHEET, FLOOR, WALL = ["meshes.sheet.vertices"], ["meshes.floor.vertices"], ["meshes.wall.vertices"]
RATE = (1.0, 0.2, 0.3)
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{lamp}: sheet moves": (moves(lambda lamp=lamp: sheet_through(lamp), "sheet", RATE), SHEET) for lamp in LAMPS},
    **{f"{lamp}: lamp moves": lamp_moves(lamp) for lamp in LAMPS},
    **{f"{lamp}: lamp grows": number_changes(lamp, "radius", 0.5) for lamp in LAMPS},
    "sphere: floor moves": (moves(lambda: sheet_through("sphere"), "floor", (0.6, 0.8, 0.3)), FLOOR),
    "sphere: camera moves": view_moves(lambda: sheet_through("sphere")),
    **{f"low {lamp}: floor moves": (moves(lambda lamp=lamp: low(lamp), "floor", (2.0, 0.8, 0.3)), FLOOR)
       for lamp in ("sphere", "disk")},
    **{f"low {lamp}: camera moves": view_moves(lambda lamp=lamp: low(lamp)) for lamp in ("sphere", "disk")},
    **{f"{lamp}: sheet that ends inside moves": (moves(lambda lamp=lamp: ending_inside(lamp), "sheet", RATE), SHEET)
       for lamp in ("sphere", "disk")},
    "inside of a sphere: sheet moves": (moves(lit_from_all_around, "sheet", RATE), SHEET),
    **{f"{lamp}: veil moves": (moves(lambda lamp=lamp: veiled(lamp), "sheet", RATE), SHEET)
       for lamp in ("sphere", "disk")},
}
DEEP: dict[str, tuple[Make, list[str]]] = {
    **{f"{lamp}, seen by a wall: sheet moves": (moves(lambda lamp=lamp: seen_by_a_wall(lamp), "sheet", RATE), SHEET)
       for lamp in ("sphere", "disk")},
    **{f"{lamp}, seen by a wall: wall moves": (moves(lambda lamp=lamp: seen_by_a_wall(lamp), "wall", RATE), WALL)
       for lamp in ("sphere", "disk")},
}
QUICK = ("sphere: sheet moves", "sphere: lamp moves", "sphere: lamp grows", "disk: sheet moves", "disk: lamp moves",
         "low sphere: floor moves", "low sphere: camera moves", "low disk: floor moves", "low disk: camera moves",
         "sphere spot: sheet moves", "disk spot: lamp grows", "sphere: veil moves", "disk: veil moves",
         "sphere: sheet that ends inside moves", "inside of a sphere: sheet moves")


@pytest.mark.parametrize("name", slow_but(CASES, QUICK))
def test_intersected_round_lights_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]), spp=128)


@pytest.mark.parametrize("name", DEEP)
def test_those_seen_by_way_of_surfaces_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*DEEP[name]), spp=128, max_depth=3)


@pytest.mark.parametrize("name", [*QUICK, *(name for name in DEEP if "sheet moves" in name)])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*{**CASES, **DEEP}[name], spp=16, terms=("shadow",), max_depth=4)


@pytest.mark.parametrize("lamp", ["sphere", "disk"])
def test_the_bits_are_the_same_for_any_number_of_threads(lamp: str) -> None:
    need_every_table()
    check_equal_bits(*lamp_moves(lamp), spp=4, max_depth=3)


@pytest.mark.parametrize("lamp", LAMPS)
def test_plan_names_what_reaches_the_lamp(lamp: str) -> None:
    need_every_table()
    scene = sheet_through(lamp)
    words = "besides edges: what sheet hide of the light 'lamp' where they pass through it"
    shadow = {term.name: term for term in edgegrad.plan(scene, SHEET).terms}["shadow"]
    assert words in shadow.why
    # Another mesh that moves moves the lamp over the sheet, since it turns with what it lights.
    shadow = {term.name: term for term in edgegrad.plan(scene, FLOOR).terms}["shadow"]
    assert words in shadow.why
    # The sheet's box still holds the lamp's place, but none of its faces comes near.
    scene.meshes["sheet"] = rectangle((0.15, 0.9, 0.0), (0.01, 0.1, 0.0), (0.0, 0.0, 2.5), "black")
    shadow = {term.name: term for term in edgegrad.plan(scene, SHEET).terms}["shadow"]
    assert not any("pass through" in words for words in shadow.why)


@pytest.mark.parametrize("lamp", LAMPS)
def test_plan_names_the_jump_of_light_where_a_sphere_begins(lamp: str) -> None:
    need_every_table()
    scene = sheet_through(lamp)
    words = "how the light of 'lamp' jumps on sheet just where they pass through it"
    assert not any(words in sentence for sentence in edgegrad.plan(scene, SHEET).missing), "it is black"
    scene.materials["black"] = matte(0.5, 0.5, 0.5)
    jumps = any(words in sentence for sentence in edgegrad.plan(scene, SHEET).missing)
    assert jumps == lamp.startswith("sphere")

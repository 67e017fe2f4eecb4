"""Boundaries of light whose decay is not the inverse square, compared with central differences: the factor of the decay
is that of the whole way from the light to the surface, wherever between both the edge is that hides it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import edgegrad
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.scenes import box_under_lights, mirrored_shadows, sheets_through_lights
from tests.support.small_scenes import Make, along

Case = tuple[Make, list[str]]


def decaying(case: Case, **fields: Any) -> Case:
    """The same with other decays of all lights at a place."""
    make, paths = case

    def made(theta: float) -> edgegrad.Scene:
        scene = make(theta)
        scene.lights = {name: light if isinstance(light, edgegrad.SunLight) else replace(light, **fields)
                        for name, light in scene.lights.items()}  # fmt: skip
        return scene

    return made, paths


def constant(case: Case) -> Case:
    return decaying(case, decay="CONSTANT")


def dim_close_by(case: Case) -> Case:
    return decaying(case, decay="LINEAR", smooth=2.0)


SHADOWS = {
    name: change(box_under_lights.CASES[name])
    for name, change in (
        ("point: box moves", constant), ("disk: box moves", dim_close_by), ("rectangle: box moves", constant),
        ("ellipse: floor moves", dim_close_by), ("disk: light grows", constant), ("spot: light moves", dim_close_by))
}  # fmt: skip
MIRRORED = ("point: box moves", "rectangle: box moves")


@pytest.mark.parametrize("name", SHADOWS)
def test_shadows(name: str) -> None:
    need_every_table()
    check_agreement(along(*SHADOWS[name]))


@pytest.mark.parametrize("name", MIRRORED)
def test_shadows_in_mirrors(name: str) -> None:
    need_every_table()
    check_agreement(along(*constant(mirrored_shadows.CASES[name])), **mirrored_shadows.options_of(name))


@pytest.mark.parametrize("name", ["rectangle: sheet moves", "ellipse: light moves"])
def test_intersected_lights(name: str) -> None:
    need_every_table()
    check_agreement(along(*constant(sheets_through_lights.CASES[name])), spp=128)


@pytest.mark.parametrize("name", SHADOWS)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*SHADOWS[name], spp=32, terms=("interior", "shadow"))

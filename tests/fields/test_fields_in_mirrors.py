"""Outlines of distance fields that mirrors and smooth glass show, beside central differences, whatever moves."""

from __future__ import annotations

from dataclasses import replace

import pytest

from edgegrad import Scene
from edgegrad.expression import Coordinates, VectorMath
from tests.support.block_statistics import check_noticed
from tests.support.fields.in_mirrors import DEPTHS, changed, optical, shown_by
from tests.support.picture_differences import (
    agreement,
    check_agreement,
    check_equal_bits,
    check_transpose,
    need_every_table,
)

CASES = [
    ("flat mirror", "values"), ("flat mirror", "transform"), ("flat mirror", "camera"), ("flat mirror", "optic"),
    ("round mirror", "values"), ("round mirror", "optic"), ("two mirrors", "values"), ("pane", "values"),
    ("pane", "ior"), ("pane", "optic"), ("ball of glass", "transform"), ("ball of glass", "optic"),
    ("ball of glass", "ior"), ("ball of glass", "camera"),
]
OPTIONS = {"eps": 0.01, "seeds": 8, "thetas": 4, "reference_spp": 256}


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


@pytest.mark.parametrize(("optics", "what"), CASES)
def test_agrees_with_differences(optics: str, what: str) -> None:
    scene = shown_by(optics)
    options = OPTIONS | {"seeds": 48} if (optics, what) == ("pane", "ior") else OPTIONS  # its picture hardly changes
    check_agreement(lambda theta: changed(scene, what, theta), max_depth=DEPTHS[optics], **options)


@pytest.mark.parametrize(("optics", "what"), [
    ("crossed sheet", "values"), ("crossed sheet", "transform"), ("crossed sheet", "sheet"), ("crossed sheet", "optic"),
    ("crossed sheet", "camera"), ("crossed field", "values"), ("crossed field", "other"), ("crossed meshes", "sheet"),
    ("crossed meshes", "camera")])
def test_surfaces_that_pass_through_each_other(optics: str, what: str) -> None:
    """A mirror shows the line where a sheet, or another field, passes through the field."""
    scene = shown_by(optics)
    depth = DEPTHS[optics] + len(scene.lights)
    check_agreement(lambda theta: changed(scene, what, theta), max_depth=depth, **OPTIONS)


@pytest.mark.parametrize(("material", "what"), [
    ("mirror", "values"), ("mirror", "transform"), ("mirror", "camera"), ("glass", "values"), ("glass", "transform"),
    ("glass", "camera"), ("glass", "ior")])
def test_fields_that_are_mirrors_or_glass(material: str, what: str) -> None:
    """They show the edges of meshes."""
    scene = optical(material)
    check_agreement(lambda theta: changed(scene, what, theta), max_depth=DEPTHS[material], **OPTIONS)


def mapped() -> Scene:
    """A ball of glass whose normal map turns refracted rays above its surface in a part of it."""
    scene = optical("glass")
    tilted = VectorMath("NORMALIZE", VectorMath("ADD", Coordinates("NORMAL"), (0.2, 0.1, 0.5)))
    scene.materials["glass"] = replace(scene.materials["glass"], textures={"normal": tilted}, normal_space="WORLD")
    return scene


@pytest.mark.parametrize("what", ["values", "transform", "camera"])
def test_horizons_of_fields(what: str) -> None:
    """No light comes from rays that a normal map turns to the wrong side."""
    check_agreement(lambda theta: changed(mapped(), what, theta), max_depth=4, **OPTIONS | {"seeds": 24})


def test_horizons_of_fields_in_both_modes() -> None:
    paths = ["fields.body.values", "fields.body.transform", "camera.to_world"]
    check_transpose(lambda _: mapped(), paths, spp=16, seed=3, max_depth=4)
    check_equal_bits(lambda _: mapped(), paths, spp=4, max_depth=4)


@pytest.mark.parametrize(("optics", "what"), [("flat mirror", "values"), ("ball of glass", "transform")])
def test_differences_notice_a_missing_term(optics: str, what: str) -> None:
    scene = shown_by(optics)
    check_noticed(agreement(lambda theta: changed(scene, what, theta), max_depth=DEPTHS[optics],
                            terms=("interior", "shadow", "indirect"), **OPTIONS))


@pytest.mark.parametrize(
    "optics", ["flat mirror", "ball of glass", "crossed sheet", "crossed field", "mirror", "glass"])
def test_modes_are_transposes(optics: str) -> None:
    scene = optical(optics) if optics in ("mirror", "glass") else shown_by(optics)
    paths = ["fields.body.values", "fields.body.transform", "camera.to_world",
             *(f"meshes.{name}.vertices" for name in scene.meshes)]
    check_transpose(lambda _: scene, paths, spp=16, seed=3, max_depth=DEPTHS[optics] + 1)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=DEPTHS[optics] + 1)

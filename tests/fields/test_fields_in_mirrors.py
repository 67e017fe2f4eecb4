"""Outlines of distance fields that mirrors and smooth glass show, beside central differences, whatever moves."""

from __future__ import annotations

import pytest

from tests.support.block_statistics import check_noticed
from tests.support.fields.in_mirrors import DEPTHS, changed, shown_by
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
    check_agreement(lambda theta: changed(scene, what, theta), max_depth=DEPTHS[optics], **OPTIONS)


@pytest.mark.parametrize(("optics", "what"), [("flat mirror", "values"), ("ball of glass", "transform")])
def test_differences_notice_a_missing_term(optics: str, what: str) -> None:
    scene = shown_by(optics)
    check_noticed(agreement(lambda theta: changed(scene, what, theta), max_depth=DEPTHS[optics],
                            terms=("interior", "shadow", "indirect"), **OPTIONS))


@pytest.mark.parametrize("optics", ["flat mirror", "pane", "ball of glass"])
def test_modes_are_transposes(optics: str) -> None:
    scene = shown_by(optics)
    paths = ["fields.body.values", "fields.body.transform", "camera.to_world",
             f"meshes.{'mirror' if 'mirror' in scene.meshes else 'glass'}.vertices"]
    check_transpose(lambda _: scene, paths, spp=16, seed=3, max_depth=DEPTHS[optics])
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=DEPTHS[optics])

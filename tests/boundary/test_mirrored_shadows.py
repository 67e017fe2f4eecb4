"""Shadow boundaries and indirect boundaries, seen in perfect mirrors and through smooth glass, for every motion,
compared with central differences.

The mirrors and glasses are visible to the camera alone: they hide no light from what they show, and reflect none to it.
The lights themselves are not visible in them.
"""

from __future__ import annotations

import pytest

import edgegrad
from tests.support.block_statistics import check_noticed
from tests.support.picture_differences import agreement, check_agreement, check_transpose, need_every_table
from tests.support.scenes.mirrored_shadows import BOX, CASES, behind, depth_of, options_of, through
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import along

QUICK = ("point: box moves", "rectangle: box moves", "sky: box moves", "disk: floor moves", "point: mirror moves",
         "rectangle: light moves and turns", "mesh: light moves", "sky image: light turns",
         "slab: index under a point", "ball: ball moves under a rectangle", "veils: box moves under a point",
         "bounced: box moves", "bounced: wall moves", "behind: box moves under a rectangle",
         "behind: box moves under a mesh")
RUNS = slow_but(CASES, QUICK)


@pytest.mark.parametrize("name", RUNS)
def test_agrees_with_differences(name: str) -> None:
    need_every_table()
    make, paths = CASES[name]
    check_agreement(along(make, paths), **options_of(name))


@pytest.mark.parametrize("name", ["point: box moves", "rectangle: box moves", "ball: box moves under a point",
                                  "bounced: box moves"])
def test_differences_notice_a_missing_term(name: str) -> None:
    need_every_table()
    make, paths = CASES[name]
    left = "shadow" if name.startswith("bounced") else "indirect"
    outcome = agreement(along(make, paths), terms=["interior", "primary", left], **options_of(name))
    check_noticed(outcome)


@pytest.mark.parametrize("name", [run for run in RUNS if isinstance(run, str)])
def test_modes_are_transposes(name: str) -> None:
    need_every_table()
    spp = 256 if name == "bounced: wall moves" else 32  # few of its samples meet the light
    check_transpose(*CASES[name], spp=spp, max_depth=depth_of(name), seed=3, terms=["primary", "shadow", "indirect"])


@pytest.mark.parametrize(("light", "lacks"), [("point", True), ("rectangle", False), ("mesh", False)])
def test_plan_tells_of_shadows_of_lights_without_size_behind_mirrors(light: str, lacks: bool) -> None:
    need_every_table()
    scene = behind(light)(0.0)
    for depth, told in ((3, False), (4, lacks)):
        sentences = edgegrad.plan(scene, BOX, max_depth=depth).missing
        assert any(s.startswith("shadows of lamp (lights without size)") for s in sentences) == told


def test_plan_tells_of_them() -> None:
    need_every_table()
    slab = through("slab", "point", "ior")(0.0)
    index = str(edgegrad.plan(slab, ["materials.glass.ior"], max_depth=4))
    assert "no shadow moves, but its image in mirrors and smooth glass does" in index
    assert "those that the camera sees by mirrors and smooth glass (glass)" in index
    assert "no shadow moves" not in str(edgegrad.plan(slab, BOX, max_depth=4))
    assert "those that the camera sees by mirrors" not in str(edgegrad.plan(slab, BOX, max_depth=2))

"""Occlusion by surfaces that intersect the light or the surface that they hide, compared with central differences."""

from __future__ import annotations

import pytest

from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.scenes.sheets_through_lights import CASES, DEEP
from tests.support.small_scenes import along


@pytest.mark.parametrize("name", CASES)
def test_intersected_lights_agree_with_central_differences(name: str) -> None:
    need_every_table()
    # On the sheet itself the light of an ellipse jumps, with samples of no finite variance (derivations, C and F2):
    # more samples hardly lessen the noise.
    check_agreement(along(*CASES[name]), spp=128)


@pytest.mark.parametrize("name", DEEP)
def test_intersected_surfaces_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*DEEP[name]), spp=128, max_depth=3)


@pytest.mark.parametrize("name", [*CASES, *DEEP])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*{**CASES, **DEEP}[name], spp=16, terms=("shadow", "indirect"), max_depth=4)

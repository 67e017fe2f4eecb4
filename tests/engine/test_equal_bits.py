"""The same seed gives the same bits in every call and for any number of threads, whatever terms run beside each other.

What one term leaves in a thread's memory must not reach the next one: how terms follow each other depends on the
number of threads, so that such a leak changes bits here.
"""

from __future__ import annotations

import pytest

from tests.support.picture_differences import check_equal_bits, need_every_table
from tests.support.scenes import (
    box_under_lights,
    horizons,
    lit_by_surfaces,
    mirrored_shadows,
    mirrors_and_glass,
    outlines_of_emitters,
    sheets_through_lights,
)
from tests.support.small_scenes import Make

DEPTH = 5
MODULES = (
    outlines_of_emitters, horizons, lit_by_surfaces, mirrored_shadows, sheets_through_lights, box_under_lights,
    mirrors_and_glass,
)  # fmt: skip


def cases() -> dict[str, tuple[Make, list[str]]]:
    """Every fifth case of each kind of boundary, as a scene by theta and the parameters that move it."""
    found = {}
    for module in MODULES:
        for name, case in list(module.CASES.items())[::5]:
            make, paths = case if isinstance(case, tuple) else (case.make, [case.path])
            found[f"{module.__name__.rpartition('.')[2]}: {name}"] = (make, list(paths))
    return found


CASES = cases()


@pytest.mark.parametrize("name", list(CASES))
def test_bits_are_equal(name: str) -> None:
    need_every_table()
    check_equal_bits(*CASES[name], spp=4, max_depth=DEPTH, seed=3)

"""The same seed gives the same bits in every call and for any number of threads, whatever terms run beside each other.

What one term leaves in a thread's memory must not reach the next one: how terms follow each other depends on the
number of threads, so that such a leak changes bits here.
"""

from __future__ import annotations

import pytest

from tests.boundary import (
    test_emitter_outline,
    test_horizon,
    test_indirect_boundary,
    test_mirrored_shadows,
    test_shadow_boundary,
    test_specular_boundary,
)
from tests.boundary import (
    test_light_intersections as test_pierced_lights,
)
from tests.support.picture_differences import check_equal_bits, need_every_table
from tests.support.small_scenes import Make

DEPTH = 5
MODULES = (
    test_emitter_outline, test_horizon, test_indirect_boundary, test_mirrored_shadows, test_pierced_lights,
    test_shadow_boundary, test_specular_boundary,
)  # fmt: skip


def cases() -> dict[str, tuple[Make, list[str]]]:
    """Every fifth case of each kind of boundary, as a scene by theta and the parameters that move it."""
    found = {}
    for module in MODULES:
        for name, case in list(module.CASES.items())[::5]:
            make, paths = case if isinstance(case, tuple) else (case.make, [case.path])
            found[f"{module.__name__.removeprefix('tests.test_')}: {name}"] = (make, list(paths))
    return found


CASES = cases()


@pytest.mark.parametrize("name", list(CASES))
def test_bits_are_equal(name: str) -> None:
    need_every_table()
    check_equal_bits(*CASES[name], spp=4, max_depth=DEPTH, seed=3)

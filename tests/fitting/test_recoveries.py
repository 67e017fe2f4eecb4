"""Fits recover hidden shapes, materials, lamps, textures and cameras from pictures."""

from __future__ import annotations

import pytest

from blend_examples.recovery_scenes import RECOVERIES, lost_and_found
from tests.support.small_scenes import need

pytestmark = pytest.mark.slow

CASES = [(name, start) for name, recovery in RECOVERIES.items() for start in recovery.starts]


@pytest.mark.parametrize(("name", "start"), CASES, ids=[f"{name}, {start}" for name, start in CASES])
def test_the_lost_is_found(name: str, start: str) -> None:
    need("native")
    recovery = RECOVERIES[name]
    found = lost_and_found(recovery, start, threads=1)
    assert found.error < recovery.part * found.error_before

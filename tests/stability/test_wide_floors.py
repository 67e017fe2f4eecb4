"""Derivatives do not become noisier where a floor is much wider than what the camera sees of it."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Renderer
from tests.stability.wide_floors import scene
from tests.support.block_statistics import block_sums, check, means_p_value

SEEDS, SPP = 12, 16
# Sides of the floors. Borders of the wide one are longer than the box's edges by a factor of 100.
NARROW, WIDE = 8.0, 400.0
# Variances of 12 seeds differ by chance by a factor of 4.5 at the level 0.01. The wide floor is also seen up to the
# horizon.
MOST = 8.0
# Coordinates of the wide floor are rounded to larger parts of the box.
ROUNDING = 1e-3


def blocks(side: float, light: str, term: str) -> np.ndarray:
    """(seeds, blocks) the part of a term in the derivative along a shift of the box."""
    renderer = Renderer(scene(side, light))
    shift = np.tile([1.0, 0.0, 0.0], (8, 1))
    pictures = [renderer.render_forward({"meshes.box.vertices": shift}, spp=SPP, max_depth=3, seed=seed, terms=[term])
                for seed in range(SEEDS)]  # fmt: skip
    return np.array([block_sums(picture).ravel() for picture in pictures])


@pytest.mark.parametrize("term", ["shadow", "indirect"])
@pytest.mark.parametrize("light", ["sun", "sky"])
def test_wide_floor(light: str, term: str) -> None:
    narrow, wide = (blocks(side, light, term) for side in (NARROW, WIDE))
    assert narrow.any()
    assert wide.var(axis=0).mean() < MOST * narrow.var(axis=0).mean()
    if light == "sun":  # which the floor's borders do not change
        check(means_p_value(wide, narrow, ROUNDING * np.abs(narrow).max()))

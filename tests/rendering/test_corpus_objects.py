"""How the fits to Cycles' pictures choose what they fit: what the picture determines, and to which side it is moved."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from tests.benchmarks.corpus.determined import expected_error
from tests.benchmarks.corpus.objects import candidates, clear_of_others
from tests.support.small_scenes import box, camera, rectangle


def _sheet() -> edgegrad.Scene:
    """A matte sheet that fills the picture, in an even light of 1."""
    return edgegrad.Scene(
        camera(size=16), {"sheet": rectangle((0, 0, 0), (50, 0, 0), (0, 50, 0), "grey")},
        {"grey": edgegrad.Material(np.full(3, 0.5))}, world=edgegrad.World(np.ones(3)),
    )  # fmt: skip


def test_the_error_of_a_colour_is_that_of_the_mean_of_the_pixels() -> None:
    theirs = (0.5 + np.random.default_rng(0).normal(0.0, 0.2, (6, 16, 16, 3))).astype(np.float32)
    move = (np.full(3, 0.45), np.full(3, 0.55))
    found = expected_error(_sheet(), theirs, "materials.grey.base_color", [move], max_depth=2, by_channel=True)
    # A channel's value is the mean of its 256 pixels; the worst of three channels counts.
    variance = theirs.var(axis=0, ddof=1, dtype=np.float64) / 6.0
    assert found == pytest.approx(np.sqrt(variance.mean(axis=(0, 1)).max() / 256.0) / 0.1, rel=1e-3)


def test_a_plane_that_slides_in_itself_is_not_determined() -> None:
    theirs = (0.5 + np.random.default_rng(0).normal(0.0, 1e-3, (6, 16, 16, 3))).astype(np.float32)
    aside = np.eye(4)
    aside[0, 3] = 1.0
    found = expected_error(_sheet(), theirs, "meshes.sheet.transform", [(np.eye(4), aside)], max_depth=2)
    assert found > 10.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_object_is_moved_away_from_what_would_hide_it(side: float) -> None:
    meshes = {"far": box((0, 0, 0), (0.3, 0.3, 0.3), "grey"),
              "near": box((0.6 * side, 0.15, 1.0), (0.35, 0.5, 0.1), "grey")}  # fmt: skip
    scene = edgegrad.Scene(camera(), meshes, {"grey": edgegrad.Material(np.full(3, 0.5))})
    far = next(one for one in candidates(scene) if one.name == "far")
    shift = clear_of_others(scene, far, 0.3)
    assert shift[0] * side < 0.0 < shift[1]
    assert np.linalg.norm(shift) == pytest.approx(0.3 * far.diagonal)
    np.testing.assert_array_equal(scene.meshes["far"].transform, np.eye(4))

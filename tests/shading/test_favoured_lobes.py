"""Derivatives by the widths of lobes: samples are taken where these derivatives are large."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Material, Renderer, Scene, plan
from tests.support.block_statistics import check, means_p_value
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.scenes.gloss.rough_ball import COAT, ROUGHNESS, ball
from tests.support.small_scenes import along


def glass(theta: float = 0.0) -> Scene:
    scene = ball()
    scene.materials = {"clay": Material(np.ones(3), kind="GLASS", roughness=0.4 + theta)}
    return scene


CASES: dict[str, tuple[Callable[[float], Scene], list[str], int]] = {
    "last rays": (ball, [ROUGHNESS, COAT], 2),
    "several bounces": (ball, [ROUGHNESS, COAT], 4),
    "glass": (glass, [ROUGHNESS], 4),
}


@pytest.mark.parametrize("case", CASES)
def test_pictures_change_as_their_derivatives_say(case: str) -> None:
    need_every_table()
    make, paths, depth = CASES[case]
    check_agreement(along(make, paths), eps=0.04, seeds=8, spp=128, reference_spp=512, max_depth=depth)


@pytest.mark.parametrize("case", CASES)
def test_both_modes_take_the_same_samples(case: str) -> None:
    need_every_table()
    make, paths, depth = CASES[case]
    check_transpose(make, paths, spp=16, seed=3, max_depth=depth)


@pytest.mark.parametrize("path", [ROUGHNESS, COAT])
def test_they_have_less_noise_than_samples_of_the_picture(path: str) -> None:
    """If a colour is requested, too, lobes are sampled as for pictures: the same mean with more noise."""
    need_every_table()
    scene = ball(coat_weight=1.0 if path == COAT else 0.0)
    renderer = Renderer(scene)
    height, width = scene.camera.size
    adjoint = np.random.default_rng(1).uniform(0.5, 1.0, (height, width, 3)).astype(np.float32)

    def gradients(*besides: str) -> NDArray[np.float64]:
        wrt = [path, *besides]
        return np.array([float(renderer.render_backward(adjoint, wrt, spp=4, seed=k)[path]) for k in range(64)])

    favoured, even = gradients(), gradients("materials.clay.base_color")
    # Of twice 64 samples the ratio of variances has a standard error of a quarter of itself.
    assert even.var() > 3.0 * favoured.var()
    check(means_p_value(favoured, even))


def test_what_they_count_for_is_their_density() -> None:
    """To a hundredth: the mean over many samples of the picture's lobes, and of favoured ones."""
    need_every_table()
    renderer = Renderer(ball(coat_weight=0.0))

    def means(*besides: str) -> NDArray[np.float64]:
        adjoint = np.ones((16, 24, 3), np.float32)
        wrt = [ROUGHNESS, *besides]
        return np.array([float(renderer.render_backward(adjoint, wrt, spp=256, max_depth=2, seed=k)[ROUGHNESS])
                         for k in range(16)])

    favoured, even = means(), means("materials.clay.base_color")
    error = np.sqrt((favoured.var(ddof=1) + even.var(ddof=1)) / len(even))
    assert error < 0.01 * abs(even.mean())
    check(means_p_value(favoured, even))


def test_the_plan_says_it() -> None:
    def words(*wrt: str) -> str:
        return str(plan(ball(), list(wrt)))

    assert "only roughness is requested" in words(ROUGHNESS, COAT)
    assert "only roughness is requested" not in words(ROUGHNESS, "materials.clay.base_color")

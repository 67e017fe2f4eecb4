"""Pictures and derivatives of equal seeds have independent random numbers: gradients of noisy losses are unbiased."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from tests.support.block_statistics import check, mean_p_value
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import floating_box

PATHS = {"materials.floor.base_color": 3, "lights.area.power": 1}


@pytest.mark.parametrize("path", PATHS)
def test_the_gradient_of_a_loss_is_zero_in_the_mean_at_the_truth(path: str) -> None:
    """For L2 and a target that equals the truth, E[(I - T) dI] = cov(I, dI), which is 0 for independent numbers.

    The picture's and the derivative's seeds are equal, as their defaults are. Each of the runs is one sample of the
    gradient.
    """
    need_every_table()
    scene = floating_box()
    scene.camera.width = scene.camera.height = 12
    renderer = edgegrad.Renderer(scene)
    truth = renderer.render(spp=4096, seed=123456)
    found = []
    for seed in range(96):
        picture = renderer.render(spp=1, seed=seed)
        gradient = renderer.render_backward(2.0 * (picture - truth), [path], spp=1, seed=seed)
        found.append(np.sum(gradient[path]))
    check(mean_p_value(found, 0.0))


def test_equal_seeds_give_equal_derivatives() -> None:
    need_every_table()
    renderer = edgegrad.Renderer(floating_box())
    tangent = {"lights.area.power": np.array(1.0)}
    one, other, third = (renderer.render_forward(tangent, spp=1, seed=seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(one, other)
    assert not np.array_equal(one, third)

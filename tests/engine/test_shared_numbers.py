"""Neighbouring pixels of derivatives share a sequence of random numbers: sums over them have less noise."""

from __future__ import annotations

import numpy as np

from edgegrad import Renderer
from tests.support.picture_differences import need_every_table
from tests.support.scenes.gloss.rough_ball import ROUGHNESS, ball


def test_sums_over_pixels_have_less_noise_than_their_pixels() -> None:
    """Of independent pixels the variance of the sum is the sum of the variances."""
    need_every_table()
    scene = ball(coat_weight=0.0)
    scene.meshes = {"object": scene.meshes["object"]}
    scene.camera.width = scene.camera.height = 32
    scene.camera.fov_x = 0.15  # neighbours see the same
    tangent = {ROUGHNESS: np.array(1.0)}
    renderer = Renderer(scene)
    pictures = np.array([renderer.render_forward(tangent, spp=4, max_depth=2, seed=k) for k in range(48)], np.float64)
    # Of 48 pictures a variance is known to a fifth of itself: half of it is far from independence.
    assert pictures.sum((1, 2, 3)).var() < 0.5 * pictures.sum(3).var(0).sum()


def test_a_crop_has_the_numbers_of_the_whole() -> None:
    need_every_table()
    scene = ball()
    scene.camera.width, scene.camera.height = 40, 24
    tangent = {ROUGHNESS: np.array(1.0)}
    whole = Renderer(scene).render_forward(tangent, spp=3, max_depth=2, seed=2)
    scene.camera.crop = (7, 5, 30, 20)
    part = Renderer(scene).render_forward(tangent, spp=3, max_depth=2, seed=2)
    np.testing.assert_allclose(part, whole[5:20, 7:30], rtol=1e-4, atol=1e-5 * np.abs(whole).max())

"""Targets of another size than the camera's picture, and what their masks and alpha do then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Target, images
from edgegrad.fitting.targets import views
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.fits import COLOR, ball, picture


@pytest.mark.parametrize("size", [(6, 8), (3, 2), (5, 13), (12, 16), (7, 4), (1, 1), (24, 24)])
def test_new_pixels_are_means_over_their_areas(size: tuple[int, int]) -> None:
    """Against sums over the common multiple of both grids."""
    image = np.random.default_rng(0).random((12, 16, 3))
    found = images.resample(image, size)
    fine = np.repeat(np.repeat(image, size[0], axis=0), size[1], axis=1)
    expected = fine.reshape(size[0], 12, size[1], 16, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert images.resample(image.astype(np.float32), size).dtype == np.float32
    assert images.resample(image[..., 0] > 0.5, size).shape == size


def test_a_large_target_is_the_average_and_a_small_one_is_rendered_small() -> None:
    scene = ball()
    sharp = np.random.default_rng(1).random((96, 128, 3)).astype(np.float32)
    seen = views(scene, Target(sharp))[0]
    np.testing.assert_allclose(seen.image, sharp.reshape(24, 4, 32, 4, 3).mean(axis=(1, 3)), atol=1e-6)
    assert scene.camera.size == (24, 32) and seen.camera is scene.camera
    small = edgegrad.render(replace(scene, camera=replace(scene.camera, width=16, height=12)), spp=512)
    seen = views(scene, Target(small))[0]
    assert seen.camera is scene.camera and scene.camera.size == (12, 16) and seen.image.shape == (12, 16, 3)
    np.testing.assert_allclose(edgegrad.render(scene, spp=512, seed=1), small, atol=0.03)


def test_rounded_sizes_cover_the_same_area() -> None:
    """33 x 24 for 16 x 12: the camera of the small picture sees what the large one saw, to its edges."""
    camera = shapes.camera(size=(33, 24), fov_x=0.6)
    scene = replace(ball(), camera=camera)
    seen = views(scene, Target(np.zeros((12, 16, 3)), camera))[0]
    assert seen.camera.size == (12, 16)
    height = camera.height * camera.pixel_aspect / camera.focal
    assert seen.camera.height * seen.camera.pixel_aspect / seen.camera.focal == pytest.approx(height)


def test_a_fit_to_targets_of_other_sizes_finds_the_truth() -> None:
    truth = ball()
    truth.materials["clay"].base_color = np.array([0.2, 0.7, 0.4])
    for scale in (3, 0.5):
        camera = replace(truth.camera, width=int(32 * scale), height=int(24 * scale))
        image = edgegrad.Renderer(truth).render(spp=64, camera=camera)
        scene = ball()
        fit = edgegrad.fit(scene, Target(image), [COLOR, "camera.fov_x"], iterations=60, spp=4)
        np.testing.assert_allclose(parameters.get(scene, COLOR), [0.2, 0.7, 0.4], atol=0.03)
        assert fit.values["camera.fov_x"] == pytest.approx(truth.camera.fov_x, rel=0.02)
        assert scene.camera.size == (24, 32), "the fit's copy has another size, but not the scene"


def test_ignored_pixels_have_no_part_in_means() -> None:
    scene = ball()
    image = np.full((48, 64, 3), 0.25, np.float32)
    mask = np.ones((48, 64))
    mask[:, 31:] = 0.0
    image[mask == 0.0] = 1e4
    seen = views(scene, Target(image, mask=mask))[0]
    assert seen.mask is not None
    np.testing.assert_allclose(seen.image[seen.mask > 0.0], 0.25, rtol=1e-5)
    np.testing.assert_allclose(seen.mask[:, 14:17], [[1.0, 0.5, 0.0]] * 24)
    # A mask of another size than its image.
    seen = views(scene, Target(image, mask=mask[::4, ::4]))[0]
    assert seen.mask is not None and seen.mask.shape == (24, 32)


def test_alpha_as_a_mask_counts_opaque_pixels_alone() -> None:
    scene = ball()
    image = np.ones((24, 32, 4), np.float32)
    image[..., 3] = 0.5
    image[:8, :, 3] = 1.0
    mask = np.full((24, 32), 2.0)
    seen = views(scene, Target(image, alpha="mask", mask=mask))[0]
    assert seen.mask is not None
    np.testing.assert_array_equal(seen.mask[:8], 2.0)
    np.testing.assert_array_equal(seen.mask[8:], 0.0)
    np.testing.assert_array_equal(seen.image, 1.0)
    # Alpha over the world is averaged with the colours that it covers.
    tall = np.zeros((48, 32 * 2, 4), np.float32)
    tall[::2] = (0.5, 0.5, 0.5, 1.0)
    np.testing.assert_allclose(views(scene, Target(tall))[0].image, 0.25 + 0.5 * 0.2, rtol=1e-5)
    # A known gain is that of the picture, not of the world behind it.
    np.testing.assert_allclose(views(scene, Target(tall, gain=2.0))[0].image, 0.125 + 0.5 * 0.2, rtol=1e-5)


def test_another_aspect_is_refused_with_its_cure() -> None:
    scene = ball()
    with pytest.raises(ValueError, match=r"is 60 x 40 pixels, .* 32 x 24, of another aspect; crop the image, or give"):
        views(scene, Target(np.zeros((40, 60, 3))))
    cropped = replace(scene.camera, crop=(4, 4, 20, 16))
    assert views(scene, Target(np.zeros((24, 32, 3)), cropped))[0].image.shape == (12, 16, 3)
    with pytest.raises(ValueError, match="smaller than the crop of its camera, 16 x 12; reduce"):
        views(scene, Target(np.zeros((6, 8, 3)), cropped))
    assert views(scene, picture(scene))[0].image.shape == (24, 32, 3)

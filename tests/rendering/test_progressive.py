"""Pictures whose samples are rendered in several calls."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from tests.support import small_scenes
from tests.support.rich_scene import everything

# A task of the engine holds this many paths; the samples of one pixel are then in several tasks.
TASK = 8192


@pytest.mark.parametrize("parts", [(13,), (1, 12), (1, 1, 2, 4, 5), (6, 7)])
def test_last_picture_is_that_of_one_render(parts: tuple[int, ...]) -> None:
    scene = everything()
    scene.camera.width, scene.camera.height, scene.camera.crop = 37, 29, None
    renderer = edgegrad.Renderer(scene)
    options = {"max_depth": 5, "seed": 3, "bounces": edgegrad.Bounces(diffuse=2)}
    progressive = edgegrad.Progressive(renderer, **options)
    for spp in parts:
        picture = progressive.add(spp)
        assert picture.tobytes() == renderer.render(spp=progressive.samples, **options).tobytes()
    assert progressive.samples == sum(parts)


def test_many_samples_and_another_camera() -> None:
    scene = small_scenes.floating_box()
    camera = small_scenes.camera((1.0, 2.0, 5.0), size=3)
    renderer = edgegrad.Renderer(scene)
    progressive = edgegrad.Progressive(renderer, camera=camera)
    progressive.add(5)
    picture = progressive.add(TASK + 4000)
    assert picture.tobytes() == renderer.render(spp=TASK + 4005, camera=camera).tobytes()


def test_values_beyond_float32_are_rounded_alike() -> None:
    """The sum of the samples is beyond the range of float32, their mean is not."""
    scene = small_scenes.floating_box()
    scene.world = small_scenes.white_world(3e38)
    scene.camera = small_scenes.camera((0, 0, 4), (0, 0.2, 8), size=4)
    renderer = edgegrad.Renderer(scene)
    progressive = edgegrad.Progressive(renderer, max_depth=1)
    progressive.add(2)
    picture = progressive.add(3)
    assert picture.max() > 1e38 and np.isfinite(picture).all()
    assert picture.tobytes() == renderer.render(spp=5, max_depth=1).tobytes()


def test_the_reference_engine_renders_all_samples() -> None:
    small_scenes.need("reference")
    renderer = edgegrad.Renderer(small_scenes.floating_box(), engine="reference")
    progressive = edgegrad.Progressive(renderer)
    progressive.add(2)
    assert progressive.add(3).tobytes() == renderer.render(spp=5).tobytes()


def test_a_cancelled_picture_takes_no_more_samples() -> None:
    progressive = edgegrad.Progressive(edgegrad.Renderer(small_scenes.floating_box()))
    progressive.add(1)

    def cancel(fraction: float) -> None:
        raise edgegrad.Cancelled

    with pytest.raises(edgegrad.Cancelled):
        progressive.add(64, cancel)
    assert progressive.samples == 1
    with pytest.raises(RuntimeError, match="begin a new picture"):
        progressive.add(1)


def test_wrong_numbers_are_named() -> None:
    renderer = edgegrad.Renderer(small_scenes.floating_box())
    with pytest.raises(ValueError, match="spp"):
        edgegrad.Progressive(renderer).add(0)
    with pytest.raises(ValueError, match="seed"):
        edgegrad.Progressive(renderer, seed=-1)

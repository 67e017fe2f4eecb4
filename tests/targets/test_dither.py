"""Blender's dither is taken away from 8-bit pictures that contain it, and from no others."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import images
from edgegrad.images.coded import read_coded
from edgegrad.images.dither import pattern, without_dither
from tests.support.scenes import blender_scenes as bs
from tests.targets.cycles_targets import saved

F64 = NDArray[np.float64]
HEIGHT, WIDTH = 40, 60


def _shaded(rng: np.random.Generator) -> F64:
    """Code values of a smooth picture with an edge."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    light = 0.3 + 0.2 * x / WIDTH + 0.1 * np.sin(y / 9.0) + 0.2 * (x > 40)
    return light[..., None] * rng.uniform(0.6, 1.0, 3)


def _rounded(codes: F64) -> F64:
    return np.round(255.0 * np.clip(codes, 0.0, 1.0)) / 255.0


def test_pattern_is_that_of_blender(tmp_path: Path) -> None:
    """Of a picture of one color, whose true code value passes through one code in 16 renders."""
    scene = bs.empty()
    scene.render.dither_intensity, scene.cycles.samples = 1.0, 1
    scene.view_settings.view_transform = "Raw"
    render: Any = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 24, 16, 100
    bs.camera((0, 0, 6), name="Front")
    bs.world((0.2, 0.2, 0.2))
    color = scene.world.node_tree.nodes["Background"].inputs["Color"]
    steps, total = 16, np.zeros((16, 24))
    for k in range(steps):
        value = (100.0 + (k + 0.5) / steps) / 255.0
        color.default_value = (value, value, value, 1.0)
        total += read_coded(saved(tmp_path / "one.png", scene)).values[..., 0] - value
    # A mean over a code's width of rounded values is exact but for the spacing of the values.
    assert np.abs(total / steps - pattern(16, 24)).max() < 0.51 / steps / 255.0


@pytest.mark.parametrize("intensity", [0.5, 1.0, 2.0])
def test_what_remains_is_rounding(intensity: float) -> None:
    """Errors without the dither have the variance of rounding, 1/12 of a code squared; those with it a larger one."""
    rng = np.random.default_rng(1)
    kept, left = [], []
    for _ in range(10):
        light = _shaded(rng)
        codes = _rounded(light + intensity * pattern(HEIGHT, WIDTH)[..., None])
        kept.append(255.0 * (codes - light))
        left.append(255.0 * (without_dither(codes, 255) - light))
    # The relative standard error of a variance of uniform numbers is sqrt(0.8 / n).
    error = np.sqrt(0.8 / np.size(left))
    assert np.var(left) == pytest.approx(1.0 / 12.0, rel=6.0 * error + 0.02)
    dither = np.var(255.0 * intensity * pattern(HEIGHT, WIDTH))
    assert np.var(kept) == pytest.approx(1.0 / 12.0 + dither, rel=0.1)


def test_other_pictures_stay() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        codes = _rounded(_shaded(rng) + rng.choice((0.0, 0.002, 0.01)) * rng.normal(size=(HEIGHT, WIDTH, 3)))
        assert without_dither(codes, 255) is codes
    dithered = _rounded(_shaded(rng) + pattern(HEIGHT, WIDTH)[..., None])
    assert without_dither(dithered, 65535) is dithered
    assert np.array_equal(without_dither(dithered[:2], 255), dithered[:2])


def test_clipped_channels_and_alpha_stay() -> None:
    light = np.concatenate([_shaded(np.random.default_rng(3)), np.full((HEIGHT, WIDTH, 1), 0.5)], axis=2)
    light[:5], light[-5:, :, 1] = 1.2, -0.1
    codes = _rounded(light + pattern(HEIGHT, WIDTH)[..., None] * (1, 1, 1, 0))
    out = without_dither(codes, 255)
    clipped = (codes == 0.0) | (codes == 1.0)
    assert clipped[..., :3].mean() > 0.1 and not np.array_equal(out, codes)
    assert np.array_equal(out[clipped], codes[clipped]) and np.array_equal(out[..., 3], codes[..., 3])


def test_targets_are_without_dither(tmp_path: Path) -> None:
    """The light of a dithered sRGB picture has the error of rounding."""
    codes = _shaded(np.random.default_rng(4))
    rounded = _rounded(codes + pattern(HEIGHT, WIDTH)[..., None])
    images.write_image(tmp_path / "dithered.png", images.srgb_to_linear(rounded).astype(np.float32))
    found = images.linear_to_srgb(images.read_target(tmp_path / "dithered.png").image)
    assert 255.0 * np.abs(found - codes).max() < 0.6
    assert 255.0 * np.abs(rounded - codes).max() > 1.0

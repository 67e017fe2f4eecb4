"""Samples of the environment's image, and surfaces lit by it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.light_directions import grid
from tests.support.light_probes import Probe, lit
from tests.support.small_scenes import matte, pixel_at, rectangle


def panorama(height: int, seed: int = 3) -> NDArray[np.float32]:
    """A dim, uneven sky with one very bright pixel."""
    rng = np.random.default_rng(seed)
    pixels = (0.2 + rng.random((height, 2 * height, 3))).astype(np.float32)
    pixels[height // 5, height // 2] = 3.0 * height**2
    return pixels


TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def sky(pixels: NDArray[np.float32]) -> edgegrad.Scene:
    return lit({}, images={"sky": edgegrad.Image(pixels)}, world=edgegrad.World(np.ones(3), 2.0, "sky", TURN))


def sphere_grid(rows: int) -> tuple[NDArray[np.float64], float]:
    """Directions of equal solid angle, and that solid angle."""
    z, turn = np.meshgrid((np.arange(rows) + 0.5) / rows * 2 - 1, (np.arange(2 * rows) + 0.5) / rows * np.pi)
    s = np.sqrt(1 - z * z)
    return np.stack([s * np.cos(turn), s * np.sin(turn), z], -1).reshape(-1, 3), 4 * np.pi / z.size


def test_environment_is_mapped_as_documented() -> None:
    pixels = panorama(16)
    w, _ = sphere_grid(40)
    d = w @ TURN.T
    u = (0.5 - np.arctan2(d[:, 1], d[:, 0]) / (2 * np.pi)) * 32 - 0.5
    v = (0.5 - np.arcsin(d[:, 2]) / np.pi) * 16 - 0.5
    x, y = np.floor(u).astype(int), np.floor(v).astype(int)
    fx, fy = (u - x)[:, None], (v - y)[:, None]
    upper = pixels[y % 16, x % 32] * (1 - fx) + pixels[y % 16, (x + 1) % 32] * fx
    lower = pixels[(y + 1) % 16, x % 32] * (1 - fx) + pixels[(y + 1) % 16, (x + 1) % 32] * fx
    np.testing.assert_allclose(Probe(sky(pixels)).look(w)["radiance"], 2 * (upper * (1 - fy) + lower * fy), rtol=2e-3,
                               atol=0.02)  # fmt: skip


@pytest.mark.parametrize("height", [4, 64, 256])
def test_environment_density(height: int) -> None:
    """It integrates to 1, and is that of the samples."""
    probe = Probe(sky(panorama(height)))
    w, solid_angle = sphere_grid(1200)
    # Equal steps miss parts of the one bright pixel's cells.
    assert float(probe.look(w)["pdf"].astype(np.float64).sum()) * solid_angle == pytest.approx(1.0, abs=0.05)
    s = probe.sky(grid(128))
    agree = np.isclose(probe.look(s["w"])["pdf"], s["pdf"], rtol=1e-3)
    assert agree.mean() > 0.995  # rounding moves some over a cell's edge
    # Every place that is brighter than the mean is found: samples and density give its integral.
    above = s["radiance"][:, 1] > 20.0
    bright = probe.look(w)["radiance"][:, 1].astype(np.float64)
    assert np.mean(above * s["radiance"][:, 1] / s["pdf"]) == pytest.approx(
        float(bright[bright > 20.0].sum()) * solid_angle, rel=0.1)  # fmt: skip


@pytest.mark.parametrize("height", [4, 64])
def test_light_of_the_environment(height: int) -> None:
    """A flat floor under the sky: radiance is albedo/pi times the irradiance, for direct light and longer paths."""
    pixels = panorama(height)
    scene = edgegrad.Scene(
        pixel_at((0.3, 0.1, 3.0), (0, 0, 0)), {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor")},
        {"floor": matte(0.5, 0.5, 0.5)}, images={"sky": edgegrad.Image(pixels)},
        world=edgegrad.World(np.ones(3), 2.0, "sky", TURN),
    )  # fmt: skip
    w, solid_angle = sphere_grid(1200)
    radiance = Probe(sky(pixels)).look(w)["radiance"].astype(np.float64)
    expected = 0.5 / np.pi * (radiance * np.maximum(w[:, 2:], 0.0)).sum(axis=0) * solid_angle
    for depth in (2, 4):
        pictures = [Renderer(scene).render(spp=1024, seed=k, max_depth=depth)[0, 0] for k in range(16)]
        check(mean_p_value(pictures, expected, rounding=5e-3 * expected))  # of the quadrature
        assert half_width(pictures).max() < 0.1 * expected.max()

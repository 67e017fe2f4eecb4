"""What light sampling gains: ``python -m tests.benchmarks.light_sampling``.

Relative variance of one sample's irradiance (nothing hidden), and the time of a sample with all calls' costs, of
samples by solid angle against samples by area, and of the choice of a light by what it can give against the choice
by power. The alternatives' variances are computed, not sampled.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

import edgegrad
from tests.support.light_probes import Probe, lit
from tests.support.small_scenes import glowing

SAMPLES = 200_000
UP = np.array([0.0, 0.0, 1.0])
Floats = NDArray[np.float64]


def measured(probe: Probe, point: Floats) -> tuple[float, float, float]:
    """Mean and relative variance of the irradiance at a point of a floor, and nanoseconds per sample."""
    uv = np.random.default_rng(0).random((SAMPLES, 2)).clip(0.0, 0.9999999)
    probe.sample(point, UP, uv[:8])  # the list of lights is made once
    start = time.perf_counter()
    s = probe.sample(point, UP, uv)
    seconds = time.perf_counter() - start
    value = s["radiance"][:, 0].astype(np.float64) * s["geometry"] * np.maximum(s["w"][:, 2], 0.0)
    mean = float(value.mean())
    return mean, float(value.var()) / mean**2, seconds / SAMPLES * 1e9


def solid_angle() -> None:
    """A light of 1 x 1 m over a floor, at the point below it and at one below its edge."""
    print("height  beside  variance by area  by solid angle  gain  ns")
    down = np.diag([1.0, 1.0, 1.0, 1.0])
    for height in (4.0, 2.0, 1.0, 0.5, 0.2, 0.05):
        down[2, 3] = height
        probe = Probe(lit({"light": edgegrad.AreaLight(down.copy(), np.ones(2))}))
        for beside in (0.0, 1.0):
            _, variance, ns = measured(probe, np.array([beside, 0.0, 0.0]))
            g = (np.arange(400) + 0.5) / 400 - 0.5
            x, y = np.meshgrid(g - beside, g)
            r2 = x * x + y * y + height**2
            f = height**2 / r2**2
            by_area = float(f.var() / f.mean() ** 2)
            gain = by_area / variance
            print(f"{height:6.2f}  {beside:6.1f}  {by_area:16.2e}  {variance:14.2e}  {gain:4.0f}  {ns:4.0f}")


def choice() -> None:
    """Point lights of very different power under a large ceiling."""
    print("lights  point    variance by power  by what they can give    gain  ns")
    for n in (4, 16, 32, 33, 64, 256, 1024, 10_000):
        rng = np.random.default_rng(1)
        at = np.stack([rng.uniform(-20, 20, n), rng.uniform(-20, 20, n), rng.uniform(2, 4, n)], axis=1)
        power = rng.lognormal(0.0, 1.0, n)
        probe = Probe(lit({f"l{k}": edgegrad.PointLight(at[k], float(power[k])) for k in range(n)}))
        for point in (np.zeros(3), np.array([10.0, 5.0, 0.0])):
            mean, variance, ns = measured(probe, point)
            d = at - point
            f = power / (4 * np.pi) * d[:, 2] / np.sum(d * d, axis=1) ** 1.5
            by_power = float((f**2 / (power / power.sum())).sum() - f.sum() ** 2) / f.sum() ** 2
            assert abs(mean / f.sum() - 1.0) < 6.0 * np.sqrt(variance / SAMPLES) + 1e-4
            gain = f"{by_power / variance:6.1f}" if variance > 1e-6 else "   all"
            print(f"{n:6}  {point[0]:4.0f},{point[1]:2.0f}  {by_power:17.2f}  {variance:21.2e}  {gain}  {ns:4.0f}")


def preparation() -> None:
    """Time until the first sample: the hierarchy over emissive triangles, the distribution over an image."""
    rng = np.random.default_rng(2)
    few = rng.random((8, 2))
    for n in (1000, 100_000):
        vertices = (rng.normal(size=(n, 1, 3)) * 5 + [0, 0, 9] + rng.normal(size=(n, 3, 3)) * 0.02).reshape(-1, 3)
        mesh = edgegrad.Mesh(vertices, np.arange(3 * n, dtype=np.int32).reshape(-1, 3), ("hot",))
        probe = Probe(lit({}, {"mesh": mesh}, {"hot": glowing(1.0, two_sided=True)}))
        start = time.perf_counter()
        probe.sample(np.zeros(3), UP, few)
        print(f"{n} emissive triangles: {time.perf_counter() - start:.3f} s")
    for height in (512, 2048):
        pixels = rng.random((height, 2 * height, 3)).astype(np.float32)
        world = edgegrad.World(np.ones(3), 1.0, "sky")
        start = time.perf_counter()
        Probe(lit({}, images={"sky": edgegrad.Image(pixels)}, world=world))
        print(f"image of {2 * height} x {height}: {time.perf_counter() - start:.3f} s with all the rest of a scene")


if __name__ == "__main__":
    solid_angle()
    choice()
    preparation()

"""The choice among many lights."""

from __future__ import annotations

import math

import numpy as np
import pytest

import edgegrad
from edgegrad.scene.light import Light
from tests.support.light_directions import AT, ORIGIN, UP, check_density, facing, grid
from tests.support.light_probes import Probe, lit
from tests.support.small_scenes import glowing


def dome(count: int, seed: int = 0) -> edgegrad.Scene:
    """Many small lights of all finite kinds that don't hide each other from the origin, of very different power."""
    rng = np.random.default_rng(seed)
    lights: dict[str, Light] = {}
    meshes = {}
    for k in range(count):
        # A spiral of points, evenly over the upper hemisphere (golden angle).
        z = 0.15 + 0.8 * (k + 0.5) / count
        turn = 2.399963 * k
        at = np.array([math.sqrt(1 - z * z) * math.cos(turn), math.sqrt(1 - z * z) * math.sin(turn), z])
        distance = rng.uniform(1.0, 3.0)
        at = at * distance
        size, power = 0.5 * distance / math.sqrt(count), float(rng.lognormal(0.0, 1.5))
        target = ORIGIN + rng.normal(size=3) * 0.3
        kind = k % 4
        if kind == 0:
            lights[f"l{k}"] = edgegrad.PointLight(at, power, size, bool(k % 8))
        elif kind == 1:
            lights[f"l{k}"] = edgegrad.AreaLight(facing(at, target), np.array([size, 2 * size]), power=power)
        elif kind == 2:
            lights[f"l{k}"] = edgegrad.SpotLight(at, target - at, power, 1.0, 0.3, size, True)
        else:
            x, y = facing(at, target)[:3, 0], facing(at, target)[:3, 1]
            meshes[f"l{k}"] = edgegrad.Mesh(np.stack([at - x * size, at + x * size, at - y * size]),
                                            np.array([[0, 1, 2]], np.int32), ("hot",))  # fmt: skip
    lights["sun"] = edgegrad.SunLight(-np.array([0.0, 0.1, 1.0]), 0.3, 0.3)
    return lit(lights, meshes, {"hot": glowing(2.0, two_sided=True)})


@pytest.mark.parametrize("count", [8, 200])
def test_choice_follows_its_density(count: int) -> None:
    """Few lights are picked from a list, many down the tree: where samples land is what their density says."""
    probe = Probe(dome(count))
    check_density(probe, fine=50, rim=0.03)
    s = probe.sample(ORIGIN, UP, grid(64))
    on = s["radiance"][:, 0] > 0.0
    told = probe.density(ORIGIN, UP, s["w"].astype(np.float64))
    same = np.isclose(told, s["pdf"], rtol=1e-2) & on
    assert same.sum() > 0.97 * on.sum()  # the sun's disk or another light may lie in line


@pytest.mark.parametrize("count", [5, 300])
def test_probabilities_sum_to_one(count: int) -> None:
    rng = np.random.default_rng(1)
    at = rng.normal(size=(count, 3)) + (0, 0, 6.0)
    lights = {f"l{k}": edgegrad.PointLight(p, float(rng.lognormal(0, 2)), 1e-3, True) for k, p in enumerate(at)}
    probe = Probe(lit(lights))
    for point in rng.normal(size=(5, 3)):
        d = at - point
        r = np.linalg.norm(d, axis=1)
        solid_angle = 2 * np.pi * (1.0 - np.sqrt(1.0 - (1e-3 / r) ** 2))
        probability = probe.density(point, UP, d / r[:, None]) * solid_angle
        assert probability.min() > 0.0
        assert probability.sum() == pytest.approx(1.0, rel=0.02)  # lights may lie in line


def test_lights_that_cannot_matter_are_not_picked() -> None:
    lights = {
        "below": edgegrad.PointLight(np.array([0.0, 0.0, -1.0]), 1e6),
        "turned away": edgegrad.AreaLight(facing((0, 0, 1), (0, 0, 3)), np.ones(2), power=1e6),
        "beside the cone": edgegrad.SpotLight(np.array([2.0, 0, 1]), np.array([1.0, 0, 0]), 1e6, 0.5, 0.1),
        "off": edgegrad.PointLight(np.array([0.0, 1.0, 1.0]), 0.0),
        "this one": edgegrad.PointLight(AT, 1.0),
    }
    s = Probe(lit(lights)).sample(ORIGIN, UP, grid(32))
    np.testing.assert_allclose(s["geometry"], 1.0 / (AT @ AT), rtol=1e-5)  # its probability is 1

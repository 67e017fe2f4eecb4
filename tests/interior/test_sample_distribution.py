"""Derivatives of many samples: pixels in which the interior term has more variance take more of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import small_scenes
from tests.support.block_statistics import check, compare

SIZE, PATH = 24, "meshes.box.vertices"
# Fewer samples than these are the same in all pixels.
DISTRIBUTED = 512


@pytest.fixture(scope="module")
def glossy() -> edgegrad.Scene:
    """A glossy box under a rectangle, whose reflection covers few pixels."""
    small_scenes.need("native")
    scene = small_scenes.floating_box()
    scene.camera.width = scene.camera.height = SIZE
    scene.lights = {"area": scene.lights["area"]}
    shiny = edgegrad.Material(np.array([0.8, 0.8, 0.8]), metallic=1.0, roughness=0.4)
    scene.materials = {**scene.materials, "shiny": shiny}
    scene.meshes["box"].materials = ("shiny",) * len(scene.meshes["box"].materials)
    return scene


def tangent(scene: edgegrad.Scene) -> dict[str, Any]:
    return {PATH: np.broadcast_to([0.3, 0.1, 0.2], scene.meshes["box"].vertices.shape)}


def pictures(scene: edgegrad.Scene, spp: int, seeds: range) -> np.ndarray:
    renderer = Renderer(scene, threads=2)
    options: dict[str, Any] = {"spp": spp, "max_depth": 3, "terms": ["interior"]}
    found = [renderer.render_forward(tangent(scene), seed=seed, **options) for seed in seeds]
    return np.stack(found).astype(np.float64)


def test_the_mean_is_that_of_equal_numbers_and_the_variance_is_lower(glossy: edgegrad.Scene) -> None:
    many = pictures(glossy, DISTRIBUTED, range(12))
    equal = pictures(glossy, DISTRIBUTED // 2, range(100, 148))
    variance = equal.var(axis=0, ddof=1)
    check(compare(many, equal.mean(axis=0), np.sqrt(variance / len(equal))))
    assert many.var(axis=0, ddof=1).mean() < 0.7 * variance.mean() / 2.0


def test_both_modes_and_all_threads_take_the_same_samples(glossy: edgegrad.Scene) -> None:
    options: dict[str, Any] = {"spp": DISTRIBUTED, "max_depth": 3, "seed": 4}
    one, two = (Renderer(glossy, threads=n).render_forward(tangent(glossy), **options) for n in (1, 2))
    np.testing.assert_array_equal(one, two)
    adjoint = np.random.default_rng(2).normal(size=(SIZE, SIZE, 3))
    gradient = Renderer(glossy, threads=2).render_backward(adjoint, [PATH], **options)[PATH]
    image = adjoint * one
    assert abs(image.sum() - np.sum(gradient * tangent(glossy)[PATH])) <= 1e-4 * np.abs(image).sum()

"""Which paths derivatives record: those that have met nothing whose derivative is asked for add nothing."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Material
from edgegrad.renderer import Renderer
from tests import small_scenes


@pytest.mark.parametrize("max_depth", [2, 3, 6])
@pytest.mark.parametrize("name", ["floor", "clay"])
def test_paths_that_miss_a_material_add_nothing_to_its_gradient(name: str, max_depth: int) -> None:
    """Asked for alone, a colour's gradient is the one that it has among others, where all paths are recorded."""
    small_scenes.need("native")
    scene = small_scenes.floating_box()
    scene.materials["clay"] = Material(np.array([0.7, 0.3, 0.2]), metallic=0.5, roughness=0.4)
    renderer = Renderer(scene, threads=1)
    adjoint = np.random.default_rng(5).normal(size=(scene.camera.height, scene.camera.width, 3))
    path = f"materials.{name}.base_color"
    everything = [path, "materials.lamp.emission", "world.color"]
    options = {"spp": 8, "max_depth": max_depth, "seed": 3}
    alone = renderer.render_backward(adjoint, [path], **options)[path]
    among = renderer.render_backward(adjoint, everything, **options)[path]
    assert np.any(among)
    np.testing.assert_allclose(alone, among, rtol=2e-5)
    tangent = {path: np.array([1.0, 0.5, 2.0])}
    image = renderer.render_forward(tangent, **options)
    pushed, pulled = np.sum(adjoint * image), np.sum(alone * tangent[path])
    assert abs(pushed - pulled) <= 1e-4 * np.sum(np.abs(adjoint * image))

"""Forward and reverse mode of the native engine are transposes for every parameter of a scene."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Renderer
from edgegrad.rendering.engine import engine_class
from edgegrad.scene import parameters
from tests.support.rich_scene import everything
from tests.support.small_scenes import need
from tests.support.table_values import WITHOUT

SCENE = everything()
PATHS = [path for path in parameters.paths(SCENE) if not path.endswith(WITHOUT)]


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    need("native")
    if engine_class("native").narrow:
        pytest.skip("this engine differentiates few tables")
    return Renderer(SCENE, threads=2)


@pytest.mark.parametrize("path", PATHS)
def test_forward_and_reverse_are_transposes(renderer: Renderer, path: str) -> None:
    rng = np.random.default_rng(3)
    options = {"spp": 4, "max_depth": 3, "seed": 5}
    value = np.asarray(parameters.get(SCENE, path), np.float64)
    direction = rng.normal(size=value.shape) * (np.abs(value) + 0.1)
    image = renderer.render_forward({path: direction}, **options)
    adjoint = rng.normal(size=image.shape).astype(np.float32)
    gradient = renderer.render_backward(adjoint, [path], **options)[path]
    forward, reverse = float(np.vdot(image.astype(np.float64), adjoint)), float(np.vdot(gradient, direction))
    size = float(np.linalg.norm(image) * np.linalg.norm(adjoint))
    # The sum of many terms of both signs: rounding is relative to their size, not the sum's.
    assert abs(forward - reverse) <= 1e-4 * abs(forward) + 3e-5 * size

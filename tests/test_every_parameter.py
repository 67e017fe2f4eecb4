"""Forward and reverse mode of the native engine are transposes for every parameter of a scene."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Renderer, parameters
from edgegrad.engines import engine_class
from tests.rich_scene import everything
from tests.small_scenes import Floats, need
from tests.table_values import WITHOUT

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
    bound = 1e-4 * abs(forward) + 2e-5 * size
    if path.endswith("anisotropy_rotation"):
        # Parts of the derivative cancel as the lobe turns: rounding is what values differ by that are close together.
        near = [float(np.vdot(forward_at(renderer, path, value + k * 1e-7, direction, options), adjoint))
                for k in range(6)]
        bound = max(bound, float(np.ptp(near)))
    assert abs(forward - reverse) <= bound


def forward_at(renderer: Renderer, path: str, value: Floats, direction: Floats, options: dict[str, int]) -> Floats:
    """The derivative picture at another value of the parameter."""
    still = parameters.get(SCENE, path)
    parameters.put(SCENE, path, value)
    renderer.update([path])
    image = renderer.render_forward({path: direction}, **options).astype(np.float64)
    parameters.put(SCENE, path, still)
    renderer.update([path])
    return image

"""Derivatives of pictures beside differences of pictures of the same random numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from edgegrad import Renderer, Scene, parameters
from edgegrad.renderer import engine_class
from tests.small_scenes import Floats, need


def need_every_table() -> None:
    """Skip the test where the native engine can't be loaded or differentiates few tables."""
    need("native")
    if engine_class("native").narrow:
        pytest.skip("this engine differentiates few tables")


def compare(
    scene: Scene, path: str, direction: Any, step: float, *, one_sided: bool = False, seeds: int = 6, spp: int = 64,
    max_depth: int = 2,
) -> tuple[float, float, float]:
    """Difference quotient and derivative of a weighted sum over the picture, and the standard error of their gap.

    Parameters
    ----------
    direction
        Tangent of the parameter.
    step
        Of the difference: to both sides, or `one_sided` along the direction.
    """
    renderer = Renderer(scene, threads=2)
    value = np.array(parameters.get(scene, path), np.float64)
    rng = np.random.default_rng(1)
    weight = rng.uniform(0.5, 1.0, (*scene.camera.size, 3))

    def shifted(by: float, options: dict[str, Any]) -> Floats:
        parameters.put(scene, path, value + by * direction)
        renderer.update([path])
        return renderer.render(**options).astype(np.float64)

    found, exact = [], []
    for seed in range(seeds):
        options: dict[str, Any] = {"spp": spp, "max_depth": max_depth, "seed": seed}
        low = 0.0 if one_sided else -step
        difference = (shifted(step, options) - shifted(low, options)) / (step - low)
        shifted(0.0, options)
        found.append(float(np.sum(difference * weight)))
        exact.append(float(np.sum(renderer.render_forward({path: direction}, **options) * weight)))
    gap = np.subtract(found, exact)
    return float(np.mean(found)), float(np.mean(exact)), float(gap.std(ddof=1) / np.sqrt(seeds))

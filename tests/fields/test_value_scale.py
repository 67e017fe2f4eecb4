"""The scale of a field's values says nothing of its surface: neither the picture nor its derivatives depend on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad import AreaLight, Renderer, Scene, World
from tests.support.fields.splines import sampled, torus
from tests.support.small_scenes import camera, matte, need, rectangle

OPTIONS = {"spp": 8, "max_depth": 3, "seed": 3}


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def scene(factor: float) -> Scene:
    """A torus over a floor, with its values times `factor`, but for one that is far from its surface.

    The renderer sees values relative to the largest one.
    """
    field = sampled(torus, (20, 18, 16))
    values = (factor * field.values).astype(np.float32)
    values[0, 0, 0] = 2.0
    light = AreaLight(to_world=np.array([[1, 0, 0, 0.5], [0, 0, 1, 3.0], [0, -1, 0, 0.5], [0, 0, 0, 1.0]]),
                      size=np.array([0.8, 0.8]), power=60.0)  # fmt: skip
    floor = rectangle((0, -0.9, 0), (0, 0, 2), (2, 0, 0), "clay")
    return Scene(camera((0.5, 1.5, 3.0), (0, 0, 0), 16), {"floor": floor}, {"clay": matte(0.6, 0.5, 0.4)},
                 {"lamp": light}, World(np.full(3, 0.3)), fields={"body": replace(field, values=values)})  # fmt: skip


@pytest.mark.parametrize("exponent", [-30, -50])
@pytest.mark.parametrize("edges", ["outlines", "reparameterised", "relaxed"])
def test_values_may_have_any_scale(edges: str, exponent: int) -> None:
    """For powers of two, floats differ by their exponents alone, and results have the same bits."""
    factor = 2.0**exponent
    shift = np.zeros((4, 4))
    shift[:3, 3] = 1.0, 0.3, 0.2
    change = np.random.default_rng(0).normal(size=(20, 18, 16))
    results = []
    for k in (1.0, factor):
        renderer = Renderer(scene(k))
        results.append([
            renderer.render(**OPTIONS),
            renderer.render_forward({"fields.body.transform": shift}, field_edges=edges, **OPTIONS),
            renderer.render_forward({"fields.body.values": k * change}, field_edges=edges, **OPTIONS),
        ])  # fmt: skip
    for name, one, other in zip(("picture", "shift", "values"), *results, strict=True):
        assert np.any(one), name
        np.testing.assert_array_equal(one, other, err_msg=name)

"""The same seed gives the same bits in every call and for any number of threads, whatever terms run beside each other.

What one term leaves in a thread's memory must not reach the next one: how terms follow each other depends on the
number of threads, so that such a leak changes bits here.
"""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from edgegrad import Renderer
from tests import (
    test_emitter_outline,
    test_horizon,
    test_indirect_boundary,
    test_mirrored_shadows,
    test_pierced_lights,
    test_shadow_boundary,
    test_specular_boundary,
)
from tests.picture_differences import need_every_table
from tests.small_scenes import Make

DEPTH = 5
MODULES = (
    test_emitter_outline, test_horizon, test_indirect_boundary, test_mirrored_shadows, test_pierced_lights,
    test_shadow_boundary, test_specular_boundary,
)  # fmt: skip


def cases() -> dict[str, tuple[Make, list[str]]]:
    """Every fifth case of each kind of boundary, as a scene by theta and the parameters that move it."""
    found = {}
    for module in MODULES:
        for name, case in list(module.CASES.items())[::5]:
            make, paths = case if isinstance(case, tuple) else (case.make, [case.path])
            found[f"{module.__name__.removeprefix('tests.test_')}: {name}"] = (make, list(paths))
    return found


CASES = cases()


@pytest.mark.parametrize("name", list(CASES))
def test_bits_are_equal(name: str) -> None:
    need_every_table()
    make, paths = CASES[name]
    scene = make(0.0)
    rng = np.random.default_rng(1)
    adjoint = rng.standard_normal((*scene.camera.size, 3)).astype(np.float32)
    tangents = {path: rng.standard_normal(np.shape(edgegrad.parameters.get(scene, path))) for path in paths}
    options = {"spp": 4, "max_depth": DEPTH, "seed": 3}
    first = None
    for threads in (1, 2, 3):
        renderer = Renderer(scene, threads=threads)
        for _ in range(2):
            gradient = renderer.render_backward(adjoint, paths, **options)
            results = [*(gradient[path] for path in paths), renderer.render_forward(tangents, **options)]
            if first is None:
                first = results
            for result, wanted in zip(results, first, strict=True):
                np.testing.assert_array_equal(result, wanted)

"""Derivatives of random scenes are finite, the same in both modes, zero for zero tangents, and do not crash."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from numpy.typing import NDArray

from edgegrad import Renderer, Scene
from edgegrad.scene import parameters
from tests.stability.soups import paths_of, soups
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import Floats

OPTIONS = {"spp": 4, "max_depth": 4, "seed": 3}
# Rounding of both modes, relative to the sizes of what they sum. Turning a needle or a sharp lobe has parts of either
# sign, a thousand times as large as their sum.
ROUNDING = 2e-4


def check(scene: Scene) -> None:
    """Whether a scene's derivatives are sound; any warning fails it, that of a sample without finite value too."""
    rng = np.random.default_rng(1)
    paths = paths_of(scene)
    renderer = Renderer(scene, threads=2)
    assert np.isfinite(renderer.render(**OPTIONS)).all()
    tangent = {}
    for path in paths:
        value = np.asarray(parameters.get(scene, path), np.float64)
        tangent[path] = rng.normal(size=value.shape) * (np.abs(value).max(initial=0.0) * 0.1 + 1e-3)
    image = renderer.render_forward(tangent, **OPTIONS).astype(np.float64)
    assert np.isfinite(image).all()
    adjoint = rng.normal(size=image.shape).astype(np.float32)
    gradients = renderer.render_backward(adjoint, paths, **OPTIONS)
    for path in paths:
        assert np.isfinite(gradients[path]).all(), path
    parts = [gradients[path] * tangent[path] for path in paths]
    size = float(np.linalg.norm(image) * np.linalg.norm(adjoint)) + float(sum(np.abs(part).sum() for part in parts))
    gap = abs(float(np.vdot(image, adjoint)) - float(sum(part.sum() for part in parts)))
    assert gap <= ROUNDING * size or gap <= spread(scene, tangent, adjoint)
    nothing = renderer.render_backward(np.zeros_like(adjoint), paths, **OPTIONS)
    assert not any(nothing[path].any() for path in paths)


def spread(scene: Scene, tangent: Mapping[str, Floats], adjoint: NDArray[np.float32]) -> float:
    """What rounding of a scene's vertices changes: where corners' normals cancel within a face, it decides."""
    sums = []
    for _ in range(5):
        for mesh in scene.meshes.values():
            mesh.vertices = mesh.vertices * (1.0 + 1e-7)
        sums.append(float(np.vdot(Renderer(scene).render_forward(tangent, **OPTIONS).astype(np.float64), adjoint)))
    return float(np.ptp(sums))


def of_scenes(count: int) -> settings:
    """The same scenes in every run."""
    return settings(max_examples=count, derandomize=True, deadline=None, database=None, phases=[Phase.generate],
                    suppress_health_check=list(HealthCheck))  # fmt: skip


@given(soups())
@of_scenes(25)
def test_random_scenes_have_sound_derivatives(scene: Scene) -> None:
    need_every_table()
    check(scene)


@pytest.mark.slow
@given(soups())
@of_scenes(300)
def test_many_random_scenes_have_sound_derivatives(scene: Scene) -> None:
    need_every_table()
    check(scene)

"""Random fields beside dense marching: no brick that has a part of the surface is left out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edgegrad import Field
from tests.support.fields.rays import renderer_of, trace
from tests.support.fields.splines import march, points
from tests.support.small_scenes import need

# Steps of the reference in cells. The tracer may miss pairs of crossings that are nearer to each other.
STEP = 1.0 / 32.0
RAYS = 12

sizes = st.tuples(*[st.integers(4, 14)] * 3)


def random_field(seed: int, size: tuple[int, int, int], roughness: float) -> Field:
    """Noise on a ball, in a box that is sheared and scaled."""
    rng = np.random.default_rng(seed)
    smooth = np.linalg.norm(points(size), axis=-1) - 0.6
    values = ((1.0 - roughness) * smooth + roughness * rng.normal(size=size)).astype(np.float32)
    transform = np.eye(4)
    transform[:3, :3] += 0.3 * rng.normal(size=(3, 3))
    return Field(values, "clay", np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0]), transform)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), size=sizes, roughness=st.sampled_from([0.0, 0.1, 1.0]))
def test_rays_find_the_first_crossing(seed: int, size: tuple[int, int, int], roughness: float) -> None:
    need("native")
    field = random_field(seed, size, roughness)
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(RAYS, 3)).astype(np.float32).astype(float)
    low, high = field.corners().min(axis=0), field.corners().max(axis=0)
    starts = rng.uniform(low, high, (RAYS, 3)) - rng.choice([0.0, 2.0], (RAYS, 1)) * ways
    starts = starts.astype(np.float32).astype(float)
    renderer = renderer_of(field)
    found, hidden = trace(renderer, starts, ways), trace(renderer, starts, ways, True)
    np.testing.assert_array_equal(np.isfinite(found), hidden == 0.0)
    for k in range(RAYS):
        wanted = march(field, starts[k], ways[k], STEP)
        # The tracer may find pairs of crossings between two steps of the reference.
        to_grid = np.linalg.inv(field.grid_to_world()[:, :3])
        cells = float(np.linalg.norm(to_grid @ ways[k]))
        slack = 1e-3 / cells + 1e-5 * float(np.linalg.norm(starts[k]))
        if np.isinf(wanted) and np.isinf(found[k]):
            continue
        assert found[k] < wanted + slack, (k, found[k], wanted)
        if found[k] < wanted - slack:
            assert found[k] == pytest.approx(march(field, starts[k], ways[k], STEP / 64.0), abs=slack)

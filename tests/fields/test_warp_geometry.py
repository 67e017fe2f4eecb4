"""The warp of the picture by itself: it moves as outlines do, and its divergence is that of differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad import Field, _native
from tests.support.fields.splines import Floats, sampled, torus
from tests.support.picture_differences import need_every_table

# A camera on the z axis, whose rays (x, y, -1) turn by these vectors for each pixel.
ORIGIN, PIXEL = np.array([0.1, -0.2, 2.5]), 0.01
ACROSS = np.array([[PIXEL, 0.0, 0.0], [0.0, -PIXEL, 0.0]])
TURNED = np.array([[0.8, 0.1, 0.5, 0.1], [-0.3, 1.0, 0.2, 0.0], [-0.6, -0.2, 0.7, 0.1], [0.0, 0.0, 0.0, 1.0]])


@pytest.fixture(autouse=True)
def _native_engine() -> None:
    need_every_table()


def warps(field: Field, places: Floats, depth: Floats, pixels: float, least_curvature: float) -> dict[str, Floats]:
    rays = np.empty((len(places), 2, 3))
    rays[:, 0] = ORIGIN
    rays[:, 1] = [0.0, 0.0, -1.0] + places @ ACROSS
    found = _native.field_warps(field.values, np.ascontiguousarray(field.grid_to_world()), rays, depth, ACROSS, pixels,
                                least_curvature)
    return {name: value.astype(float) for name, value in found.items()}


@pytest.mark.parametrize("least_curvature", [0.0, 0.2], ids=["open band", "closing band"])
def test_the_divergence(least_curvature: float) -> None:
    """Differences of v = step dphi over the picture, for dphi = 1 and for linear changes of the field."""
    field = replace(sampled(torus, 32), transform=TURNED)
    rng = np.random.default_rng(5)
    places, depth = rng.uniform(-40.0, 40.0, (4000, 2)), np.full(4000, 2.5)
    middle = warps(field, places, depth, 8.0, least_curvature)
    slope = rng.normal(size=3)  # of the change dphi = 1 + slope . x

    def velocity(shift: Floats) -> tuple[Floats, Floats, Floats]:
        found = warps(field, places + shift, depth, 8.0, least_curvature)
        change = 1.0 + found["point"] @ slope
        return found["step"] * change[:, None], found["apart"], found["point"]

    h = 0.02
    numeric, inside = np.zeros(len(places)), np.abs(middle["apart"]) < 0.9
    inside &= np.abs(middle["apart"]) > 0.05  # the weight of the warp has a crease on the outline
    for axis in range(2):
        ahead, behind = velocity(h * np.eye(2)[axis]), velocity(-h * np.eye(2)[axis])
        numeric += (ahead[0] - behind[0])[:, axis] / (2.0 * h)
        for v, apart, point in (ahead, behind):
            del v
            inside &= (np.abs(apart) < 0.97) & (np.linalg.norm(point - middle["point"], axis=1) < 0.05)
    exact = middle["spread"] * (1.0 + middle["point"] @ slope) + middle["along"] @ slope
    assert np.count_nonzero(inside) > 200
    error = np.abs(numeric - exact)[inside] / (np.abs(exact)[inside] + np.median(np.abs(exact[inside])))
    assert np.median(error) < 1e-3
    assert np.quantile(error, 0.95) < 2e-2  # third derivatives jump between cells


def test_the_warp_on_the_outline() -> None:
    """There it is the velocity of the level set: v . grad phi* = -dphi."""
    field = replace(sampled(torus, 32), transform=TURNED)
    places, depth = np.random.default_rng(6).uniform(-40.0, 40.0, (20_000, 2)), np.full(20_000, 2.5)
    found = warps(field, places, depth, 8.0, 0.0)
    near = np.flatnonzero((np.abs(found["apart"]) < 0.01) & (np.abs(found["step"]).max(axis=1) > 0.0))
    assert len(near) > 10
    # For dphi = 1 the outline of the field with its coefficients raised by h is where phi* = -h was
    h = 1e-3
    raised = warps(replace(field, values=field.values + np.float32(h)), places[near] + h * found["step"][near],
                   depth[near], 8.0, 0.0)
    still = warps(replace(field, values=field.values + np.float32(h)), places[near], depth[near], 8.0, 0.0)
    moved = np.abs(still["apart"] - found["apart"][near])
    assert np.median(np.abs(raised["apart"] - found["apart"][near]) / moved) < 0.02

"""Splines on grids, finer and other grids, redistancing, and regularisers with their gradients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edgegrad import Field
from edgegrad.distance_fields import eikonal, laplacian, redistanced, refined, resampled, spline, sweeping
from edgegrad.distance_fields.regularisers import eikonal_of, laplacian_of
from tests.support.fields.solids import box_distance, nodes_of, ring_distance
from tests.support.fields.splines import evaluate, exact_sphere, points, sampled

shapes = st.tuples(*[st.integers(4, 11)] * 3)


@settings(max_examples=30, deadline=None)
@given(shape=shapes, seed=st.integers(0, 2**32 - 1))
def test_splines_interpolate(shape: tuple[int, int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    nodes = rng.normal(size=[n - 2 for n in shape])
    c = spline.coefficients(nodes)
    assert c.shape == shape
    np.testing.assert_allclose(spline.node_values(c), nodes, atol=1e-12)
    grid = np.stack(np.meshgrid(*[np.arange(n - 2.0) for n in shape], indexing="ij"), axis=-1)
    value, slope = spline.evaluate(c, grid.reshape(-1, 3))
    np.testing.assert_allclose(value, nodes.ravel(), atol=1e-12)
    np.testing.assert_allclose(slope, np.stack(spline.node_slopes(c), axis=-1).reshape(-1, 3), atol=1e-12)
    dual = [rng.normal(size=nodes.shape) for _ in range(3)]
    forward = sum(np.vdot(a, b) for a, b in zip(dual, spline.node_slopes(c), strict=True))
    assert np.vdot(spline.spread_slopes(dual), c) == pytest.approx(forward, abs=1e-10)


@pytest.mark.parametrize("size", [5, 6, 9])
def test_quadratic_functions_are_reproduced(size: int) -> None:
    grid = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij"), axis=-1).astype(float)
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(3, 3)), rng.normal(size=3)
    places = rng.uniform(0, size - 1, (100, 3))
    value, slope = spline.evaluate(spline.coefficients(np.einsum("...i,ij,...j", grid, a, grid) + grid @ b), places)
    np.testing.assert_allclose(value, np.einsum("ni,ij,nj->n", places, a, places) + places @ b, atol=1e-10)
    np.testing.assert_allclose(slope, places @ (a + a.T) + b, atol=1e-10)


@settings(max_examples=20, deadline=None)
@given(shape=shapes, seed=st.integers(0, 2**32 - 1))
def test_finer_grids_have_the_same_spline(shape: tuple[int, int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    c = rng.normal(size=shape)
    fine = spline.refined(c)
    at = rng.uniform(0, 1, (50, 3)) * (np.array(shape) - 3)
    for one, other, scale in zip(spline.evaluate(c, at), spline.evaluate(fine, 2 * at), (1.0, 2.0), strict=True):
        np.testing.assert_allclose(one, scale * other, atol=1e-11)
    dual = rng.normal(size=fine.shape)
    assert np.vdot(spline.coarsened_gradient(dual), c) == pytest.approx(np.vdot(dual, fine), abs=1e-9)


def test_other_grids() -> None:
    transform = np.eye(4)
    transform[:3] += np.random.default_rng(0).normal(size=(3, 4))
    field = exact_sphere(0.7, (14, 9, 11), transform=transform)
    world = (np.random.default_rng(1).uniform(-0.45, 0.45, (200, 3))) @ transform[:3, :3].T + transform[:3, 3]
    wanted = evaluate(field, world)[0]
    # The field is a quadratic polynomial, which every grid represents.
    for other in (refined(field), refined(field, 2), resampled(field, (7, 20, 5)),
                  resampled(field, (7, 8, 9), lower=(-0.5, -0.5, -0.5), upper=(0.5, 0.6, 0.7))):
        np.testing.assert_allclose(evaluate(other, world)[0], wanted, atol=1e-5)
    np.testing.assert_array_equal(refined(field).cells, 2 * field.cells)
    same = resampled(sampled(ring_distance, 20), (17, 17, 17))
    places = np.random.default_rng(2).uniform(-0.99, 0.99, (100, 3))
    np.testing.assert_allclose(evaluate(same, places)[0], evaluate(sampled(ring_distance, 20), places)[0], atol=2e-3)
    with pytest.raises(ValueError, match="within the field's box"):
        resampled(field, (8, 8, 8), lower=(-2, -2, -2))
    with pytest.raises(ValueError, match="refine it fewer times"):
        refined(Field(np.ones((600, 4, 4)), "clay"), 6)


@pytest.mark.parametrize("size", [(40, 40, 40), (34, 50, 40)])
@pytest.mark.parametrize("distance", [lambda p: np.linalg.norm(p, axis=-1) - 0.7, ring_distance])
def test_redistancing(size: tuple[int, int, int], distance: object) -> None:
    """A distorted field becomes the distance again, and its surface stays."""
    plain = sampled(distance, size, (-1.3,) * 3, (1.3,) * 3)
    places, _, _ = nodes_of(plain)
    h = float(((plain.upper - plain.lower) / plain.cells).max())
    d = distance(places)
    bent = spline.coefficients(d * (2.0 + np.sin(3.0 * places[..., 0])) * (1.0 + d**2))
    field = replace(plain, values=bent.astype(np.float32))
    found = redistanced(field)
    new = nodes_of(found)[1]
    near = np.abs(d) < 1.4 * h
    np.testing.assert_allclose(new[near], d[near], atol=0.06 * h)
    np.testing.assert_allclose(new, d, atol=1.5 * h)
    np.testing.assert_array_equal(new < 0.0, nodes_of(field)[1] < 0.0)
    twice = nodes_of(redistanced(found))[1]
    np.testing.assert_allclose(twice[near], new[near], atol=0.06 * h)
    assert eikonal(found)[0] < 0.01 < eikonal(field)[0]


def test_redistancing_again_and_again_moves_little() -> None:
    field = sampled(ring_distance, 40, (-1.3,) * 3, (1.3,) * 3)
    rng = np.random.default_rng(0)
    a, b = rng.uniform(0, 2 * np.pi, (2, 500))
    at = np.stack([np.cos(a) * (0.7 + 0.3 * np.cos(b)), np.sin(a) * (0.7 + 0.3 * np.cos(b)), 0.3 * np.sin(b)], axis=1)
    before = evaluate(field, at)[0]
    for _ in range(20):
        field = redistanced(field)
    np.testing.assert_allclose(evaluate(field, at)[0], before, atol=0.1 * 2.6 / 37)


def test_fields_without_a_surface_cannot_be_redistanced() -> None:
    for sign, word in ((1.0, "positive"), (-1.0, "negative")):
        with pytest.raises(ValueError, match=f"no surface: it is {word}"):
            redistanced(Field(np.full((8, 8, 8), sign), "clay"))


@pytest.mark.parametrize("spacing", [(0.1, 0.1, 0.1), (0.05, 0.1, 0.17)])
def test_sweeping(spacing: tuple[float, float, float]) -> None:
    """Exact along axes from a plane; to first order from a box; all nodes are reached."""
    h = np.array(spacing)
    places = (np.stack(np.meshgrid(*[np.arange(24)] * 3, indexing="ij"), axis=-1) - 11.5) * h
    plane = np.abs(places[..., 1] - 0.013)
    found = sweeping.distances(np.where(plane < 0.1, plane, np.inf), h)
    np.testing.assert_allclose(found, plane, atol=1e-12)
    wanted = box_distance(places, 0.25)
    known = np.where(np.abs(wanted) < 1.5 * h.max(), np.abs(wanted), np.inf)
    np.testing.assert_allclose(sweeping.distances(known, h), np.abs(wanted), atol=1.5 * h.max())
    assert np.isinf(sweeping.distances(np.full((4, 4, 4), np.inf), h)).all()


@pytest.mark.parametrize("function", [laplacian_of, eikonal_of])
@pytest.mark.parametrize("shape", [(4, 4, 4), (5, 6, 7)])
def test_gradients_of_regularisers(function: object, shape: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(0)
    h, c = np.array([0.1, 0.2, 0.3]), rng.normal(size=shape)
    _, gradient = function(c, h)
    for _ in range(5):
        way = rng.normal(size=shape)
        slope = function(c + 1e-30j * way, h)[0].imag / 1e-30
        assert np.vdot(gradient, way) == pytest.approx(slope, rel=1e-12)


def test_values_of_regularisers() -> None:
    """A plane that is a distance has neither; a quadratic function has a constant Laplacian."""
    normal = np.array([0.36, 0.48, 0.8])
    flat = sampled(lambda p: p @ normal - 0.1, (8, 9, 10))
    assert laplacian(flat)[0] < 1e-9 and eikonal(flat)[0] < 1e-9
    twice = replace(flat, values=2.0 * flat.values)
    assert eikonal(twice)[0] == pytest.approx((4.0 - 1.0) ** 2 / 4.0, rel=1e-4)
    bowl = Field(np.sum(points((10, 10, 10)) ** 2, axis=-1), "clay")
    assert laplacian(bowl)[0] == pytest.approx((6.0 * 2.0 / 7.0) ** 2, rel=1e-4)
    for function in (laplacian, eikonal):
        value, gradient = function(exact_sphere(0.5))
        assert isinstance(value, float) and gradient.shape == (16, 16, 16)

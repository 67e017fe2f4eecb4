"""Hits and normals of spheres, planes and tori, up to the rounding of single precision."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.fields.rays import probed, renderer_of, trace
from tests.support.fields.splines import Floats, evaluate, exact_sphere, march, sampled, torus
from tests.support.small_scenes import need

SIZES = [16, (5, 9, 30)]


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def rays(count: int, seed: int = 0, reach: float = 0.7) -> tuple[Floats, Floats]:
    """Rays from a sphere of radius 3 towards points near the centre."""
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(count, 3))
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    ways = rng.uniform(-reach, reach, (count, 3)) - origins
    return origins.astype(np.float32).astype(float), (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(
        np.float32).astype(float)


def distance_to_sphere(origins: Floats, ways: Floats, radius: float) -> Floats:
    """Distances to a sphere around the world's origin; inf for misses."""
    b, square = np.sum(origins * ways, axis=1), np.sum(ways**2, axis=1)
    below = b**2 - square * (np.sum(origins**2, axis=1) - radius**2)
    with np.errstate(invalid="ignore"):
        return np.where(below > 0.0, (-b - np.sqrt(below)) / square, np.inf)


@pytest.mark.parametrize("size", SIZES)
def test_rays_hit_a_sphere(size: int | tuple[int, int, int]) -> None:
    origins, ways = rays(4000)
    wanted = distance_to_sphere(origins, ways, 0.8)
    found = trace(renderer_of(exact_sphere(0.8, size)), origins, ways)
    # A ray that grazes the sphere at a depth of rounding may hit or miss it.
    depth = np.linalg.norm(np.cross(ways, origins), axis=1) / np.linalg.norm(ways, axis=1) - 0.8
    sure = np.abs(depth) > 1e-5
    np.testing.assert_array_equal(np.isfinite(found[sure]), np.isfinite(wanted[sure]))
    hit = sure & np.isfinite(wanted)
    assert hit.mean() > 0.4
    slant = np.sqrt(np.maximum(1.0 - (np.linalg.norm(np.cross(ways, origins), axis=1) / 0.8) ** 2, 1e-4))
    assert np.all(np.abs(found[hit] - wanted[hit]) * slant[hit] < 2e-6)
    np.testing.assert_array_equal(trace(renderer_of(exact_sphere(0.8, size)), origins, ways, True) == 0.0,
                                  np.isfinite(found))


@pytest.mark.parametrize("size", SIZES)
def test_rays_from_inside_hit_the_sphere(size: int | tuple[int, int, int]) -> None:
    rng = np.random.default_rng(2)
    origins, ways = rng.uniform(-0.3, 0.3, (1000, 3)), rng.normal(size=(1000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    found = trace(renderer_of(exact_sphere(0.8, size)), origins, ways)
    np.testing.assert_allclose(np.linalg.norm(origins + found[:, None] * ways, axis=1), 0.8, atol=1e-6)


def test_positions_and_normals_of_a_sphere() -> None:
    origins, ways = rays(60, 3)
    field = exact_sphere(0.8)
    wanted = distance_to_sphere(origins, ways, 0.8)
    hit = np.isfinite(wanted)
    position, normal = probed(field, origins, ways, "POSITION"), probed(field, origins, ways, "NORMAL")
    np.testing.assert_array_equal(np.isfinite(position[:, 0]), hit)
    place = origins + np.where(hit, wanted, 0.0)[:, None] * ways
    np.testing.assert_allclose(position[hit], place[hit], atol=3e-4)  # the size of the pixel
    np.testing.assert_allclose(np.linalg.norm(position[hit], axis=1), 0.8, atol=1e-6)
    np.testing.assert_allclose(normal[hit], position[hit] / 0.8, atol=3e-5)


def test_a_placed_field() -> None:
    """A mirrored, turned, unevenly scaled sphere far from the origin: an ellipsoid with its outward normals."""
    rng = np.random.default_rng(5)
    transform = np.eye(4)
    transform[:3, :3] = rng.normal(size=(3, 3)) @ np.diag([1.0, -2.0, 0.5])
    transform[:3, 3] = 100.0, -50.0, 20.0
    if np.linalg.det(transform[:3, :3]) > 0.0:
        transform[:3, 0] *= -1.0
    field = exact_sphere(0.8, 16, transform=transform)
    own_origins, own_ways = rays(400, 6)
    linear, shift = transform[:3, :3], transform[:3, 3]
    origins = (own_origins @ linear.T + shift).astype(np.float32).astype(float)
    ways = (own_ways @ linear.T).astype(np.float32).astype(float)
    inverse = np.linalg.inv(linear)
    wanted = distance_to_sphere((origins - shift) @ inverse.T, ways @ inverse.T, 0.8)
    found = trace(renderer_of(field), origins, ways)
    both = np.isfinite(wanted) & np.isfinite(found)
    assert np.mean(np.isfinite(wanted) != np.isfinite(found)) < 0.01 and both.mean() > 0.4
    place = ((origins + found[:, None] * ways)[both] - shift) @ inverse.T
    np.testing.assert_allclose(np.linalg.norm(place, axis=1), 0.8, atol=1e-4)


def test_rays_hit_a_plane_once() -> None:
    """The spline of linear coefficients is linear. A plane that lies in faces of cells and bricks is hit too."""
    for offset in (0.0, 0.25, 0.1234):
        field = sampled(lambda p, at=offset: p[..., 2] - at, (11, 11, 19), upper=(1, 1, 1))
        rng = np.random.default_rng(1)
        target = np.concatenate([rng.uniform(-0.99, 0.99, (2000, 2)), np.full((2000, 1), offset)], axis=1)
        way = rng.normal(size=(2000, 3))
        way[:, 2] += np.sign(way[:, 2]) * 0.3
        found = trace(renderer_of(field), target - way, way)
        # Slanted rays may enter the box below the plane and leave it there; this one is hit within the box.
        np.testing.assert_allclose(found, 1.0, atol=2e-6)


def test_rays_hit_a_torus() -> None:
    field = sampled(torus, 40)
    origins, ways = rays(1500, 8)
    found = trace(renderer_of(field), origins, ways)
    hit = np.isfinite(found)
    assert hit.mean() > 0.5
    value, gradient = evaluate(field, (origins + np.where(hit, found, 0.0)[:, None] * ways)[hit])
    slope = np.abs(np.sum(gradient * ways[hit], axis=1))
    assert np.all(np.abs(value) < 4e-7 * (1.0 + 3.0 * slope) + 1e-6)
    for k in range(0, 1500, 15):
        wanted = march(field, origins[k], ways[k], 1.0 / 64.0)
        assert found[k] == pytest.approx(wanted, abs=2e-5) or (np.isinf(wanted) and np.isinf(found[k]))


def test_no_surface() -> None:
    origins, ways = rays(100)
    for sign in (1.0, -1.0):
        renderer = renderer_of(sampled(lambda p, s=sign: np.full(p.shape[:3], s), 8))
        assert np.all(np.isinf(trace(renderer, origins, ways)))
        assert np.all(np.isinf(trace(renderer, np.zeros_like(ways), ways)))
        np.testing.assert_array_equal(renderer.render(spp=1), 1.0)


def test_a_field_that_is_zero_has_no_surface() -> None:
    assert np.all(np.isinf(trace(renderer_of(sampled(lambda p: np.zeros(p.shape[:3]), 8)), *rays(100))))


def test_a_surface_that_leaves_the_box_ends_there() -> None:
    """A sphere larger than the box is open: rays enter by the box's faces and see its inside."""
    field = exact_sphere(1.2, 16)
    inside = trace(renderer_of(field), [[0.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]])
    assert np.isinf(inside[0])
    corner = trace(renderer_of(field), [[0.9, 0.9, 3.0]], [[0.0, 0.0, -1.0]])
    assert np.isinf(corner[0])  # beyond the sphere all along
    slanted = trace(renderer_of(field), [[0.0, 0.0, 0.0]], [[1.0, 1.0, 1.0]])
    assert slanted[0] == pytest.approx(1.2 / np.sqrt(3.0), abs=1e-6)


def test_thin_sheets_are_hit() -> None:
    """Two parallel planes a twentieth of a cell apart: a quadratic polynomial, which the spline reproduces."""
    cell = 2.0 / 29.0
    smoothed, half = cell**2 * (1.0 + 0.09) / 3.0, 0.025 * cell
    field = sampled(lambda p: (p[..., 2] - 0.3 * p[..., 0]) ** 2 - smoothed - half**2, 32)
    rng = np.random.default_rng(4)
    target = rng.uniform(-0.8, 0.8, (3000, 3))
    target[:, 2] = 0.3 * target[:, 0]
    way = np.array([0.0, 0.0, -1.0]) + rng.uniform(-0.5, 0.5, (3000, 3))
    found = trace(renderer_of(field), target - 2.0 * way, way)
    np.testing.assert_allclose(found, 2.0, atol=0.01)

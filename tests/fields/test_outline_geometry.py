"""Outlines of distance fields by themselves: their points, their lengths, and their cover without gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.fields.outline_probes import length, outline, surface, unmatched, volume
from tests.support.fields.splines import evaluate, exact_sphere, sampled, torus
from tests.support.picture_differences import need_every_table


@pytest.fixture(autouse=True)
def _native_engine() -> None:
    need_every_table()


@pytest.mark.parametrize("distance", [0.9, 1.5, 20.0])
@pytest.mark.parametrize("size", [9, 24])
def test_sphere(distance: float, size: int) -> None:
    """A circle, whatever the grid."""
    radius, way = 0.7, np.array([0.3, -0.5, 0.8])
    way /= np.linalg.norm(way)
    found = outline(exact_sphere(radius, size), distance * way)
    assert np.all(found["sign"] != 0.0)
    ring = radius * np.sqrt(1.0 - (radius / distance) ** 2)
    along = found["position"] @ way
    assert np.allclose(along, radius**2 / distance, atol=2e-6)
    across = np.linalg.norm(found["position"] - along[..., None] * way, axis=-1)
    assert np.allclose(across, ring, atol=2e-6)
    assert length(found) == pytest.approx(2 * np.pi * ring, rel=1e-5)
    assert unmatched(found["ends"]) == 0


def test_an_affine_map_keeps_the_outline() -> None:
    """An ellipsoid that is turned and mirrored: its points are tangent to rays, and its segments are closed."""
    transform = np.array([[-1.2, 0.3, 0.0, 0.2], [0.2, 0.6, 0.5, -0.1], [0.1, -0.4, 0.9, 0.3], [0, 0, 0, 1.0]])
    field = exact_sphere(0.7, 20, transform=transform)
    viewer = np.array([1.5, -2.0, 1.0])
    found = outline(field, viewer)
    value, gradient = evaluate(field, found["position"].reshape(-1, 3))
    v = found["position"].reshape(-1, 3) - viewer
    assert np.max(np.abs(value)) < 1e-5
    assert np.max(np.abs(np.sum(gradient * v, axis=-1))) < 1e-4
    assert unmatched(found["ends"]) == 0


def test_torus_from_its_axis() -> None:
    """Two circles: the outer one, and that of the hole."""
    major, minor, height = 0.55, 0.25, 2.0
    found = outline(sampled(torus, 67), np.array([0.0, 0.0, height]))
    # Tangents from (0, height) to the circle about (major, 0) in the plane of (distance from the axis, z)
    distance = np.hypot(major, height)
    to_eye, turn = np.arctan2(height, -major), np.arccos(minor / distance)
    rings = [major + minor * np.cos(to_eye + s * turn) for s in (-1, 1)]
    assert length(found) == pytest.approx(2 * np.pi * sum(rings), rel=2e-3)
    at = np.linalg.norm(found["position"][found["sign"] != 0][:, :2], axis=-1)
    assert np.all(np.min(np.abs(at[:, None] - np.array(rings)), axis=1) < 2e-3)
    assert unmatched(found["ends"]) == 0


@pytest.mark.parametrize("size", [20, 43])
def test_cover_of_a_torus(size: int) -> None:
    """Seen at an angle: the outline has cusps. Other fractions of the segments give the same length."""
    field, viewer = sampled(torus, size), np.array([0.6, -2.0, 1.1])
    found = outline(field, viewer)
    fine = outline(field, viewer, np.linspace(0.005, 0.995, 100))
    speed = fine["sign"] * np.linalg.norm(fine["tangent"], axis=-1)
    assert length(found) == pytest.approx(float(np.sum(speed) / 100), rel=0.01)
    value, gradient = evaluate(field, fine["position"][fine["sign"] != 0])
    v = fine["position"][fine["sign"] != 0] - viewer
    assert np.max(np.abs(value)) < 1e-5
    assert np.max(np.abs(np.sum(gradient * v, axis=-1))) < 1e-4
    # Neighbouring segments meet in the same point: the ends' own points are the ends
    ends = outline(field, viewer, np.array([0.0, 1.0]))
    gap = np.linalg.norm(ends["position"] - ends["ends"], axis=-1)[ends["sign"] != 0]
    assert np.max(gap) < 1e-5


def test_memory_grows_with_the_surface() -> None:
    segments = [len(outline(sampled(torus, n), np.array([0.6, -2.0, 1.1]))["ends"]) for n in (20, 37, 71)]
    assert 1.5 < segments[1] / segments[0] < 2.7
    assert 1.5 < segments[2] / segments[1] < 2.7


def test_threads() -> None:
    field, viewer = sampled(torus, 24), np.array([0.6, -2.0, 1.1])
    one = outline(field, viewer, threads=1)
    for threads in (2, 5):
        other = outline(field, viewer, threads=threads)
        assert all(np.array_equal(one[name], other[name]) for name in one)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("size", [9, 24])
def test_patches_cover_a_sphere(size: int, mirror: float) -> None:
    """Area, and volume by the divergence theorem, whatever the grid."""
    radius = 0.7
    found = surface(replace(exact_sphere(radius, size), transform=np.diag([mirror, 1.0, 1.0, 1.0])))
    assert np.all(found["area"] != 0.0)
    assert np.allclose(np.linalg.norm(found["position"], axis=-1), radius, atol=2e-6)
    assert np.allclose(found["normal"], found["position"] / radius, atol=1e-5)
    assert found["area"].sum() == pytest.approx(4 * np.pi * radius**2, rel=5e-4)


def test_patches_cover_a_stretched_torus() -> None:
    """A closed surface: the integral of its normal vanishes, and its volume scales with the transform."""
    transform = np.array([[0.8, 0.1, 0.5, 0.1], [-0.3, 1.0, 0.2, 0.0], [-0.6, -0.2, 0.7, 0.1], [0.0, 0.0, 0.0, 1.0]])
    volumes = []
    for placed in (np.eye(4), transform):
        found = surface(replace(sampled(torus, 28), transform=placed))
        assert np.all(found["area"] != 0.0)
        by_normal = found["area"][..., None] * found["normal"]
        assert np.allclose(by_normal.sum(axis=(0, 1)), 0.0, atol=1e-3)
        volumes.append(volume(found))
    assert volumes[1] == pytest.approx(volumes[0] * np.linalg.det(transform), rel=1e-4)

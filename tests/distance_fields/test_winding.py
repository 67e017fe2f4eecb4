"""Winding numbers beside the sum of all solid angles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edgegrad import Mesh
from edgegrad.distance_fields.closest import near_distances, nearest, pieces
from edgegrad.distance_fields.winding import Surface, solid_angles
from edgegrad.geometry.topology import weld
from tests.support.fields.solids import ball, box, box_distance, joined, ring, solid, without

N = 20


def closed(mesh: Mesh) -> Surface:
    """A mesh in the middle of a grid of N nodes along each axis."""
    label = weld(mesh.vertices)
    vertices = mesh.vertices[np.unique(label, return_index=True)[1]]
    scale = (N - 9) / np.ptp(vertices, axis=0).max()
    return Surface.closed((vertices - vertices.min(axis=0)) * scale + 4.0, label[mesh.faces])


def summed(surface: Surface, points: np.ndarray) -> np.ndarray:
    corner = surface.vertices[surface.faces]
    return np.concatenate([solid_angles(part, corner).sum(axis=1) for part in np.array_split(points, 40)]) / (4 * np.pi)


MESHES = {
    "ball": ball(2), "box on nodes": box(), "open box on nodes": without(box(), slice(0, 2)),
    "ball with holes": without(ball(3), np.arange(768) % 97 < 5), "two bodies": joined(ball(2), ring(), box(0.5)),
    "soup": solid(np.random.default_rng(1).normal(size=(60, 3)), np.arange(60).reshape(20, 3)),
    "sheet": solid(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])),
    "crowded edge": joined(box(), solid(np.array([[1.0, 1, -1], [1, 1, 1], [2, 2, 0]]), np.array([[0, 1, 2]]))),
}  # fmt: skip


@pytest.mark.parametrize("name", MESHES)
def test_winding_numbers(name: str) -> None:
    surface = closed(MESHES[name])
    nodes = np.stack(np.meshgrid(*[np.arange(N)] * 3, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
    on = np.isfinite(near_distances(pieces(surface.vertices[surface.faces])[0], (N, N, N), 1e-9)).ravel()
    found = surface.at_nodes((N, N, N)).ravel()
    np.testing.assert_allclose(found[~on], summed(surface, nodes)[~on], atol=2e-5)
    points = np.random.default_rng(0).uniform(0, N, (800, 3))
    np.testing.assert_allclose(surface.at_points(points), summed(surface, points), atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12), whole=st.booleans())
def test_any_triangles(seed: int, count: int, whole: bool) -> None:
    """Also with corners on nodes, faces without area, and edges that many share."""
    rng = np.random.default_rng(seed)
    vertices = rng.integers(1, N - 1, (7, 3)).astype(float) if whole else rng.uniform(1, N - 1, (7, 3))
    surface = Surface.closed(vertices, rng.integers(0, 7, (count, 3)))
    points = rng.uniform(0, N, (200, 3))
    np.testing.assert_allclose(surface.at_points(points), summed(surface, points), atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), size=st.sampled_from([0.1, 1.0, 30.0]))
def test_nearest_places(seed: int, size: float) -> None:
    """Beside the distances of a fine sample of each triangle."""
    rng = np.random.default_rng(seed)
    corner = rng.normal(size=(6, 1, 3)) + size * rng.normal(size=(6, 3, 3))
    points = rng.normal(size=(20, 3)) * (1.0 + size)
    face, weight, distance = nearest(points, corner)
    place = np.einsum("nk,nkj->nj", weight, corner[face])
    np.testing.assert_allclose(np.linalg.norm(points - place, axis=1), distance, atol=1e-12)
    assert weight.min() >= -1e-12
    np.testing.assert_allclose(weight.sum(axis=1), 1.0)
    a, b = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 41)))
    a, b = a[a + b <= 1.0], b[a + b <= 1.0]
    sample = np.einsum("sk,mkj->smj", np.stack([1 - a - b, a, b], axis=1), corner).reshape(-1, 3)
    least = np.min(np.linalg.norm(points[:, None] - sample, axis=2), axis=1)
    assert np.all(distance <= least + 1e-9)
    assert np.all(distance >= least - 0.2 * size)


def test_nearest_on_a_box() -> None:
    mesh = box()
    points = np.random.default_rng(0).normal(size=(3000, 3)) * 2.0
    _, _, distance = nearest(points, mesh.vertices[mesh.faces])
    np.testing.assert_allclose(distance, np.abs(box_distance(points)), atol=1e-12)

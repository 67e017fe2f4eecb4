"""Fields of meshes beside distances in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edgegrad import Mesh
from edgegrad.distance_fields import from_mesh, spline, to_mesh, topology
from tests.support.fields.solids import ball, box, box_distance, joined, nodes_of, ring, ring_distance, solid, without


def test_distances_from_a_box_are_exact_near_it() -> None:
    places, values, h = nodes_of(from_mesh(box(), 32))
    wanted = box_distance(places)
    near = np.abs(wanted) < 1.99 * h
    np.testing.assert_allclose(values[near], wanted[near], atol=1e-6 * h)
    np.testing.assert_allclose(values, wanted, atol=0.9 * h)
    np.testing.assert_array_equal(values < -1e-6 * h, wanted < -1e-6 * h)


def test_distances_from_a_ring() -> None:
    mesh = ring(around=200, across=100)
    places, values, h = nodes_of(from_mesh(mesh, 48))
    wanted = ring_distance(places)
    near = np.abs(wanted) < 1.9 * h
    chord = 1.0 * (1.0 - np.cos(np.pi / 200)) + 0.3 * (1.0 - np.cos(np.pi / 100))
    np.testing.assert_allclose(values[near], wanted[near], atol=chord + 1e-6)
    np.testing.assert_allclose(values, wanted, atol=0.8 * h)


def test_a_field_of_its_own_box() -> None:
    """The surface of the spline is where the distance is 0, also between the nodes."""
    field = from_mesh(ball(5), (40, 48, 44), lower=(-1.25, -1.5, -1.375), upper=(1.25, 1.5, 1.375), material="glass")
    assert field.material == "glass"
    np.testing.assert_array_equal(field.cells, [40, 48, 44])
    rng = np.random.default_rng(0)
    points = rng.normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    value, slope = spline.evaluate(field.values, (points - field.lower) / 0.0625)
    chord = 4e-3  # between the ball's faces and the sphere
    np.testing.assert_allclose(value, 0.5 * chord, atol=0.5 * chord + 2e-4)
    np.testing.assert_allclose(slope / 0.0625, points, atol=0.05)


def test_a_hole_is_closed() -> None:
    mesh = ball(4)
    hole = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] > 0.95
    field = from_mesh(without(mesh, hole), 40)
    places, values, h = nodes_of(field)
    wanted = np.linalg.norm(places, axis=-1) - 1.0
    away = (places[..., 2] < 0.8) & (np.abs(wanted) < 1.9 * h)
    np.testing.assert_allclose(values[away], wanted[away], atol=0.02)
    found = topology(to_mesh(field))
    assert (found.components, found.genus) == (1, 0)
    # Within the hole the surface is smooth, between the border's plane and the sphere.
    top = to_mesh(field).vertices
    top = top[np.hypot(top[:, 0], top[:, 1]) < 0.2]
    top = top[top[:, 2] > 0.0]
    assert np.all((top[:, 2] > 0.9) & (top[:, 2] < 1.02))
    slope = np.linalg.norm(np.stack(spline.node_slopes(field.values.astype(float)), -1), axis=-1) / h
    at = (places[..., 2] > 0.85) & (np.abs(values) < h)
    assert np.quantile(np.abs(slope[at] - 1.0), 0.95) < 0.35  # the border itself is a crease


@pytest.mark.filterwarnings("ignore:from_mesh. about")  # the rim
@pytest.mark.parametrize("height", [0.95, 0.7, 0.3])
def test_no_jump_in_a_hole(height: float) -> None:
    """A distance never changes by more than the way between two nodes: also across the surface that closes a hole."""
    mesh = ball(4)
    field = from_mesh(without(mesh, mesh.vertices[mesh.faces].mean(axis=1)[:, 2] > height), 40)
    _, values, h = nodes_of(field)
    for axis in range(3):
        assert np.abs(np.diff(values, axis=axis)).max() < 1.15 * h


def test_overlaps_and_walls_within_have_no_surface() -> None:
    """Two balls that overlap are one body: where each lies in the other, there is no distance to it."""
    field = from_mesh(joined(ball(4), ball(4, centre=(0.8, 0.0, 0.0)), ball(3, 0.3)), 48)
    places, values, h = nodes_of(field)
    inner = np.linalg.norm(places - [0.4, 0.0, 0.0], axis=-1) < 0.5
    assert values[inner].max() < -0.35
    found = topology(to_mesh(field))
    assert (found.components, found.genus) == (1, 0)
    one, other = (np.linalg.norm(places - [x, 0.0, 0.0], axis=-1) - 1.0 for x in (0.0, 0.8))
    wanted = np.minimum(one, other)  # exact outside
    near = (wanted > 0.0) & (wanted < 1.9 * h)
    np.testing.assert_allclose(values[near], wanted[near], atol=0.01)


def test_faces_twice_change_nothing() -> None:
    mesh = ball(3)
    once = from_mesh(mesh, 24).values
    np.testing.assert_array_equal(from_mesh(solid(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[:99]])),
                                            24).values, once)  # fmt: skip
    # Loose corners: each face with vertices of its own.
    loose = solid(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))
    np.testing.assert_allclose(from_mesh(loose, 24).values, once, atol=1e-6)
    # A sheet with two sides within the body encloses nothing.
    sheet = np.array([[-0.5, -0.5, 0.1], [0.5, -0.5, 0.1], [0.0, 0.5, 0.1]])
    both = joined(mesh, solid(sheet, np.array([[0, 1, 2], [2, 1, 0]])))
    np.testing.assert_allclose(from_mesh(both, 24).values, once, atol=1e-6)


def test_transforms_are_applied() -> None:
    mesh = ball(3)
    mesh.transform = np.diag([2.0, 2.0, 2.0, 1.0])
    mesh.transform[:3, 3] = [5.0, 6.0, 7.0]
    field, plain = from_mesh(mesh, 24), from_mesh(ball(3), 24)
    np.testing.assert_allclose(field.lower, 2.0 * plain.lower + [5.0, 6.0, 7.0])
    values, wanted, h = nodes_of(field)[1], 2.0 * nodes_of(plain)[1], nodes_of(field)[2]
    near = np.abs(wanted) < 1.9 * h
    np.testing.assert_allclose(values[near], wanted[near], atol=1e-5)


@pytest.mark.filterwarnings("ignore:from_mesh. about")  # sharp notches between boxes
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4))
def test_random_balls_and_boxes(seed: int, count: int) -> None:
    """Signs are those of the union, wherever the surface is more than a rounding away."""
    rng = np.random.default_rng(seed)
    parts, inside = [], []
    for _ in range(count):
        centre, size = rng.uniform(-1.0, 1.0, 3), rng.uniform(0.4, 1.0)
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        frame *= np.sign(np.linalg.det(frame))
        mesh = box(2.0 * size)
        parts.append(solid(mesh.vertices @ frame.T + centre, mesh.faces))
        inside.append((centre, size, frame))
    places, values, h = nodes_of(from_mesh(joined(*parts), 24))
    distance = np.min([box_distance((places - c) @ f, s) for c, s, f in inside], axis=0)
    sure = np.abs(distance) > 1e-6
    np.testing.assert_array_equal((values < 0.0)[sure], (distance < 0.0)[sure])
    near = (distance > 0.0) & (distance < 1.9 * h)
    np.testing.assert_allclose(values[near], distance[near], atol=0.1 * h)
    assert np.mean(np.abs(values[near] - distance[near]) < 1e-5) > 0.97


@pytest.mark.parametrize(("mesh", "options", "words"), [
    (Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), ("clay",)), {}, "is empty"),
    (solid(np.zeros((3, 3)), np.array([[0, 1, 2]])), {}, "at one place"),
    (solid(np.array([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])), {}, "non-finite"),
    (solid(box().vertices, box().faces[:, ::-1]), {}, "encloses nothing.*turn its faces"),
    (solid(np.eye(3), np.array([[0, 1, 2]])), {}, "encloses nothing"),
    (box(), {"cells": 8}, "cells must be between 16"),
    (box(), {"cells": 64, "most_memory": 1e6}, "GB, more than most_memory"),
    (box(), {"cells": (8, 8, 8), "lower": (-1, -1, -1), "upper": (1, 1, 1)}, "leaves the grid"),
    (box(), {"cells": (8, 8, 8), "lower": (-2, -2, -2)}, "give both or none"),
    (box(), {"cells": (8, 8, 9), "lower": (-2, -2, -2), "upper": (2, 2, 2)}, "must be cubes"),
])  # fmt: skip
def test_errors(mesh: Mesh, options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words) as found:
        from_mesh(mesh, **options)
    assert "\n" not in str(found.value) and "from_mesh" in str(found.value)


def test_thin_meshes_are_named() -> None:
    plate = box()
    plate.vertices = plate.vertices * [1.0, 1.0, 0.001]
    with pytest.raises(ValueError, match="thinner than a cell everywhere"):
        from_mesh(plate, 24)
    with pytest.warns(RuntimeWarning, match="is lost; use more cells"):
        from_mesh(joined(ball(3, 0.5), plate), 24)

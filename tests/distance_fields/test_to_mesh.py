"""Meshes of fields: places, normals, topology, and the way there and back."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edgegrad import Field, Mesh
from edgegrad.distance_fields import chamfer_distance, from_mesh, refined, spline, to_mesh, topology
from edgegrad.distance_fields.cell_cases import triangles
from tests.support.fields.solids import ball, box, joined, ring, solid, without
from tests.support.fields.splines import evaluate, exact_sphere, sampled
from tests.support.fields.splines import torus as thin_ring


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6.0)


def test_cases_of_a_cell() -> None:
    """The classic numbers: at most 5 triangles, 820 in all; opposite corners are cut off alone."""
    count, _ = triangles()
    assert (count.max(), count.sum()) == (5, 820)
    assert [count[1 << k] for k in range(8)] == [1] * 8
    assert count[0b00001001] == 2 and count[0b11110110] == 4 and count[0b00001111] == 2


def test_vertices_and_normals_of_a_sphere() -> None:
    mesh = to_mesh(exact_sphere(0.8, 24))
    assert mesh.normals is not None
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 0.8, atol=1e-6)
    np.testing.assert_allclose(mesh.normals, mesh.vertices / 0.8, atol=1e-5)
    assert volume(mesh) == pytest.approx(4.0 / 3.0 * np.pi * 0.8**3, rel=0.01)
    assert mesh.materials == ("clay",)
    mesh.validate("ball")


def test_a_placed_field() -> None:
    """Mirrored, sheared and moved: the vertices are zeros in the world, and the faces still look outward."""
    transform = np.array([[-1.0, 0.3, 0.0, 5.0], [0.0, 2.0, 0.1, 6.0], [0.2, 0.0, 0.7, 7.0], [0, 0, 0, 1]])
    field = exact_sphere(0.7, (12, 20, 16), transform=transform)
    mesh = to_mesh(field)
    value, slope = evaluate(field, mesh.vertices)
    np.testing.assert_allclose(value, 0.0, atol=1e-6)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, slope / np.linalg.norm(slope, axis=1, keepdims=True), atol=1e-6)
    assert volume(mesh) > 0.0
    assert topology(mesh).genus == 0


def test_finer_grids() -> None:
    field = sampled(thin_ring, 20)
    coarse, fine = to_mesh(field), to_mesh(field, finer=2)
    assert len(fine.faces) > 10 * len(coarse.faces)
    assert topology(fine).genus == topology(coarse).genus == 1
    np.testing.assert_allclose(evaluate(field, fine.vertices)[0], 0.0, atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.2, 0.8), size=st.integers(9, 14))
def test_noise_gives_closed_manifolds(seed: int, share: float, size: int) -> None:
    """All combinations of signs next to each other: no gap, no edge of four faces, no pinched vertex."""
    values = np.ones((size,) * 3, np.float32)
    inner = (size - 6,) * 3
    values[3:-3, 3:-3, 3:-3] = np.where(np.random.default_rng(seed).uniform(size=inner) < share, -4.0, 4.0)
    values[size // 2, size // 2, size // 2] = -20.0  # inside, whatever its neighbours are
    mesh = to_mesh(Field(values, "clay"))
    found = topology(mesh)
    assert found.is_closed_manifold, found
    assert volume(mesh) > 0.0
    assert found.euler_number % 2 == 0


@pytest.mark.parametrize(("mesh", "genus"), [(ball(4), 0), (box(), 0), (ring(), 1)])
def test_there_and_back(mesh: Mesh, genus: int) -> None:
    """The surface moves by a small part of a cell, less with smaller cells."""
    away = []
    for cells in (32, 64):
        field = from_mesh(mesh, cells)
        h = float((field.upper - field.lower)[0] / field.cells[0])
        found = to_mesh(field)
        assert topology(found).genus == genus
        away.append(chamfer_distance(mesh, found) / h)
    assert away[0] < 0.03 and away[1] < 0.03


def test_attributes() -> None:
    """Linear values stay linear; the bounds of the box are the first and last values."""
    places = np.stack(np.meshgrid(*[np.linspace(-1, 1, n) for n in (2, 3, 5)], indexing="ij"), axis=-1)
    field = exact_sphere(0.6, 16, attributes={"where": places, "one": np.full((1, 1, 1, 2), 0.5)})
    mesh = to_mesh(field, finer=1)
    np.testing.assert_allclose(mesh.attributes["where"], mesh.vertices[mesh.faces], atol=1e-6)
    assert np.all(mesh.attributes["one"] == 0.5)
    mesh.validate("ball")


@pytest.mark.parametrize(("field", "options", "words"), [
    (Field(np.ones((6, 6, 6)), "clay"), {}, "has no surface"),
    (exact_sphere(1.2), {}, "leaves the grid"),
    (exact_sphere(0.5), {"finer": 5}, "finer must be between 0 and 4"),
    (exact_sphere(0.5, 64), {"finer": 3, "most_memory": 1e9}, "more than most_memory"),
    (Field(np.full((6, 6, 6), np.nan), "clay"), {}, "non-finite"),
])  # fmt: skip
def test_errors(field: Field, options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        to_mesh(field, **options)


def test_an_open_border() -> None:
    found = topology(to_mesh(exact_sphere(1.2), open_border=True))
    assert found.open_edges > 0 and found.crowded_edges == found.turned_edges == 0
    with pytest.raises(ValueError, match="not a closed manifold"):
        _ = found.genus


def test_topology() -> None:
    one = topology(joined(ball(2), ring(0.5, 0.2), box(5.0)))
    assert (one.components, one.euler_number, one.genus, one.is_closed_manifold) == (3, 4, 1, True)
    assert topology(without(ball(2), slice(0, 1))).open_edges == 3
    turned = box()
    turned.faces = turned.faces.copy()
    turned.faces[0] = turned.faces[0, ::-1]
    assert topology(turned).turned_edges == 3
    fin = joined(box(), solid(np.array([box().vertices[box().faces[0, 0]], box().vertices[box().faces[0, 1]],
                                        [9.0, 9, 9]]), np.array([[0, 1, 2]])))  # fmt: skip
    assert topology(fin).crowded_edges == 1
    moved = box()
    corner = moved.vertices.max(axis=0) - moved.vertices.min(axis=0)
    assert topology(joined(box(), solid(moved.vertices + corner, moved.faces))).pinched_vertices == 1
    assert comb(4, 2) + 2 - 4 - 4 == 0  # a tetrahedron has 6 edges
    assert topology(solid(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
                                                                          ))).euler_number == 2  # fmt: skip


def test_chamfer_distance() -> None:
    assert chamfer_distance(ball(4), ball(4)) < 1e-12
    assert chamfer_distance(ball(5), ball(5, 1.1), samples=2000) == pytest.approx(0.1, abs=2e-3)
    moved = box()
    moved.transform = np.diag([1.0, 1.0, 1.0, 1.0])
    moved.transform[0, 3] = 10.0
    # Points of one face pair: the mean of the x distances from the nearest side.
    assert chamfer_distance(box(), moved, samples=4000) == pytest.approx(9.0, abs=0.05)
    assert chamfer_distance(ball(3), ring(), seed=1) == chamfer_distance(ball(3), ring(), seed=1)
    with pytest.raises(ValueError, match="mesh 'other': is empty"):
        chamfer_distance(box(), Mesh(np.zeros((1, 3)), np.zeros((0, 3), np.int32), ("clay",)))


def test_refining_before_is_refining_within() -> None:
    field = sampled(thin_ring, 16)
    one, other = to_mesh(field, finer=1), to_mesh(refined(field))
    np.testing.assert_array_equal(one.faces, other.faces)
    np.testing.assert_allclose(one.vertices, other.vertices, atol=1e-4)
    assert spline.node_values(refined(field).values).min() < 0.0

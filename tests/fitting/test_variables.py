"""Steps of a fit's parameters: lengths, directions, limits."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad.fitting.variables import Values, unknown
from edgegrad.fitting.vertices.variables import vertex_normals
from edgegrad.geometry import topology
from tests.support import shapes

PATH = "meshes.object.vertices"


@pytest.mark.parametrize("smoothness", [0.0, 5.0, 200.0])
def test_first_step_has_the_asked_length_whatever_the_smoothness(smoothness: float) -> None:
    scene = shapes.scene(*shapes.ball(2))
    before = scene.meshes["object"].vertices
    extent = np.linalg.norm(np.ptp(before, axis=0))
    gradient = np.random.default_rng(0).normal(size=before.shape)
    after = unknown(scene, PATH, 0.05, smoothness, None).take_step(gradient, 1.0)
    assert np.linalg.norm(after - before, axis=1).max() == pytest.approx(0.05 * extent)
    assert np.vdot(after - before, gradient) < 0.0, "a step goes downhill"


@pytest.mark.parametrize("stored", ["shared", "split"])
def test_without_slide_vertices_move_along_their_normals(stored: str) -> None:
    vertices, faces = shapes.ball(2) if stored == "shared" else shapes.split(*shapes.ball(2))
    scene = shapes.scene(vertices, faces)
    gradient = np.random.default_rng(0).normal(size=vertices.shape)
    move = unknown(scene, PATH, 0.05, 4.0, 0.0).take_step(gradient, 1.0) - vertices
    normal = vertex_normals(vertices, faces, topology.weld(vertices))
    np.testing.assert_allclose(move, np.sum(move * normal, axis=1, keepdims=True) * normal, atol=1e-12)
    assert np.abs(move).max() > 1e-3


def test_vertex_normals_do_not_depend_on_storage() -> None:
    vertices, faces = shapes.cube()
    shared = vertex_normals(vertices, faces, topology.weld(vertices))
    assert (np.einsum("ij,ij->i", shared, vertices) > 1.6).all(), "they point out of the corners"
    loose, corners = shapes.split(vertices, faces)
    np.testing.assert_allclose(vertex_normals(loose, corners, topology.weld(loose)), shared[faces].reshape(-1, 3))


def test_open_sheets_may_move_sideways() -> None:
    """The border of a sheet shows motion along the sheet, so all of it is kept."""
    vertices, faces = shapes.sheet(5)
    scene = shapes.scene(vertices, faces)
    gradient = np.tile([-1.0, 0.0, 0.0], (len(vertices), 1))
    move = unknown(scene, PATH, 0.05, 4.0, None).take_step(gradient, 1.0) - vertices
    np.testing.assert_allclose(move, np.tile([0.05 * np.sqrt(8.0), 0.0, 0.0], (len(vertices), 1)), atol=1e-12)


def test_meshes_without_extent_are_refused() -> None:
    vertices, faces = shapes.cube()
    with pytest.raises(ValueError, match="all vertices are at one place"):
        unknown(shapes.scene(0.0 * vertices, faces), PATH, None, None, None)


def test_default_steps_go_by_the_value() -> None:
    scene = shapes.scene(*shapes.cube())
    assert Values(scene, "lights.lamp.power", None).step == pytest.approx(0.03 * 600.0)
    assert Values(scene, "materials.clay.base_color", None).step == pytest.approx(0.03)
    assert Values(scene, "materials.clay.emission", None).step > 0.0, "from 0 there is no scale, but a step"
    assert float(Values(scene, "lights.lamp.power", 1e4).take_step(np.array(1.0), 1.0)) == 0.0, "clipped"

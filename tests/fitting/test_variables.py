"""Steps of a fit's parameters: lengths, directions, limits."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad.fitting.large_steps import LargeSteps
from edgegrad.fitting.variables import Values, unknown
from edgegrad.fitting.vertices.regional_steps import AdamRegional
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


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_steps_are_longer_where_all_gradients_are_small_unless_they_are_noise(unit: float) -> None:
    rng = np.random.default_rng(0)
    weak = np.repeat([False, True], 400)

    def halves(values: np.ndarray) -> np.ndarray:
        return np.where(weak, values[weak].mean(), values[~weak].mean())

    def sizes(noisy: bool) -> tuple[float, float]:
        """Lengths of the steps where gradients are large and small, after ten equal gradients or with noise."""
        optimiser, step = AdamRegional(1.0, beta2=0.98, average=halves), np.zeros((800, 3))
        same = rng.normal(size=(800, 3))
        for _ in range(10):
            weak_gradient = rng.normal(size=(800, 3)) if noisy else same
            step = optimiser.update(np.zeros((800, 3)), unit * np.where(weak[:, None], 1e-4 * weak_gradient, same))
        length = np.linalg.norm(step, axis=1)
        return float(length[~weak].mean()), float(length[weak].mean())

    strong, slow = sizes(noisy=False)
    assert slow / strong == pytest.approx(1e-2, rel=0.1), "the root of the ratio of the gradients"
    strong, slow = sizes(noisy=True)
    assert slow / strong < 1e-4
    assert not AdamRegional(1.0, average=halves).update(np.zeros((800, 3)), np.zeros((800, 3))).any()


@pytest.mark.parametrize("stored", ["shared", "split"])
def test_resistance_to_bending_is_the_gradient_of_its_energy(stored: str) -> None:
    vertices, faces = shapes.ball(1) if stored == "shared" else shapes.split(*shapes.ball(1))
    steps = LargeSteps(vertices, faces, 3.0)
    rng = np.random.default_rng(0)
    bent = vertices + 0.1 * rng.normal(size=(steps.count, 3))[steps.label]
    move = rng.normal(size=(steps.count, 3))[steps.label]

    def energy(x: np.ndarray) -> float:
        ends = {tuple(sorted((steps.label[face[k - 1]], steps.label[face[k]]))) for face in faces for k in range(3)}
        first = dict(zip(steps.label, x, strict=True))
        return 0.5 * 3.0 * sum(float(((first[a] - first[b]) ** 2).sum()) for a, b in ends)

    slope = (energy(bent + 1e-4 * move) - energy(bent - 1e-4 * move)) / 2e-4
    assert np.vdot(steps.bend(bent), move) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("stored", ["shared", "split"])
def test_what_large_moves_have_crumpled_goes_back_to_the_start(stored: str) -> None:
    """Vertices at which nothing pulls lose the bends that a fit has made, and only those."""
    vertices, faces = shapes.ball(3) if stored == "shared" else shapes.split(*shapes.ball(3))
    start = vertices * (1.0 + 0.05 * np.sin(12.0 * vertices))  # with detail
    far = vertices[:, 2] < 0.0
    crumple = 0.05 * far[:, None] * np.sin(20.0 * vertices[:, [1, 2, 0]])
    pull = np.where(vertices[:, [2]] > 0.8 * np.abs(vertices).max(), -vertices, 0.0)

    def moved(smoothness: float | None, crumpled: bool) -> np.ndarray:
        item = unknown(shapes.scene(start, faces), PATH, 0.005, smoothness, None, 100)
        item.value = start + crumpled * crumple  # type: ignore[attr-defined]
        for _ in range(10):
            out = item.take_step(pull, 1.0)
        return np.asarray((out - start)[far])

    def size(of: np.ndarray) -> float:
        return float(np.sqrt((of**2).mean()))

    carried = size(moved(None, False))
    assert carried < 0.1 * size(crumple[far]), "the start's own detail stays"
    assert size(moved(None, True) - moved(None, False)) < 0.8 * size(crumple[far])
    assert size(moved(5.0, True) - moved(5.0, False)) > size(moved(None, True) - moved(None, False))

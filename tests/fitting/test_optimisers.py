"""Optimisers and the preconditioned vertex positions."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad.fitting.large_steps import LargeSteps
from edgegrad.fitting.optimisers import Adam, AdamMatrix, AdamUniform


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """A bumpy sheet of n x n vertices."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij"))
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    return np.stack([x, y, 0.1 * np.sin(7 * x) * y], axis=1), faces


def split(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same mesh with one vertex per corner."""
    return vertices[faces].reshape(-1, 3), np.arange(faces.size, dtype=np.int32).reshape(-1, 3)


def test_adam_follows_the_published_recurrence() -> None:
    rng = np.random.default_rng(0)
    adam, x = Adam(0.1), np.zeros(4)
    m, v, y = np.zeros(4), np.zeros(4), np.zeros(4)
    for t in range(1, 8):
        g = rng.normal(size=4)
        x = adam.update(x, g)
        m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g**2
        y = y - 0.1 * (m / (1 - 0.9**t)) / np.sqrt(v / (1 - 0.999**t))
    np.testing.assert_allclose(x, y, rtol=1e-12)


@pytest.mark.parametrize("kind", [Adam, AdamUniform, AdamMatrix])
def test_minimum_of_a_quadratic_is_found(kind: type[Adam]) -> None:
    goal, x = np.array([1.0, -2.0, 0.5]), np.zeros(3)
    optimiser = kind(0.1)
    for k in range(400):
        x = optimiser.update(x, np.array([1.0, 3.0, 2.0]) * (x - goal), 1.0 - k / 400)
    np.testing.assert_allclose(x, goal, atol=1e-3)


@pytest.mark.parametrize("kind", [Adam, AdamUniform])
def test_zero_gradient_moves_nothing_and_the_unit_of_the_loss_does_not_matter(kind: type[Adam]) -> None:
    x = np.array([1.0, 2.0])
    np.testing.assert_array_equal(kind(0.1).update(x, np.zeros(2)), x)
    for unit in (1e-30, 1e30):
        np.testing.assert_allclose(kind(0.1).update(x, unit * np.array([1.0, 1.0])), x - 0.1)


def test_adam_uniform_has_one_step_and_turns_with_the_world() -> None:
    gradient = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(
        AdamUniform(0.1).update(np.zeros((5, 3)), gradient), -0.1 * gradient / np.abs(gradient).max()
    )
    turned = AdamUniform(0.1).update(np.zeros((5, 3)), gradient[:, [1, 2, 0]])
    np.testing.assert_allclose(turned, AdamUniform(0.1).update(np.zeros((5, 3)), gradient)[:, [1, 2, 0]])


def test_adam_matrix_steps_alike_in_all_axes_and_follows_a_narrow_valley() -> None:
    rng = np.random.default_rng(0)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    gradients = rng.normal(size=(6, 2, 3)) * [1.0, 30.0, 0.1]
    plain, turned = AdamMatrix(0.1), AdamMatrix(0.1)
    for gradient in gradients:
        step = plain.update(np.zeros((2, 3)), gradient)
        np.testing.assert_allclose(turned.update(np.zeros((2, 3)), gradient @ axes.T), step @ axes.T, atol=1e-9)
        assert np.abs(step).max() <= 0.1 + 1e-9
    np.testing.assert_allclose(AdamMatrix(0.1).update(np.zeros(3), axes[0]), -0.1 * axes[0], atol=1e-12)
    np.testing.assert_array_equal(AdamMatrix(0.1).update(np.ones((2, 3)), np.zeros((2, 3))), np.ones((2, 3)))

    def left(optimiser: Adam) -> float:
        x = np.array([0.5, -0.5])
        for k in range(100):
            across, along = x[0] - x[1], x[0] + x[1] - 2.0
            x = optimiser.update(x, 30.0 * across * np.array([1.0, -1.0]) + 0.03 * along, 1.0 - k / 100)
        return float(np.abs(x - 1.0).max())

    assert left(AdamMatrix(0.05)) < 0.1 < 0.9 < left(AdamUniform(0.05))


def test_adam_matrix_soon_turns_back_when_the_gradient_of_a_direction_turns() -> None:
    """A strong direction keeps its gradient; that of a weak one turns and becomes smaller after 12 steps."""
    optimiser, place = AdamMatrix(0.1), [np.zeros(2)]
    for k in range(24):
        place.append(optimiser.update(place[-1], np.array([-30.0, -1.0 if k < 12 else 0.2])))
    moves = np.diff([x[1] for x in place])
    assert (moves[:12] > 0.0).all()
    assert (moves[21:] < 0.0).all()


def test_adam_matrix_does_not_wander_by_noise() -> None:
    rng = np.random.default_rng(1)

    def wandered(optimiser: Adam) -> float:
        x = np.zeros((50, 1, 6))
        for walk in x:
            optimiser.__init__(0.05)  # type: ignore[misc]
            for _ in range(100):
                walk[...] = optimiser.update(walk, rng.normal(size=(1, 6)))
        return float(np.sqrt(np.mean(x**2)))

    # The root mean square of 50 walks of six numbers is known to a twentieth of itself.
    assert wandered(AdamMatrix(0.05)) < 0.6 * wandered(AdamUniform(0.05))


def test_wrong_steps_are_refused() -> None:
    for step in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="step"):
            AdamUniform(step)
    with pytest.raises(ValueError, match="beta"):
        Adam(0.1, beta1=1.0)


@pytest.mark.parametrize("smoothness", [0.0, 1.0, 50.0])
@pytest.mark.parametrize("stored", ["shared", "split"])
def test_positions_survive_the_way_there_and_back(smoothness: float, stored: str) -> None:
    vertices, faces = grid(12) if stored == "shared" else split(*grid(12))
    steps = LargeSteps(vertices, faces, smoothness)
    assert steps.count == 144
    np.testing.assert_allclose(steps.vertices(steps.unknowns(vertices)), vertices, atol=1e-10)


@pytest.mark.parametrize("stored", ["shared", "split"])
def test_gradient_is_the_transpose(stored: str) -> None:
    vertices, faces = grid(9) if stored == "shared" else split(*grid(9))
    steps = LargeSteps(vertices, faces, 19.0)
    rng = np.random.default_rng(0)
    du, g = rng.normal(size=(steps.count, 3)), rng.normal(size=vertices.shape)
    assert np.vdot(steps.vertices(du), g) == pytest.approx(np.vdot(du, steps.gradient(g)), rel=1e-10)


def test_matrix_is_the_combinatorial_laplacian() -> None:
    vertices, faces = grid(4)
    steps = LargeSteps(vertices, faces, 3.0)
    adjacency = np.zeros((16, 16))
    for face in faces:
        for a, b in ((0, 1), (1, 2), (2, 0)):
            adjacency[face[a], face[b]] = adjacency[face[b], face[a]] = 1.0
    matrix = np.eye(16) + 3.0 * (np.diag(adjacency.sum(axis=1)) - adjacency)
    np.testing.assert_allclose(steps.unknowns(vertices), matrix @ vertices, atol=1e-12)


def test_translation_passes_unchanged() -> None:
    vertices, faces = grid(9)
    steps = LargeSteps(vertices, faces, 100.0)
    moved = steps.vertices(steps.unknowns(vertices) + np.array([0.3, -0.2, 0.1]))
    np.testing.assert_allclose(moved, vertices + np.array([0.3, -0.2, 0.1]), atol=1e-10)


def test_seams_do_not_tear_and_split_moves_like_shared() -> None:
    vertices, faces = grid(9)
    loose, corners = split(vertices, faces)
    shared, apart = LargeSteps(vertices, faces, 10.0), LargeSteps(loose, corners, 10.0)
    gradient = np.random.default_rng(0).normal(size=loose.shape)
    moved = apart.vertices(apart.unknowns(loose) - 0.1 * apart.gradient(gradient))
    summed = np.zeros_like(vertices)
    np.add.at(summed, faces.ravel(), gradient)
    expected = shared.vertices(shared.unknowns(vertices) - 0.1 * shared.gradient(summed))
    np.testing.assert_allclose(moved, expected[faces].reshape(-1, 3), atol=1e-10)
    for k in range(len(vertices)):
        copies = moved[faces.ravel() == k]
        assert (copies == copies[0]).all()


def test_one_vertex_takes_its_neighbourhood_along() -> None:
    vertices, faces = grid(15)
    gradient = np.zeros_like(vertices)
    middle = 7 * 15 + 7
    gradient[middle, 2] = 1.0
    def width(smoothness: float) -> float:
        moved = np.abs(LargeSteps(vertices, faces, smoothness).gradient(gradient)[:, 2])
        return float((moved * np.linalg.norm(vertices - vertices[middle], axis=1)).sum() / moved.sum())
    assert width(0.0) == 0.0 < width(2.0) < width(20.0)


def test_automatic_smoothness_goes_by_welded_vertices() -> None:
    """A finer mesh, not a mesh with more copies of its vertices, is filtered over more edges."""
    shared, apart = (LargeSteps(*mesh, None).smoothness for mesh in (grid(40), split(*grid(40))))
    assert shared == apart == pytest.approx(6.4)
    assert LargeSteps(*grid(80), None).smoothness == pytest.approx(25.6)


def test_wrong_smoothness_is_refused() -> None:
    for smoothness in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="smoothness"):
            LargeSteps(*grid(3), smoothness)


def test_loose_vertices_and_degenerate_faces_are_harmless() -> None:
    vertices, faces = grid(4)
    vertices = np.concatenate([vertices, [[5.0, 5.0, 5.0]]])
    faces = np.concatenate([faces, [[0, 0, 1], [2, 2, 2]]]).astype(np.int32)
    steps = LargeSteps(vertices, faces, 10.0)
    np.testing.assert_allclose(steps.vertices(steps.unknowns(vertices)), vertices, atol=1e-10)

"""Weights, locked axes and symmetry of vertices, and steps that fold no faces."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad import VertexRules
from edgegrad.fitting.control_vertices import ControlVertices
from edgegrad.fitting.variables import unknown
from edgegrad.fitting.vertices.cage import Cage
from edgegrad.fitting.vertices.fold_guard import FoldGuard, with_neighbours
from edgegrad.fitting.vertices.mirror import partners
from edgegrad.fitting.vertices.rules import Constraint
from edgegrad.geometry import topology
from tests.support import shapes
from tests.support.small_scenes import need

PATH = "meshes.object.vertices"
F64 = NDArray[np.float64]
MIRROR = np.array([-1.0, 1.0, 1.0])


def _frame() -> F64:
    frame = np.eye(4)
    frame[:3] = np.random.default_rng(8).normal(size=(3, 4))
    return frame


def _constraint(rules: VertexRules | None = None) -> tuple[Constraint, F64, F64]:
    """All rules at once in a skewed frame; with the vertices, and the inverse of the frame."""
    frame = _frame()
    local = shapes.ball(2)[0]
    vertices = local @ frame[:3, :3].T + frame[:3, 3]
    weights = np.random.default_rng(1).random(len(vertices))
    rules = VertexRules(weights, (False, True, False), "x", frame) if rules is None else rules
    return Constraint(PATH, rules, vertices), vertices, np.linalg.inv(frame[:3, :3])


def test_pull_is_the_transpose_of_push() -> None:
    constraint, vertices, _ = _constraint()
    a, b = np.random.default_rng(2).normal(size=(2, *vertices.shape))
    assert np.vdot(constraint.push(a), b) == pytest.approx(np.vdot(a, constraint.pull(b)))


def test_moves_are_locked_and_mirrored_in_the_frame() -> None:
    constraint, vertices, inverse = _constraint()
    local = constraint.push(np.random.default_rng(3).normal(size=vertices.shape)) @ inverse.T
    assert np.abs(local[:, 1]).max() < 1e-12 * np.abs(local).max()
    assert constraint.partner is not None
    np.testing.assert_allclose(local[constraint.partner] * MIRROR, local, atol=1e-12)


def test_steps_stay_within_the_rules_and_go_downhill() -> None:
    vertices, faces = shapes.ball(2)
    weights = (vertices[:, 2] > 0.0).astype(float)
    rules = VertexRules(weights, (False, False, True), "x")
    item = unknown(shapes.scene(vertices, faces), PATH, 0.02, None, None, 10, None, rules)
    gradient = np.random.default_rng(4).normal(size=vertices.shape)
    move = item.take_step(gradient, 1.0) - vertices
    assert np.vdot(move, gradient) < 0.0
    assert not move[weights == 0.0].any() and not move[:, 2].any() and move.any()
    np.testing.assert_allclose(move[partners(vertices, 0)] * MIRROR, move, atol=1e-12)


def test_control_vertices_obey_rules() -> None:
    vertices, faces = shapes.ball(2)
    every = np.arange(len(vertices))
    rules = VertexRules(None, (False, True, False), "x")
    item = ControlVertices("cage", vertices, every, every, np.ones(len(vertices)), faces, rules=rules)
    move = item.take_step(np.random.default_rng(4).normal(size=vertices.shape), 1.0) - vertices
    assert not move[:, 1].any() and move.any()
    np.testing.assert_allclose(move[partners(vertices, 0)] * MIRROR, move, atol=1e-12)


def test_partners_of_a_changed_side_are_found_over_faces() -> None:
    side = 7
    vertices = shapes.sheet(side)[0]
    vertices = vertices - 0.5 * (vertices.max(axis=0) + vertices.min(axis=0))
    quads = [(k, k + side, k + side + 1, k + 1) for k in range(side * (side - 1)) if (k + 1) % side]
    true = partners(vertices, 0)
    assert (true >= 0).all()
    bent = vertices + 0.1 * (vertices[:, :1] > 1e-6) * np.sin(5.0 * vertices)
    assert (partners(bent, 0) < 0).any()
    assert np.array_equal(partners(bent, 0, quads), true)


def _bent_side() -> tuple[F64, F64, NDArray[np.int32], NDArray[np.int64]]:
    """A ball, the same with one side bent, faces, and partners across x."""
    vertices, faces = shapes.ball(2)
    return vertices, vertices + 0.1 * (vertices[:, :1] > 1e-6), faces, partners(vertices, 0)


def test_a_start_becomes_symmetric() -> None:
    vertices, bent, _, pairs = _bent_side()
    starts = Constraint(PATH, VertexRules(symmetry="x", partners=pairs), bent).starts()
    right = vertices[:, 0] > 1e-6
    for start in starts:
        np.testing.assert_allclose(start[pairs] * MIRROR, start, atol=1e-12)
    for start, shift in zip(starts, (0.05, 0.1, 0.0), strict=True):
        np.testing.assert_allclose(start[right, 1], vertices[right, 1] + shift)
    assert len(Constraint(PATH, VertexRules(symmetry="x", partners=pairs), vertices).starts()) == 1


def test_the_side_that_fits_is_mirrored() -> None:
    """Of a ball with one bent side, pictures of the straight ball keep the straight side, of a bent one the bent."""
    vertices, bent, faces, pairs = _bent_side()
    starts = Constraint(PATH, VertexRules(symmetry="x", partners=pairs), bent).starts()
    for truth in (vertices, starts[1], starts[0]):
        target = edgegrad.render(shapes.scene(truth, faces), spp=64, seed=1)
        scene = shapes.scene(bent, faces)
        rules = {PATH: VertexRules(symmetry="x", partners=pairs)}
        result = edgegrad.fit(scene, target, [PATH], iterations=1, spp=16, step_sizes={PATH: 1e-6}, vertex_rules=rules)
        np.testing.assert_allclose(result.values[PATH], truth, atol=1e-4)


@pytest.mark.parametrize(("rules", "message"), [
    (VertexRules(symmetry="x"), r"have no partner across x; make the mesh symmetric"),
    (VertexRules(symmetry="w"), "symmetry"),
    (VertexRules(locked=(True, True, True)), "x, y and z are locked"),
    (VertexRules(weights=np.zeros(8)), "all weights are 0"),
    (VertexRules(weights=np.full(8, 2.0)), r"must be in \[0, 1\]"),
    (VertexRules(weights=np.ones(3)), "weights"),
    (VertexRules(frame=np.zeros((4, 4))), "frame has no inverse"),
])  # fmt: skip
def test_wrong_rules_are_named(rules: VertexRules, message: str) -> None:
    vertices, faces = shapes.cube()
    vertices = vertices + 0.3 * np.random.default_rng(0).random(vertices.shape)
    with pytest.raises(ValueError, match=message) as found:
        unknown(shapes.scene(vertices, faces), PATH, None, None, None, 1, None, rules)
    assert PATH in str(found.value)


def test_rules_of_other_parameters_are_refused() -> None:
    scene = shapes.scene(*shapes.cube())
    target = np.zeros((scene.camera.height, scene.camera.width, 3), np.float32)
    with pytest.raises(ValueError, match=r"vertex_rules names 'lights\.lamp\.power'"):
        edgegrad.fit(scene, target, [PATH], vertex_rules={"lights.lamp.power": VertexRules()})


# ---------------------------------------------------------------- folds
def _crossings(vertices: F64, faces: NDArray[np.int32]) -> int:
    from edgegrad import _native

    return len(_native.crossing_face_pairs(vertices, faces, 1))


def test_crossing_faces_are_those_of_exhaustive_search() -> None:
    need("native")
    rng = np.random.default_rng(5)
    points = rng.random((40, 3))
    faces = np.array([rng.choice(40, 3, replace=False) for _ in range(60)], np.int32)

    def pierces(one: NDArray[np.int32], other: NDArray[np.int32]) -> bool:
        a, b, c = points[other]
        for k in range(3):
            p, q = points[one[k]], points[one[(k + 1) % 3]]
            if {one[k], one[(k + 1) % 3]} & set(other):
                continue
            t, u, v = np.linalg.solve(np.stack([p - q, b - a, c - a], axis=1), p - a)
            if 0.0 < t < 1.0 and u > 0.0 and v > 0.0 and u + v < 1.0:
                return True
        return False

    from edgegrad import _native

    expected = [[a, b] for a in range(60) for b in range(a + 1, 60) if len(set(faces[a]) & set(faces[b])) < 2
                and (pierces(faces[a], faces[b]) or pierces(faces[b], faces[a]))]  # fmt: skip
    assert len(expected) > 50
    assert _native.crossing_face_pairs(points, faces, 2).tolist() == expected


@pytest.mark.parametrize("seed", range(4))
def test_no_step_folds_a_ball(seed: int) -> None:
    need("native")
    vertices, faces = shapes.ball(3)
    guard = FoldGuard(vertices, faces, topology.weld(vertices))
    rng = np.random.default_rng(seed)
    moved = vertices
    for _ in range(5):
        change = rng.normal(0.0, 0.2, vertices.shape)
        assert _crossings(moved + change, faces) > 0, "the step alone folds it"
        factor = guard.shortened(moved, change)
        moved = moved + factor[:, None] * change
        assert _crossings(moved, faces) == 0
    assert np.abs(moved - vertices).max() > 0.05


def test_one_chosen_neighbour_is_enough() -> None:
    """The middle vertex has edges to four others; it is near a chosen one, whatever the order of the edges."""
    for ends in ([[0, 1], [0, 2], [0, 3], [0, 4]], [[3, 0], [2, 0], [1, 0], [4, 0]]):
        chosen = np.arange(5) == 2
        assert with_neighbours(chosen, np.array(ends)).tolist() == [True, False, True, False, False]
        assert with_neighbours(np.arange(5) == 0, np.array(ends)).all()


def test_two_sheets_do_not_pass_through_each_other() -> None:
    need("native")
    vertices, faces = shapes.sheet(5)
    both = np.concatenate([vertices, vertices + (0.01, 0.02, 0.1)])
    all_faces = np.concatenate([faces, faces + len(vertices)]).astype(np.int32)
    guard = FoldGuard(both, all_faces, topology.weld(both))
    change = np.zeros_like(both)
    change[12, 2] = 0.3
    factor = guard.shortened(both, change)
    assert _crossings(both + change, all_faces) > 0
    assert _crossings(both + factor[:, None] * change, all_faces) == 0 and 0.0 < factor[12] < 1.0


def _two_sheets(n: int) -> tuple[F64, NDArray[np.int32]]:
    sheet, faces = shapes.sheet(n)
    return np.concatenate([sheet, sheet + (0.01, 0.02, 0.3)]), np.concatenate([faces, faces + n * n]).astype(np.int32)


def _sheets_under_control() -> tuple[Cage, F64, NDArray[np.int32], F64, NDArray[np.int32]]:
    """Two sheets of 5 x 5 control vertices over two of 9 x 9, interpolated between them, and the map as a matrix."""
    control, control_faces = _two_sheets(5)
    faces = _two_sheets(9)[1]
    away = np.abs(shapes.sheet(9)[0][:, None, :2] - shapes.sheet(5)[0][None, :, :2]) / 0.5
    weight = np.kron(np.eye(2), np.prod(np.clip(1.0 - away, 0.0, None), axis=2))
    rows, columns = np.nonzero(weight)
    blocks = weight[rows, columns][:, None, None] * np.eye(3)
    cage = Cage(control, control_faces, weight @ control, faces, rows, columns, blocks)
    return cage, control, control_faces, weight, faces


@pytest.mark.parametrize("seed", range(3))
def test_no_step_of_control_vertices_folds_what_they_move(seed: int) -> None:
    need("native")
    cage, control, _, weight, faces = _sheets_under_control()
    rng = np.random.default_rng(seed)
    moved = control
    for _ in range(5):
        change = rng.normal(0.0, 0.4, control.shape)
        assert _crossings(weight @ (moved + change), faces) > 0, "the step alone folds it"
        moved = moved + cage.shortened(moved, change)[:, None] * change
        assert _crossings(weight @ moved, faces) == 0
    assert np.abs(moved - control).max() > 0.1
    assert (cage.shortened(control, 0.3 * control) == 1.0).all()


def test_steps_of_control_vertices_are_guarded() -> None:
    """A gradient that carries the middle of one sheet up goes through the other one only without a guard."""
    need("native")
    cage, control, control_faces, weight, faces = _sheets_under_control()
    rows, columns = np.nonzero(weight)
    gradient = np.zeros_like(control)
    gradient[12, 2] = -1.0
    ends = []
    for guard in (None, cage):
        item = ControlVertices("cage", control, rows, columns, weight[rows, columns], control_faces, 0.03, cage=guard)
        for _ in range(10):
            item.take_step(gradient, 1.0)
        ends.append(weight @ item.value)
    assert _crossings(ends[0], faces) > 0 and _crossings(ends[1], faces) == 0
    assert (ends[1] - weight @ control)[:, 2].max() > 0.1


def test_what_was_held_goes_back_to_its_neighbours_and_keeps_the_detail_of_the_start() -> None:
    """A vertex that is pulled towards another sheet turns before it, but not below the bump that the start has."""
    need("native")
    vertices, faces = _two_sheets(7)
    vertices[24, 2] = 0.1
    item = unknown(shapes.scene(vertices, faces), PATH, 0.02, 0.0, 1.0)
    gradient = np.zeros_like(vertices)
    gradient[24, 2] = -1.0
    places = [vertices]
    for _ in range(12):
        places.append(item.take_step(gradient, 1.0))
    height = np.array([at[24, 2] for at in places])
    held = int(np.argmax(np.diff(height) < 0.9 * (height[1] - height[0])))
    assert height[held] > 0.2, "it has come near the other sheet"
    back = np.diff(height)[held:].min()
    assert back < -0.05, "it turns"
    assert height.min() >= 0.1 - 1e-9, "its bump was there at the start"
    assert all(_crossings(at, faces) == 0 for at in places)


def test_clean_steps_are_kept() -> None:
    vertices, faces = shapes.ball(3)
    guard = FoldGuard(vertices, faces, topology.weld(vertices))
    assert (guard.shortened(vertices, 0.3 * vertices) == 1.0).all()


def test_distorted_faces_are_evened_along_the_surface() -> None:
    """A vertex of a flat sheet that goes far sideways is drawn back, and none leaves the plane."""
    vertices, faces = shapes.sheet(7)
    item = unknown(shapes.scene(vertices, faces), PATH, 0.01, 0.0, 1.0)
    gradient = np.zeros_like(vertices)
    middle = len(vertices) // 2
    gradient[middle, 0] = -1.0
    places = [vertices]
    for _ in range(40):
        places.append(item.take_step(gradient, 1.0))
    assert places[5][middle, 0] > vertices[middle, 0] + 0.05
    side = 2.0 / 6.0
    assert places[-1][middle, 0] < vertices[middle, 0] + 0.8 * side, "40 steps alone go farther than a side"
    assert 40 * 0.01 * np.sqrt(8.0) > side
    assert not places[-1][:, 2].any() and not np.array_equal(places[-1][middle + 7], vertices[middle + 7])
    border = np.abs(vertices[:, :2]).max(axis=1) > 0.99
    assert np.array_equal(places[-1][border], vertices[border])


def test_steps_get_finer_during_a_fit_unless_a_smoothness_is_given() -> None:
    vertices, faces = shapes.ball(4)
    gradient = np.zeros_like(vertices)
    gradient[0] = vertices[0]
    widths: dict[float | None, list[int]] = {}
    for smoothness in (None, 5.0):
        item = unknown(shapes.scene(vertices, faces), PATH, 1e-4, smoothness, None, 20)
        widths[smoothness] = []
        for _ in range(20):
            before = item.value  # type: ignore[attr-defined]
            move = np.linalg.norm(item.take_step(gradient, 1.0) - before, axis=1)
            widths[smoothness].append(int((move > 0.3 * move.max()).sum()))
    assert widths[None][-1] < widths[None][0]
    assert widths[5.0][-1] == widths[5.0][0]

"""Holes that open and parts that appear in fits of distance fields."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad import Camera, Field, FieldSteps, Renderer, Scene, Target, World, fit
from edgegrad.distance_fields import to_mesh, topology
from edgegrad.fitting.fields.proposals import added, carved, evidence, parts, signed_distance
from edgegrad.fitting.fields.topological_steps import TopologicalStep, topology_is_due
from edgegrad.fitting.fields.variables import Coefficients
from edgegrad.fitting.losses import Pyramid
from edgegrad.fitting.targets import views
from tests.support.fields.splines import points, sampled, torus
from tests.support.small_scenes import camera, matte, need

PATH = "fields.body.values"
SIZE = 23  # coefficients along an axis: 20 cells
WAYS = [(0, 0, 4), (0.5, 3.6, 1.6), (3.2, -1.8, 1.6), (-3.2, -1.8, 1.6), (0.3, 0.2, -4), (1.2, 2.6, -2.8)]


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def cameras(size: int = 32) -> list[Camera]:
    return [camera(way, size=size, fov=0.62, up=(0.1, 0.2, 1) if abs(way[2]) < 3.9 else (0, 1, 0)) for way in WAYS]


def scene(field: Field) -> Scene:
    return Scene(cameras()[0], {}, {"clay": matte(0.7, 0.35, 0.2)}, world=World(np.array([0.5, 0.6, 0.8])),
                 fields={"body": field})  # fmt: skip


def ball(radius: float = 0.75, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Field:
    return sampled(lambda p: np.linalg.norm(p - np.array(at), axis=-1) - radius, SIZE)


def both(*fields: Field) -> Field:
    return replace(fields[0], values=np.minimum.reduce([field.values for field in fields]))


def targets_of(field: Field) -> list[Target]:
    renderer = Renderer(scene(field))
    return [Target(renderer.render(spp=16, seed=k, camera=one), one) for k, one in enumerate(cameras())]


def step_of(start: Field, truth: Field) -> TopologicalStep:
    """A step of a field towards pictures of another."""
    made = scene(start)
    renderer = Renderer(made, wrt=[PATH], watched=False)
    seen = views(made, targets_of(truth))
    return TopologicalStep(
        Coefficients(made, PATH, None, 10, None), made, renderer.update, seen, Pyramid(),
        lambda j, twin, without: renderer.render(spp=4, seed=2 * j + twin, camera=seen[j].camera),
    )  # fmt: skip


def shape_of(step: TopologicalStep) -> tuple[int, int]:
    found = topology(to_mesh(step.field))
    return found.components, found.euler_number


def fitted(every: int, seed: int = 0) -> Field:
    made = scene(ball())
    fit(made, targets_of(sampled(torus, SIZE)), [PATH], iterations=16, spp=4, seed=seed,
        field_steps=FieldSteps(topology_every=every, laplacian=0.01, smoothness=2.0))  # fmt: skip
    return made.fields["body"]


def test_a_fit_opens_a_hole_only_by_a_topological_step() -> None:
    assert topology(to_mesh(fitted(0))).euler_number == 2
    found = fitted(5)
    assert topology(to_mesh(found)).euler_number == 0
    np.testing.assert_array_equal(found.values, fitted(5).values)


def test_a_hole_is_carved_where_pictures_see_through() -> None:
    step = step_of(ball(), sampled(torus, SIZE))
    assert step.take()
    assert shape_of(step) == (1, 0)


def test_nothing_changes_at_the_truth() -> None:
    truth = sampled(torus, SIZE)
    step = step_of(truth, truth)
    before = step.field.values.copy()
    assert not step.take()
    np.testing.assert_array_equal(step.field.values, before)
    assert "camera" in step.field.visible_to


def test_a_missing_part_appears() -> None:
    one, other = ball(0.35, (-0.5, 0.0, 0.0)), ball(0.3, (0.5, 0.2, 0.1))
    step = step_of(one, both(one, other))
    assert step.take()
    assert shape_of(step) == (2, 4)
    assert np.linalg.norm(to_mesh(step.field).vertices - [0.5, 0.2, 0.1], axis=1).min() < 0.4


def test_parts_that_pictures_do_not_show_go_and_others_stay() -> None:
    one, other, wrong = ball(0.35, (-0.5, 0.0, 0.0)), ball(0.3, (0.5, 0.2, 0.1)), ball(0.15, (0.0, -0.7, 0.3))
    step = step_of(both(one, other, wrong), both(one, other))
    assert step.simplify()
    assert shape_of(step) == (2, 4)
    assert not step_of(both(one, other), both(one, other)).simplify()


def test_cavities_are_filled() -> None:
    """No view sees them, and a part of the surface that has none stays as it is."""
    whole = ball(0.7)
    hollow = replace(whole, values=np.maximum(whole.values, -ball(0.25).values))
    step = step_of(hollow, whole)
    assert shape_of(step) == (2, 4)
    assert step.simplify()
    assert shape_of(step) == (1, 2)
    outer = np.abs(whole.values) < 0.1
    np.testing.assert_allclose(step.field.values[outer], whole.values[outer], atol=0.02)


def test_the_best_values_of_a_fit_are_simplified() -> None:
    """A crumb that pictures hardly show is gone, though no topological step was due."""
    truth = sampled(torus, SIZE)
    made = scene(both(truth, ball(0.1)))
    fit(made, targets_of(truth), [PATH], iterations=1, spp=4, step_sizes={PATH: 1e-3})
    found = topology(to_mesh(made.fields["body"]))
    assert (found.components, found.euler_number) == (1, 0)


def test_carving_seen_matter_is_refused_and_leaves_no_trace() -> None:
    truth = sampled(torus, SIZE)
    step = step_of(truth, truth)
    before = step.field.values.copy()
    picture = step.render(0, 0, False)
    step.losses = step._losses(step._pictures())
    losses, coefficients = step.losses, step.item.nodes()
    nodes = step.item.nodes()
    place = points((SIZE, SIZE, SIZE))[1:-1, 1:-1, 1:-1]
    cut = step.item.coefficients_of(np.maximum(nodes, 0.3 - place[..., 0]))
    assert cut is not None
    assert not step._is_kept(cut, 0.0)
    np.testing.assert_array_equal(step.field.values, before)
    np.testing.assert_array_equal(step.render(0, 0, False), picture)
    np.testing.assert_array_equal(step.item.nodes(), coefficients)
    assert step.losses is losses


def test_fields_that_cameras_do_not_see_stay() -> None:
    step = step_of(replace(ball(), visible_to=frozenset(["diffuse", "shadow"])), sampled(torus, SIZE))
    assert not step.take()


def test_evidence_of_one_view() -> None:
    """A square of the field that the target shows in its left half only, and a second square that the field lacks."""
    one = camera((0, 0, 4), size=40)
    behind = np.full((40, 40, 3), 0.2, np.float32)
    shown, target = behind.copy(), behind.copy()
    shown[10:30, 4:24] = 0.8
    target[10:30, 4:14] = 0.8
    target[4:12, 30:38] = 0.7
    found = evidence(one, target, None, [shown, shown], [behind, behind])
    for name, inside, outside in (("empty", (20, 18), (20, 8)), ("missing", (8, 34), (20, 8)),
                                  ("filled", (20, 8), (20, 18)), ("filled", (8, 34), (35, 35))):  # fmt: skip
        region = getattr(found, name)
        assert region[inside] < 0.0 < region[outside], name
    mask = np.ones((40, 40))
    mask[:, 12:] = 0.0
    found = evidence(one, target, mask, [shown, shown], [behind, behind])
    assert (found.empty > 0.0).all() and (found.missing > 0.0).all()
    assert (found.filled[:, 16:] < 0.0).all()  # unknown rays do not forbid matter


@pytest.mark.parametrize(("patch", "beside", "carved_there"), [
    (0.2, 0.2, True), (0.3, 0.2, False), (0.3, 0.3, True)])
def test_colours_near_that_of_what_is_behind_are_not_carved(patch: float, beside: float, carved_there: bool) -> None:
    """A ray is empty where the target equals what is behind: as well as beside the field."""
    one = camera((0, 0, 4), size=40)
    behind = np.full((40, 40, 3), 0.2, np.float32)
    shown, target = behind.copy(), np.full((40, 40, 3), beside, np.float32)
    shown[8:32, 8:32] = target[8:32, 8:32] = 0.8
    target[14:26, 14:26] = patch
    found = evidence(one, target, None, [shown, shown], [behind, behind])
    assert (found.empty[20, 20] < 0.0) == carved_there
    assert found.empty[10, 10] > 0.0 and found.empty[2, 2] > 0.0


def test_carving_and_adding_follow_rays() -> None:
    """Carved: what one view sees past. Added: what one view misses and no view sees past."""
    seen_by = [camera((0, 0, 4), size=40), camera((4, 0, 0), size=40)]
    middle = np.zeros((40, 40), bool)
    middle[18:22, 18:22] = True
    nowhere, everywhere = np.zeros_like(middle), np.ones_like(middle)
    place = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])
    kind = type(evidence(seen_by[0], np.zeros((40, 40, 3), np.float32), None, [np.zeros((40, 40, 3), np.float32)] * 2,
                         [np.zeros((40, 40, 3), np.float32)] * 2))  # fmt: skip
    views_ = [kind(one, 1, signed_distance(empty), signed_distance(filled), signed_distance(middle))
              for one, empty, filled in zip(seen_by, (middle, nowhere), (everywhere, middle), strict=True)]  # fmt: skip
    inside = carved(np.full(4, -0.3), place, 1.0, views_)
    assert (inside[[0, 1, 3]] > 0.0).all() and inside[2] < 0.0
    outside = added(np.full(4, 0.3), place, 1.0, views_)
    np.testing.assert_array_equal(outside < 0.0, [False, False, True, True])


def test_signed_distances_are_exact() -> None:
    rng = np.random.default_rng(0)
    region = rng.random((17, 23)) < 0.2
    at = np.argwhere(np.ones_like(region)).reshape(17, 23, 2)
    for y, x in ((0, 0), (8, 11), (16, 22), (5, 3)):
        away = np.linalg.norm(at[region != region[y, x]] - [y, x], axis=1).min() - 0.5
        assert signed_distance(region)[y, x] == pytest.approx(-away if region[y, x] else away)
    assert (signed_distance(np.zeros((5, 4), bool)) > 0.0).all()


def test_parts_are_connected_along_axes() -> None:
    inside = np.zeros((4, 4, 4), bool)
    inside[0, 0, :2] = inside[2, 2, 2] = inside[3, 3, 3] = True
    label = parts(inside)
    assert label.max() == 2
    assert label[0, 0, 0] == label[0, 0, 1] != label[2, 2, 2]
    assert (label[~inside] == -1).all()


@pytest.mark.parametrize(("turns", "k", "due"), [(5, 4, True), (5, 5, False), (0, 4, False), (5, 94, False)])
def test_when_steps_are_due(turns: int, k: int, due: bool) -> None:
    assert topology_is_due(turns, k, 1, 100) == due


def test_the_option_is_checked() -> None:
    with pytest.raises(ValueError, match="FieldSteps: topology_every"):
        FieldSteps(topology_every=-1)

"""Steps of the coefficients of fields, with the gradient of a volume in the place of that of pictures."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Field, FieldSteps, Scene
from edgegrad.distance_fields import eikonal, spline, to_mesh, topology
from edgegrad.fitting.fields.variables import Coefficients
from edgegrad.fitting.variables import unknown
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.fields.splines import exact_sphere, sampled

PATH = "fields.ball.values"
CELL = 2.0 / 32.0


def scene_of(field: Field) -> Scene:
    scene = shapes.scene(*shapes.cube())
    scene.fields = {"ball": field}
    return scene


def ball(radius: float = 0.5, size: int = 35) -> Field:
    return sampled(lambda p: np.linalg.norm(p, axis=-1) - radius, size)


def volume_and_gradient(values: np.ndarray) -> tuple[float, np.ndarray]:
    """Volume with a border that is a cell wide, and its gradient."""
    part = 1.0 / (1.0 + np.exp(np.clip(spline.node_values(values) / (0.5 * CELL), -50, 50)))
    by = -part * (1.0 - part) / (0.5 * CELL) * CELL**3
    for axis in range(3):
        by = spline.spread(by, axis, spline.NODE_WEIGHTS)
    return float(part.sum() * CELL**3), by


def fitted(field: Field, goal: float, iterations: int, options: FieldSteps) -> tuple[Field, list[float]]:
    scene = scene_of(field)
    item = unknown(scene, PATH, None, None, None, iterations, options)
    assert isinstance(item, Coefficients)
    losses = []
    for k in range(iterations):
        volume, gradient = volume_and_gradient(scene.fields["ball"].values.astype(np.float64))
        losses.append(abs(volume - goal) / goal)
        value = item.take_step((volume - goal) * gradient, 0.05 + 0.95 * 0.5 * (1.0 + np.cos(np.pi * k / iterations)))
        parameters.put(scene, PATH, value)
        scene.validate()
    return scene.fields["ball"], losses


@pytest.mark.parametrize("name", ["lower", "upper"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_boxes_keep_their_orientation(name: str, sign: float) -> None:
    """Gradients that push a corner of the box to one side never bring it past the other one."""
    scene = scene_of(ball(size=8))
    start = getattr(scene.fields["ball"], name).copy()
    item = unknown(scene, f"fields.ball.{name}", None, None, None)
    for _ in range(100):
        parameters.put(scene, item.path, item.take_step(np.array([sign, -sign, 0.0]), 1.0))
        scene.validate()
    assert (getattr(scene.fields["ball"], name) != start)[:2].all()


@pytest.mark.parametrize("coarser", [0, 1, 2])
@pytest.mark.parametrize("radius", [0.35, 0.65])
def test_a_ball_gets_the_volume_that_is_wanted(coarser: int, radius: float) -> None:
    goal = 4.0 / 3.0 * np.pi * radius**3
    field, losses = fitted(ball(), goal, 60, FieldSteps(coarser=coarser))
    assert field.values.shape == (35, 35, 35)
    assert losses[-1] < 0.05 < losses[0]
    mesh = to_mesh(field)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), radius, atol=0.7 * CELL)
    assert topology(mesh).genus == 0
    assert eikonal(field)[0] < 0.05


@pytest.mark.parametrize(("start", "nodes"), [
    (ball(0.65), 17), (ball(0.65, 67), 17), (ball(0.65, 34), 32), (ball(0.65, 23), 21),
    (sampled(lambda p: np.abs(p).max(axis=-1) - 0.6, 35), 33)])
def test_a_fit_begins_on_coarser_grids_that_have_the_start(start: Field, nodes: int) -> None:
    """A smooth ball; one with an odd number of cells, and one with few; and a box, whose edges coarse cells round."""
    item = unknown(scene_of(start), PATH, None, None, None, 20)
    assert isinstance(item, Coefficients)
    assert item.nodes().shape == (nodes, nodes, nodes)


def test_a_step_moves_the_surface_by_less_than_a_cell() -> None:
    scene = scene_of(exact_sphere(0.5, 35))  # not a distance: its gradient has the length 1 at the surface only
    item = unknown(scene, PATH, 0.5, None, None, 20, FieldSteps(coarser=0))
    rng = np.random.default_rng(0)
    before = 0.5
    for _ in range(4):
        noise = rng.normal(size=(35, 35, 35))
        parameters.put(scene, PATH, item.take_step(np.abs(noise), 1.0))
        radius = np.linalg.norm(to_mesh(scene.fields["ball"]).vertices, axis=1)
        assert np.all(np.abs(radius - before) < CELL)
        before = float(radius.mean())


def test_the_surface_stays_in_its_box_and_never_vanishes() -> None:
    for sign in (1.0, -1.0):
        scene = scene_of(ball())
        item = unknown(scene, PATH, 0.5, None, None, 100, None)
        for _ in range(80):
            parameters.put(scene, PATH, item.take_step(np.full((35, 35, 35), sign), 1.0))
        assert topology(to_mesh(scene.fields["ball"])).is_closed_manifold


def test_regularisers_smooth() -> None:
    rng = np.random.default_rng(0)
    noisy = ball()
    noisy.values = noisy.values + 0.4 * CELL * rng.normal(size=(35, 35, 35)).astype(np.float32)
    rough = []
    for weight in (0.0, 1.0):
        scene = scene_of(noisy)
        item = unknown(scene, PATH, 0.1, None, None, 20, FieldSteps(laplacian=weight))
        for _ in range(20):
            parameters.put(scene, PATH, item.take_step(np.zeros((35, 35, 35)), 1.0))
        rough.append(float(np.linalg.norm(to_mesh(scene.fields["ball"]).vertices, axis=1).std()))
    assert rough[1] < 0.7 * rough[0]


@pytest.mark.parametrize(("field", "step", "options", "words"), [
    (Field(np.ones((35, 35, 35)), "clay"), None, {}, "no surface from which"),
    (ball(), 0.6, {}, "must not be above 0.5 cells"),
    (ball(), None, {"coarser": 3}, "cannot be made coarser 3 times"),
    (ball(0.5, 34), None, {"coarser": 1}, "cannot be made coarser"),
    (ball(), None, {"most_memory": 1e6}, "more than most_memory"),
])  # fmt: skip
def test_errors(field: Field, step: float | None, options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        unknown(scene_of(field), PATH, step, None, None, 10, FieldSteps(**options))


@pytest.mark.parametrize("options", [{"coarser": -1}, {"redistance_every": 0}, {"laplacian": -1.0},
                                     {"smoothness": np.nan}])  # fmt: skip
def test_options_are_checked(options: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=f"FieldSteps: {next(iter(options))}"):
        FieldSteps(**options)

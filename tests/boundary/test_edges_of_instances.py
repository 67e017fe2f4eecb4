"""Very many edges of instances: a search lists a random part of them, and the mean of a derivative stays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from edgegrad import AreaLight, Camera, Material, Mesh, Renderer, Scene, SunLight, World
from tests.support.engine_options import set_options
from tests.support.shapes import ball, cube
from tests.support.small_scenes import need

SEEDS, FEW = 48, 40
OPTIONS: dict[str, Any] = {"spp": 8, "max_depth": 3}
PATHS = ["meshes.balls.instances", "meshes.box.vertices", "lights.area.to_world"]


def scene() -> Scene:
    """Balls that share a mesh, and a box, over a floor that they light and shade."""
    vertices, faces = ball(1)
    places = np.tile(np.eye(4), (9, 1, 1))
    places[:, :3, :3] *= 0.4
    places[:, :3, 3] = [[x, y, 0.8] for x in (-1.2, 0.0, 1.2) for y in (-1.2, 0.0, 1.2)]
    corners, sides = cube()
    floor = np.array([[-4.0, -4.0, 0.0], [4.0, -4.0, 0.0], [4.0, 4.0, 0.0], [-4.0, 4.0, 0.0]])
    pose = np.eye(4)
    pose[2, 3] = 8.0
    above = np.eye(4)
    above[:3, 3] = [0.5, 0.3, 4.0]
    meshes = {"balls": Mesh(vertices, faces, ("clay",), instances=places),
              "box": Mesh(0.2 * corners + [0.6, 0.6, 1.5], sides, ("clay",)),
              "floor": Mesh(floor, np.array([[0, 1, 2], [0, 2, 3]], np.int32), ("clay",))}  # fmt: skip
    lights = {"area": AreaLight(to_world=above, power=60.0, size=np.array([0.6, 0.6])),
              "sun": SunLight(np.array([0.4, 0.2, -1.0]))}  # fmt: skip
    return Scene(Camera(to_world=pose, width=16, height=16), meshes, {"clay": Material(np.full(3, 0.7))}, lights,
                 World(np.full(3, 0.3)))  # fmt: skip


def renderer(most: int, threads: int = 0) -> Renderer:
    out = Renderer(scene(), threads=threads)
    set_options(out, most_placed_edges=most)
    return out


ADJOINT = (np.linspace(-1.0, 1.0, 16)[:, None, None] * np.linspace(0.0, 1.0, 16)[None, :, None]
           * np.ones(3)).astype(np.float32)  # fmt: skip


def sums(most: int, term: str) -> np.ndarray:
    """(seeds, n) of each seed: the gradients by the shift of all balls, of one of them, of the box and of the light."""
    out, made = [], renderer(most)
    for seed in range(SEEDS):
        gradient = made.render_backward(ADJOINT, PATHS, seed=seed, terms=[term], **OPTIONS)
        balls = gradient[PATHS[0]][:, :3, 3]
        out.append(np.concatenate([balls.sum(axis=0), balls[4], gradient[PATHS[1]].sum(axis=0),
                                   gradient[PATHS[2]][:3, 3]]))  # fmt: skip
    return np.array(out)


@pytest.mark.parametrize("term", ["primary", "shadow", "indirect"])
def test_a_part_of_the_edges_gives_the_same_mean(term: str) -> None:
    need("native")
    part, whole = sums(FEW, term), sums(1 << 22, term)
    assert np.abs(part[0] - whole[0]).max() > 0.0  # it is another estimate
    error = np.sqrt((part.var(axis=0, ddof=1) + whole.var(axis=0, ddof=1)) / SEEDS)
    size = np.abs(whole.mean(axis=0)).max()
    assert size > 4.0 * np.median(error)
    assert np.all(np.abs(part.mean(axis=0) - whole.mean(axis=0)) < 4.5 * error + 1e-6 * size)


def test_both_modes_and_all_numbers_of_threads_list_the_same_edges() -> None:
    need("native")
    one, two = renderer(FEW, 1), renderer(FEW, 2)
    rng = np.random.default_rng(1)
    tangent = rng.normal(size=(9, 4, 4))
    tangent[:, 3] = 0.0
    image = one.render_forward({PATHS[0]: tangent}, seed=3, **OPTIONS)
    np.testing.assert_array_equal(image, two.render_forward({PATHS[0]: tangent}, seed=3, **OPTIONS))
    gradient = one.render_backward(ADJOINT, [PATHS[0]], seed=3, **OPTIONS)[PATHS[0]]
    np.testing.assert_array_equal(gradient, two.render_backward(ADJOINT, [PATHS[0]], seed=3, **OPTIONS)[PATHS[0]])
    np.testing.assert_allclose(np.vdot(image.astype(float), ADJOINT), np.vdot(gradient, tangent), rtol=1e-3)


def test_a_call_that_lists_all_edges_is_not_changed_by_one_that_does_not() -> None:
    need("native")
    made, fresh = renderer(FEW), renderer(1 << 22)
    made.render_backward(ADJOINT, PATHS, **OPTIONS)
    set_options(made, most_placed_edges=1 << 22)
    for path, gradient in fresh.render_backward(ADJOINT, PATHS, **OPTIONS).items():
        np.testing.assert_array_equal(made.render_backward(ADJOINT, PATHS, **OPTIONS)[path], gradient)


def test_a_decision_counts_all_edges() -> None:
    need("native")
    made = renderer(FEW)
    before = {d.part: (d.outcome, d.edges) for d in made.decide(PATHS, max_depth=3)}
    made.render_backward(ADJOINT, PATHS, **OPTIONS)
    assert {d.part: (d.outcome, d.edges) for d in made.last_decisions} == before

"""Fits of the attributes of distance fields."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Camera, Field, FieldSteps, Material, Renderer, Scene, Target, World, fit
from edgegrad.expression import Attribute
from edgegrad.fitting.fields import grids
from edgegrad.rendering.options import FIELD_EDGES
from tests.support.fields.splines import exact_sphere
from tests.support.small_scenes import camera, need

PATH = "fields.ball.attributes.paint"


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def painted(paint: Any, size: int = 24, **others: Any) -> Scene:
    """A ball with colours in a white environment."""
    field: Field = exact_sphere(0.7, 11, attributes={"paint": np.asarray(paint)})
    clay = Material(textures={"base_color": Attribute("paint")})
    return Scene(**({"camera": camera(size=size), "materials": {"clay": clay},
                     "world": World(np.ones(3)), "fields": {"ball": field}} | others))


def around(count: int) -> list[Camera]:
    return [camera((4 * np.sin(a), up, 4 * np.cos(a)), size=24)
            for k, a in enumerate(np.linspace(0, 2 * np.pi, count, endpoint=False)) for up in (1.5 * (-1) ** k,)]


def stripes(size: tuple[int, int, int]) -> Any:
    axes = np.meshgrid(*[np.linspace(-1, 1, n) for n in size], indexing="ij")
    return 0.5 + 0.3 * np.sin(2.0 * np.stack(axes, axis=-1) + [0.0, 1.0, 2.0])


@pytest.mark.parametrize("coarser", [0, 1])
def test_colours_are_found(coarser: int) -> None:
    """The colours of a ball from pictures of all sides; what no picture sees follows its surroundings."""
    wanted = stripes((9, 9, 5))
    cameras = around(6)
    targets = [Target(edgegrad.render(painted(wanted, camera=one), spp=64, seed=5), camera=one) for one in cameras]
    scene = painted(np.full_like(wanted, 0.5))
    result = fit(scene, targets, [PATH], iterations=40, spp=4, field_steps=FieldSteps(coarser=coarser))
    found = result.values[PATH]
    assert found.dtype == np.float32 and found.min() >= 0.0 and found.max() <= 1.0
    assert not result.notes
    places = np.stack(np.meshgrid(*[np.linspace(-1, 1, n) for n in wanted.shape[:3]], indexing="ij"), axis=-1)
    near = np.abs(np.linalg.norm(places, axis=-1) - 0.7) < 0.2
    assert np.sqrt(np.mean((found - wanted)[near] ** 2)) < 0.3 * np.sqrt(np.mean((0.5 - wanted)[near] ** 2))


def test_a_coarse_grid_with_cells_twice_as_large_is_on_the_finer_one() -> None:
    """Nothing changes as the fit goes on to the finer grid; a grid of one value stays one."""
    scene = painted(stripes((9, 5, 1)))
    item = grids.Attribute(scene, PATH, 0.01, 8, FieldSteps(coarser=2))
    nothing = np.zeros((9, 5, 1, 3))
    shown = [item.take_step(nothing, 1.0) for _ in range(6)]
    assert [one.shape for one in shown] == [(9, 5, 1, 3)] * 6
    assert item._values.shape == (9, 5, 1, 3)
    np.testing.assert_allclose(shown[5], shown[0], atol=1e-12)
    assert np.abs(shown[0] - stripes((9, 5, 1))).max() > 0.01


def test_gradients_of_coarse_grids_are_transposed_interpolation() -> None:
    """A step of a coarse grid goes down along its own gradient, for sizes that no cells divide, too."""
    scene = painted(np.full((8, 6, 5, 3), 0.5))
    item = grids.Attribute(scene, PATH, 0.01, 100, FieldSteps(coarser=1, smoothness=0.0))
    rng = np.random.default_rng(1)
    for _ in range(20):
        gradient = rng.normal(size=(8, 6, 5, 3))
        before = item.take_step(np.zeros_like(gradient), 0.0)
        item._restart()
        after = item.take_step(gradient, 1.0)
        assert np.sum((after - before) * gradient) < 0.0


def test_a_fit_goes_on_from_its_state() -> None:
    scene = painted(np.full((5, 5, 5, 3), 0.5))
    rng = np.random.default_rng(2)
    gradients = rng.normal(size=(10, 5, 5, 5, 3))
    whole = grids.Attribute(scene, PATH, None, 10, FieldSteps(coarser=1))
    wanted = [whole.take_step(g, 1.0) for g in gradients]
    first = grids.Attribute(scene, PATH, None, 10, FieldSteps(coarser=1))
    for g in gradients[:7]:
        first.take_step(g, 1.0)
    other = grids.Attribute(scene, PATH, None, 10, FieldSteps(coarser=1))
    other.restore(first.state())
    np.testing.assert_array_equal([other.take_step(g, 1.0) for g in gradients[7:]], wanted[7:])


@pytest.mark.parametrize(("detailed", "level"), [(False, 1), (True, 0)])
def test_coarser_grids_have_the_start(detailed: bool, level: int) -> None:
    values = np.full((17, 17, 1, 3), 0.5, np.float32)
    if detailed:
        values[5, 8] = 0.7
    assert grids.Attribute(painted(values), PATH, None, 10, None)._level == level


def test_values_stay_in_their_range() -> None:
    item = grids.Attribute(painted(np.full((3, 3, 3, 3), 0.5)), PATH, 0.4, 10, None)
    for _ in range(5):
        shown = item.take_step(np.ones((3, 3, 3, 3)), 1.0)
    assert not shown.any()


@pytest.mark.parametrize("edges", FIELD_EDGES)
def test_derivatives_of_outlines_are_those_that_were_chosen(edges: str, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    original = Renderer.render_backward

    def spied(self: Renderer, *args: Any, **options: Any) -> Any:
        seen.append(options["field_edges"])
        return original(self, *args, **options)

    monkeypatch.setattr(Renderer, "render_backward", spied)
    scene = painted(np.full((2, 2, 2, 3), 0.5))
    fit(scene, np.full((24, 24, 3), 0.2), ["fields.ball.values"], iterations=2, spp=1, field_edges=edges)
    assert set(seen) == {edges}


def test_wrong_estimators_of_outlines_are_refused() -> None:
    with pytest.raises(ValueError, match="field_edges must be one of outlines, reparameterised, relaxed"):
        fit(painted(np.ones((2, 2, 2, 3))), np.ones((24, 24, 3)), [PATH], iterations=1, field_edges="sharp")

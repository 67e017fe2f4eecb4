"""Changed fields: the picture after an update is that of a new renderer, for any number of threads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad import AreaLight, Field, PointLight, Renderer, Scene, World
from tests.support.fields.rays import renderer_of, trace
from tests.support.fields.splines import exact_sphere, points, sampled, torus
from tests.support.small_scenes import camera, matte, need, rectangle


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def scene(field: Field) -> Scene:
    """A field over a floor."""
    floor = rectangle((0, -0.9, 0), (0, 0, 2), (2, 0, 0), "clay")
    return Scene(camera((0.5, 1.5, 3.0), (0, 0, 0), 24), {"floor": floor}, {"clay": matte(0.6, 0.5, 0.4)},
                 fields={"body": field}, world=World(np.ones(3)))


def dented(field: Field) -> Field:
    """The field with other values in one corner."""
    values = field.values.copy()
    values[3:8, 4:9, -9:-2] += 0.2
    return replace(field, values=values)


CHANGES = {
    "dent": dented,
    "grown": lambda f: replace(f, values=f.values - np.float32(0.1)),
    "gone": lambda f: replace(f, values=np.abs(f.values) + np.float32(0.1)),
    "moved": lambda f: replace(f, transform=np.array([[0, -1, 0, 0.2], [1, 0, 0, 0], [0, 0, 0.8, 0], [0, 0, 0, 1.0]])),
    "box": lambda f: replace(f, lower=np.array([-0.5, -1.0, -1.0])),
    "hidden": lambda f: replace(f, visible_to=frozenset(["shadow"])),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("twice", [False, True])
def test_an_update_equals_a_new_renderer(change: str, twice: bool) -> None:
    field = sampled(torus, (24, 20, 18))
    made = scene(field)
    renderer = Renderer(made)
    renderer.render(spp=1)
    if twice:
        made.fields = {"body": replace(field, values=field.values + np.float32(0.02))}
        renderer.update()
        renderer.render(spp=1)
    made.fields = {"body": CHANGES[change](field)}
    renderer.update()
    options = {"spp": 4, "max_depth": 3, "seed": 5}
    new = Renderer(scene(made.fields["body"]))
    np.testing.assert_array_equal(renderer.render(**options), new.render(**options))


def test_changes_in_place_are_taken() -> None:
    made = scene(sampled(torus, 20))
    renderer = Renderer(made)
    renderer.render(spp=1)
    made.fields["body"].values += np.float32(0.05)
    with pytest.raises(ValueError, match="field 'body': values has changed since the last update"):
        renderer.render(spp=1)
    renderer.update(["fields.body.values"])
    np.testing.assert_array_equal(renderer.render(spp=4), Renderer(scene(made.fields["body"])).render(spp=4))


def test_one_shot_pictures_see_changes_in_place() -> None:
    made = scene(sampled(torus, 20))
    before = edgegrad.render(made, 4)
    np.testing.assert_array_equal(edgegrad.render(made, 4), before)
    made.fields["body"].values += np.float32(0.05)
    after = edgegrad.render(made, 4)
    assert not np.array_equal(after, before)
    np.testing.assert_array_equal(after, Renderer(made).render(spp=4))


def test_any_number_of_threads_gives_the_same_bits() -> None:
    made = scene(sampled(torus, 40))
    options = {"spp": 4, "max_depth": 4, "seed": 1}
    first = Renderer(made, threads=1).render(**options)
    for threads in (2, 3, 5):
        np.testing.assert_array_equal(Renderer(made, threads=threads).render(**options), first)


@pytest.mark.parametrize("instruction_set", ["scalar", ""])
def test_instruction_sets_agree(instruction_set: str) -> None:
    from edgegrad.rendering.native_engine import Engine, instruction_sets

    if instruction_set and instruction_set not in instruction_sets():
        pytest.skip("this build has one instruction set")
    field = sampled(torus, 30)
    rng = np.random.default_rng(3)
    origins, ways = rng.uniform(-1, 1, (500, 3)), rng.normal(size=(500, 3))
    renderer = renderer_of(field)
    wanted = trace(renderer, origins, ways)
    renderer._engine = Engine(renderer.tables, 1, instruction_set)
    np.testing.assert_allclose(trace(renderer, origins, ways), wanted, rtol=1e-5, atol=1e-6)


def test_bricks_follow_small_changes() -> None:
    """Coefficients that change one by one, anywhere: rays hit what a new renderer's do."""
    rng = np.random.default_rng(0)
    field = exact_sphere(0.5, (13, 17, 11))
    renderer = renderer_of(field)
    origins, ways = rng.uniform(-1, 1, (400, 3)), rng.normal(size=(400, 3))
    trace(renderer, origins, ways)
    for _ in range(12):
        at = tuple(rng.integers(0, n) for n in field.values.shape)
        field.values[at] = -field.values[at]
        renderer.update()
        np.testing.assert_array_equal(trace(renderer, origins, ways), trace(renderer_of(field), origins, ways))
    assert points((13, 17, 11)).shape == (13, 17, 11, 3)


def gradients(renderer: Renderer, path: str = "fields.body.values") -> NDArray[np.floating]:
    """A gradient with shadows of the field and its crossings of the floor."""
    adjoint = np.ones((24, 24, 3), np.float32)
    return np.asarray(renderer.render_backward(adjoint, [path], spp=4, seed=3, max_depth=3)[path])


def lit_scene(field: Field, width: float = 1.0, aside: float = 0.5) -> Scene:
    """The field over its floor, under a rectangle, a lamp without size and an environment."""
    pose = np.array([[1.0, 0, 0, 0.3], [0, 0, 1.0, 1.5], [0, -1.0, 0, 0.2], [0, 0, 0, 1.0]])
    return replace(scene(field), lights={"panel": AreaLight(pose, size=np.array([width, 1.0]), power=60.0),
                                         "lamp": PointLight(np.array([aside, 1.5, -0.4]), power=20.0)})


@pytest.mark.parametrize("change", [*CHANGES, "camera", "width", "aside"])
def test_gradients_after_an_update_equal_those_of_a_new_renderer(change: str) -> None:
    """What is kept of fields, their viewers and lights is found again where these have changed."""
    field = sampled(torus, (24, 20, 18), lower=(-1.0, -1.0, -0.8))
    made = lit_scene(field)
    renderer = Renderer(made)
    before = gradients(renderer)
    np.testing.assert_array_equal(gradients(renderer), before)
    if change == "camera":
        made.camera = camera((-0.8, 1.5, 2.0), (0, 0, 0), 24)
    elif change in ("width", "aside"):
        made.lights = lit_scene(field, **{change: 1.8}).lights
    else:
        made.fields = {"body": CHANGES[change](field)}
    renderer.update()
    after = gradients(renderer)
    assert not np.array_equal(after, before)
    np.testing.assert_array_equal(after, gradients(Renderer(made)))

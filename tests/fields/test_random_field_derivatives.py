"""Derivatives of random fields are finite, and both modes agree: noisy, flat and stretched grids of all sizes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edgegrad import AreaLight, Field, Material, Renderer, Scene, World
from tests.support.fields.splines import points
from tests.support.small_scenes import camera, matte, need, rectangle

PIXELS = 12
PATHS = ["fields.thing.values", "fields.thing.transform", "fields.thing.lower", "fields.thing.upper"]

SHAPES = {
    "ball": lambda p: np.linalg.norm(p, axis=-1) - 0.6,
    "ball that leaves the grid": lambda p: np.linalg.norm(p, axis=-1) - 1.2,
    "ball around the camera": lambda p: 0.8 - np.linalg.norm(p, axis=-1),
    "plane": lambda p: p[..., 2] + 0.1,
    "two sheets that touch": lambda p: p[..., 2] ** 2,
    "constant": lambda p: np.zeros(p.shape[:-1]),
    "no surface": lambda p: np.ones(p.shape[:-1]),
    "steep": lambda p: 1e6 * (np.linalg.norm(p, axis=-1) - 0.6),
    "nearly flat": lambda p: 1e-6 * (np.linalg.norm(p, axis=-1) - 0.6),
}


def scene_of(shape: str, size: tuple[int, int, int], noise: float, stretch: float, scale: float, shiny: bool,
             seed: int) -> Scene:
    """A field over a floor, under a rectangle and an even sky, `scale` times as large as a scene of metres."""
    rng = np.random.default_rng(seed)
    values = SHAPES[shape](points(size))
    values = values + noise * np.abs(values).max() * rng.normal(size=size)
    to_world = np.eye(4)
    to_world[:3, :3] += 0.2 * rng.normal(size=(3, 3))
    to_world[:3, 0] *= stretch
    to_world[:3] *= scale
    field = Field(values.astype(np.float32), "clay", np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0]), to_world)
    lamp = np.eye(4)
    lamp[:3, 3] = np.array([0.5, 0.5, 3.0]) * scale
    view = camera(tuple(scale * np.array([0.3, -2.6, 1.8])), (0, 0, 0), PIXELS, 0.8, up=(0, 0, 1))
    view = replace(view, clip_start=1e-3 * scale, clip_end=1e3 * scale)
    floor = rectangle((0, 0, -1.5 * scale), (3 * scale, 0, 0), (0, 3 * scale, 0), "floor")
    clay = Material(np.full(3, 0.7), kind="GLOSSY", roughness=0.2) if shiny else matte(0.7, 0.6, 0.5)
    light = AreaLight(lamp, np.full(2, scale), power=100.0 * scale**2)
    return Scene(view, {"floor": floor}, {"clay": clay, "floor": matte(0.5, 0.5, 0.5)}, {"lamp": light},
                 World(np.full(3, 0.5)), fields={"thing": field})


@settings(max_examples=300, deadline=None)
@given(shape=st.sampled_from(sorted(SHAPES)), size=st.tuples(*[st.integers(4, 12)] * 3),
       noise=st.sampled_from([0.0, 0.02, 0.5]), stretch=st.sampled_from([0.01, 1.0, 30.0]),
       scale=st.sampled_from([1e-3, 1.0, 1e4]), shiny=st.booleans(), seed=st.integers(0, 2**32 - 1))
def test_derivatives_are_finite_and_both_modes_agree(shape: str, size: tuple[int, int, int], noise: float,
                                                     stretch: float, scale: float, shiny: bool, seed: int) -> None:
    need("native")
    scene = scene_of(shape, size, noise, stretch, scale, shiny, seed)
    renderer = Renderer(scene, threads=1)
    rng = np.random.default_rng(seed)
    adjoint = rng.normal(size=(PIXELS, PIXELS, 3)).astype(np.float32)
    gradient = renderer.render_backward(adjoint, PATHS, spp=2, max_depth=3, seed=1)
    tangents = {path: rng.normal(size=np.shape(value)) for path, value in gradient.items()}
    picture = renderer.render_forward(tangents, spp=2, max_depth=3, seed=1)
    assert np.isfinite(picture).all()
    assert all(np.isfinite(value).all() for value in gradient.values())
    products = [np.asarray(gradient[path], float) * tangents[path] for path in PATHS]
    forward, size_of = adjoint.astype(float) * picture, sum(float(np.abs(p).sum()) for p in products)
    size_of += float(np.abs(forward).sum())
    assert abs(sum(float(p.sum()) for p in products) - float(forward.sum())) <= 1e-4 * size_of + 1e-30


@pytest.mark.parametrize("factor", [2.0**-100, 2.0**100])
def test_factors_of_all_values_divide_the_gradient_and_change_nothing_else(factor: float) -> None:
    need("native")
    scene = scene_of("ball", (9, 9, 9), 0.0, 1.0, 1.0, True, 1)
    other = scene_of("ball", (9, 9, 9), 0.0, 1.0, 1.0, True, 1)
    other.fields["thing"].values = scene.fields["thing"].values * np.float32(factor)
    adjoint = np.random.default_rng(0).normal(size=(PIXELS, PIXELS, 3)).astype(np.float32)
    one, two = (Renderer(s, threads=1) for s in (scene, other))
    np.testing.assert_allclose(two.render(spp=2), one.render(spp=2), rtol=1e-4, atol=1e-5)
    a, b = (r.render_backward(adjoint, PATHS, spp=2, max_depth=3, seed=1) for r in (one, two))
    for path in PATHS:
        scaled = b[path] * (factor if path.endswith("values") else 1.0)
        np.testing.assert_allclose(scaled, a[path], rtol=1e-3, atol=1e-3 * np.abs(a[path]).max())

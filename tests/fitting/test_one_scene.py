"""A fit changes the engine's scene once in an iteration: its pictures and its derivatives read the same tables."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import expression as e
from edgegrad.rendering import native_engine
from tests.support import small_scenes

pytest.importorskip("edgegrad._native")


def textured_scene() -> edgegrad.Scene:
    """A quad with an image and computed roughness, whose anisotropy is 0, before a black environment with an image."""
    quad = small_scenes.rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "paint")
    corners = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)
    quad = edgegrad.Mesh(quad.vertices, quad.faces, quad.materials, attributes={"UVMap": corners})
    rng = np.random.default_rng(3)
    paint = edgegrad.Material(np.full(3, 0.7), roughness=0.4, metallic=1.0, textures={
        "base_color": e.ImageTexture("dots", e.Attribute("UVMap")),
        "roughness": e.Math("ADD", e.Math("MULTIPLY", 0.5, 0.6), 0.1),
    })  # fmt: skip
    return edgegrad.Scene(
        small_scenes.camera(size=8), {"quad": quad}, {"paint": paint},
        {"lamp": edgegrad.PointLight(np.array([0.5, 0.5, 2.0]), 60.0)},
        edgegrad.World(np.zeros(3), 1.0, "sky"),
        images={"dots": edgegrad.Image(rng.random((4, 4, 4), np.float32)), "sky": edgegrad.Image(
            rng.random((4, 8, 3), np.float32))},
    )  # fmt: skip


def count_updates(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    calls: list[str] = []

    def counted(name: str) -> Any:
        update = getattr(native_engine.Engine, name)

        def run(self: native_engine.Engine, *arguments: Any) -> None:
            calls.append(name)
            update(self, *arguments)

        return run

    for name in ("_update", "_update_values"):
        monkeypatch.setattr(native_engine.Engine, name, counted(name))
    return calls


PARAMETERS = [
    ["materials.paint.textures.roughness"], ["materials.paint.anisotropy"], ["materials.paint.coat_weight"],
    ["world.color"], ["images.dots.pixels"],
    ["materials.paint.textures.roughness", "materials.paint.anisotropy", "world.color", "images.dots.pixels"],
]  # fmt: skip


@pytest.mark.parametrize("wrt", PARAMETERS, ids=lambda wrt: wrt[0] if len(wrt) == 1 else "all")
def test_an_iteration_changes_the_scene_once(wrt: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    scene = textured_scene()
    renderer = edgegrad.Renderer(scene, engine="native", wrt=wrt)
    adjoint = np.ones((8, 8, 3), np.float32)
    calls = count_updates(monkeypatch)
    for seed in range(2):
        renderer.update(wrt)
        for _ in range(2):  # views
            renderer.render(spp=1, seed=seed)
            renderer.render_backward(adjoint, wrt, spp=1, seed=seed)
        assert len(calls) == 1
        calls.clear()


def test_a_fit_makes_its_renderer_for_its_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, wrt = textured_scene(), PARAMETERS[-1]
    calls = count_updates(monkeypatch)
    target = edgegrad.Target(edgegrad.render(scene, spp=1))
    calls.clear()
    iterations = 3
    edgegrad.fit(scene, [target], wrt=wrt, iterations=iterations, spp=1)
    # One for each step, and one for the values that the fit returns.
    assert len(calls) <= iterations + 1


@pytest.mark.parametrize("wrt", PARAMETERS[:-1], ids=lambda wrt: wrt[0])
def test_derivatives_are_those_of_a_renderer_that_is_told_nothing(wrt: Collection[str]) -> None:
    scene = textured_scene()
    adjoint = np.random.default_rng(0).normal(size=(8, 8, 3)).astype(np.float32)
    told = edgegrad.Renderer(scene, engine="native", wrt=list(wrt))
    untold = edgegrad.Renderer(scene, engine="native")
    told.update(list(wrt))
    for path, gradient in told.render_backward(adjoint, list(wrt), spp=4).items():
        assert np.array_equal(gradient, untold.render_backward(adjoint, list(wrt), spp=4)[path])


def test_large_arrays_are_used_again() -> None:
    scene = textured_scene()
    renderer = edgegrad.Renderer(scene, wrt=["materials.paint.textures.roughness"])
    before = renderer._tables.textures
    renderer.update(["materials.paint.textures.roughness"])
    after = renderer._tables.textures
    assert before is not None and after is not None and after is not before
    assert after.pixels is before.pixels and after.attributes is before.attributes
    scene.images["dots"].pixels[...] = 0.5
    renderer.update(["images.dots.pixels"])
    fresh = edgegrad.Renderer(scene, wrt=["materials.paint.textures.roughness"])
    assert np.array_equal(renderer.render(spp=2), fresh.render(spp=2))

"""How many samples the interior term takes beside boundary terms: fewer where its noise is far below theirs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import edgegrad
from edgegrad import TERMS
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes, small_scenes

SIZE, SPP = 128, 16


def quiet() -> edgegrad.Scene:
    """A sheet under a lamp far above it, before a patchwork of lights: nearly all noise is that of its border."""
    sheet = small_scenes.rectangle((0, 0, 0), (0.6, 0, 0), (0, 0.6, 0), "clay")
    vertices, faces = shapes.sheet(60, 4.0)
    which = np.random.default_rng(0).integers(0, 2, len(faces)).astype(np.int32)
    patchwork = edgegrad.Mesh(vertices - [0.0, 0.0, 0.5], faces, ("dark", "bright"), which)
    materials = {"clay": small_scenes.matte(0.7, 0.5, 0.3), "dark": small_scenes.matte(0.0, 0.0, 0.0),
                 "bright": small_scenes.glowing(9.0)}
    lamp = edgegrad.PointLight(np.array([0.8, 0.5, 2.5]), 100.0)
    return edgegrad.Scene(small_scenes.camera(size=SIZE), {"sheet": sheet, "patchwork": patchwork}, materials,
                          {"lamp": lamp})


def loud() -> edgegrad.Scene:
    """A floor under a small lamp close to it, whose light changes by much from sample to sample."""
    scene = small_scenes.floating_box()
    scene.camera = small_scenes.camera((0.4, 2.2, 3.0), (0.1, 0.5, 0.0), SIZE)
    scene.meshes = {name: scene.meshes[name] for name in ("floor", "lamp")}
    lamp = scene.meshes["lamp"]
    lamp.vertices = 0.2 * (lamp.vertices - lamp.vertices.mean(axis=0)) + [0.1, 0.12, 0.0]
    scene.lights, scene.world = {}, edgegrad.World(np.zeros(3))
    return scene


CASES: dict[str, tuple[Callable[[], edgegrad.Scene], str, int]] = {
    "quiet": (quiet, "meshes.sheet.vertices", SPP // 4),
    "quiet, the camera moves": (quiet, "camera.to_world", SPP // 4),
    "loud": (loud, "meshes.floor.vertices", SPP),
}


@pytest.mark.parametrize("case", CASES)
def test_samples_that_the_interior_is_worth(case: str) -> None:
    """In pixels without edges, the sum of all terms is the interior term with fewer samples, for any threads."""
    small_scenes.need("native")
    make, path, samples = CASES[case]
    scene = make()
    tangent = {path: np.random.default_rng(1).normal(size=np.shape(edgegrad.parameters.get(scene, path)))}
    options = {"max_depth": 2, "seed": 5}
    one, two = (Renderer(scene, threads=threads).render_forward(tangent, spp=SPP, **options) for threads in (1, 2))
    np.testing.assert_array_equal(one, two)
    renderer = Renderer(scene)
    boundaries = [term for term in TERMS if term != "interior"]
    inside = (renderer.render_forward(tangent, spp=SPP, terms=boundaries, **options) == 0).all(axis=-1)
    alone = {n: renderer.render_forward(tangent, spp=n, terms=["interior"], **options)
             for n in (SPP, SPP // 2, SPP // 4)}
    inside &= (alone[SPP] != alone[SPP // 2]).any(axis=-1) & (alone[SPP // 2] != alone[SPP // 4]).any(axis=-1)
    assert inside.sum() > SIZE
    np.testing.assert_allclose(one[inside], alone[samples][inside], rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_fewer_samples_are_each_others_transpose(case: str) -> None:
    """The decision depends on neither tangent nor adjoint: both modes take the same samples."""
    small_scenes.need("native")
    make, path, _ = CASES[case]
    scene = make()
    renderer = Renderer(scene)
    rng = np.random.default_rng(2)
    tangent = {path: rng.normal(size=np.shape(edgegrad.parameters.get(scene, path)))}
    adjoint = rng.normal(size=(SIZE, SIZE, 3))
    adjoint[: SIZE // 2] = 0.0
    options = {"spp": SPP, "max_depth": 2, "seed": 5}
    image = adjoint * renderer.render_forward(tangent, **options)
    gradient = renderer.render_backward(adjoint, [path], **options)[path]
    assert abs(image.sum() - np.sum(gradient * tangent[path])) <= 1e-4 * np.abs(image).sum()

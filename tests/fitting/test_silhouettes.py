"""Silhouettes as targets: coverage, its derivative at outlines, and fits to it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from edgegrad import Field, Material, Medium, Mesh, Mixture, PointLight, Renderer, Scene, Target, fit
from edgegrad import expression as e
from edgegrad.fitting.silhouettes import is_negative, silhouette_scene
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.fits import COLOR, VERTICES

BALL = frozenset({"object"})


def behind_a_post() -> Scene:
    """A lit ball whose middle a dark post hides."""
    scene = shapes.scene(*shapes.ball(2), world=1.0)
    vertices, faces = shapes.cube(0.4)
    scene.meshes = {**scene.meshes, "post": Mesh(vertices * [1.0, 1.0, 20.0] - [0.0, 2.0, 0.0], faces, ("clay",))}
    return scene


def coverage(scene: Scene, spp: int = 256, seed: int = 0) -> Any:
    found = Renderer(silhouette_scene(scene, BALL)).render(spp=spp, max_depth=1, seed=seed)
    return 1.0 - found if is_negative(scene, BALL) else found


def test_picture_is_the_area_that_is_seen() -> None:
    """Of a square sheet seen straight from above, in the middle of which a smaller square hides it."""
    vertices, faces = shapes.sheet(2, 2.0)
    small, _ = shapes.sheet(2, 0.5)
    camera = replace(shapes.camera((0.0, -1e-6, 8.0), size=(40, 40)), kind="ORTHOGRAPHIC", ortho_width=4.0)
    meshes = {"object": Mesh(vertices, faces, ("clay",)), "lid": Mesh(small + [0.0, 0.0, 1.0], faces, ("clay",))}
    scene = Scene(camera, meshes, {"clay": Material(np.ones(3), np.full(3, 5.0))})
    found = coverage(scene)
    assert found.mean() * 16.0 == pytest.approx(4.0 - 0.25, rel=2e-3)
    assert found[20, 20].max() == 0.0 and found[13, 13].min() == 1.0


def test_what_lets_light_through_covers_in_part() -> None:
    vertices, faces = shapes.sheet(2, 20.0)
    scene = Scene(shapes.camera((0.0, -1e-6, 8.0), size=(4, 4)), {"object": Mesh(vertices, faces, ("clay",))})
    for material, expected in (
        ({"clay": Material(alpha=0.25)}, 0.25),
        ({"clay": Material(textures={"alpha": e.Math("ADD", 0.2, 0.3)})}, 0.5),
        ({"clay": Material(kind="GLASS")}, 1.0),
        ({"clay": Mixture(("a", "b"), np.array([0.3, 0.7])), "a": Material(kind="TRANSPARENT"), "b": Material()}, 0.7),
        ({"clay": Mixture(("a", "b"), np.ones(2)), "a": Material(kind="GLOSSY"), "b": Material()}, 1.0),
    ):
        scene.materials = material  # type: ignore[assignment]
        np.testing.assert_allclose(coverage(scene, 1024), expected, atol=0.08)


def test_volumes_do_not_cover() -> None:
    """The picture of a ball in fog is that of the ball alone."""
    scene = behind_a_post()
    alone = coverage(scene)
    vertices, faces = shapes.cube(3.0)
    scene.meshes = {**scene.meshes, "cloud": Mesh(vertices, faces, ("fog",))}
    scene.materials = {**scene.materials,
                       "fog": Material(np.ones(3), kind="TRANSPARENT", medium=Medium((0.3,) * 3))}  # fmt: skip
    np.testing.assert_allclose(coverage(scene).mean((0, 1)), alone.mean((0, 1)), rtol=1e-2)


@pytest.mark.parametrize("path", [VERTICES, "meshes.object.transform", "camera.fov_x"])
def test_gradient_of_coverage_is_that_of_differences(path: str) -> None:
    """Of the sum over some pixels, which cut the ball; the post that hides a part of it stays."""
    scene = behind_a_post()
    adjoint = np.zeros((24, 32, 3), np.float32)
    adjoint[5:17, 3:] = 1.0 / 3.0
    value = np.array(parameters.get(scene, path), np.float64)
    rng = np.random.default_rng(0)
    if path == VERTICES:
        move = 0.3 * value + 0.2 * rng.normal(size=3)
    elif path == "camera.fov_x":
        move = np.array(0.3)
    else:
        move = np.zeros((4, 4))
        move[:3, 3] = (0.5, 0.2, 0.3)
    flat = silhouette_scene(scene, BALL)
    gradient = [np.vdot(Renderer(flat).render_backward(adjoint, [path], spp=256, max_depth=1, seed=seed)[path], move)
                for seed in range(8)]  # fmt: skip
    step, ends = 0.1, []
    for sign in (-0.5, 0.5):
        parameters.put(scene, path, value + sign * step * move)
        ends.append([np.vdot(adjoint, coverage(scene, 2048, seed)) for seed in range(8)])
    parameters.put(scene, path, value)
    differences = (np.array(ends[1]) - ends[0]) / step
    error = np.sqrt((np.var(gradient, ddof=1) + np.var(differences, ddof=1)) / 8)
    found, difference = np.mean(gradient), np.mean(differences)
    assert abs(found - difference) < 4.5 * error + 0.01 * abs(difference), (found, difference, error)
    assert abs(difference) > 3.0


def test_a_silhouette_finds_the_shape_and_leaves_the_color() -> None:
    """Neither the lamp nor the colours of the start are those of the picture."""
    truth, scene = (shapes.scene(*shapes.ball(2, radius)) for radius in (1.25, 1.0))
    scene.lights = {"lamp": PointLight(np.array([-5.0, -3.0, 1.0]), 50.0)}
    before = np.array(parameters.get(scene, COLOR))
    masks = [shapes.camera(eye, size=(32, 32)) for eye in ((0.0, -6.0, 1.0), (6.0, 0.0, 0.5), (0.5, 0.5, 6.0))]
    targets = [Target(Renderer(silhouette_scene(truth, BALL)).render(spp=256, max_depth=1, camera=camera)[..., 0],
                      camera, objects=["object"]) for camera in masks]  # fmt: skip
    with pytest.warns(RuntimeWarning, match="no gradient for .*base_color', because silhouettes do not depend on it"):
        result = fit(scene, targets, [VERTICES, COLOR], iterations=60, spp=8)
    assert result.losses[-1] < 0.02 * result.losses[0]
    radius = np.linalg.norm(parameters.get(scene, VERTICES), axis=1)
    assert radius.mean() == pytest.approx(1.25, abs=0.04)
    np.testing.assert_array_equal(parameters.get(scene, COLOR), before)


def test_a_picture_and_a_silhouette_go_together() -> None:
    """The pose of a field from its silhouette, its colour from the picture."""
    x = np.linspace(-1.0, 1.0, 24)
    grid = np.sqrt(sum(axis**2 for axis in np.meshgrid(x, x, x, indexing="ij"))) - 0.6
    scene = shapes.scene(*shapes.ball(1), world=1.0)
    scene.meshes = {}
    scene.fields = {"object": Field(grid.astype(np.float32), "clay")}
    path = "fields.object.transform"
    start = np.array(parameters.get(scene, path))
    moved = start.copy()
    moved[:3, 3] += (0.3, 0.0, 0.2)
    parameters.put(scene, path, moved)
    mask = coverage(scene)[..., 0]
    parameters.put(scene, COLOR, np.array([0.2, 0.6, 0.3]))
    image = Renderer(scene).render(spp=128)
    parameters.put(scene, COLOR, np.array([0.6, 0.5, 0.4]))
    parameters.put(scene, path, start)
    fit(scene, [Target(image), Target(mask > 0.5, objects=["object"])], [path, COLOR], iterations=80, spp=8)
    np.testing.assert_allclose(parameters.get(scene, path)[[0, 2], 3], moved[[0, 2], 3], atol=0.03)
    np.testing.assert_allclose(parameters.get(scene, COLOR), [0.2, 0.6, 0.3], atol=0.04)


def test_objects_without_a_silhouette_are_named() -> None:
    mask = np.ones((24, 32))
    scene = behind_a_post()
    scene.materials = {"clay": Material(kind="TRANSPARENT")}
    with pytest.raises(ValueError, match="target 0: objects names 'object', whose material is Transparent"):
        fit(scene, Target(mask, objects=["object"]), [VERTICES], iterations=1, spp=1)
    scene = behind_a_post()
    scene.meshes["object"].visible_to = frozenset({"shadow"})
    with pytest.raises(ValueError, match="target 0: objects names 'object', which is invisible to cameras"):
        fit(scene, Target(mask, objects=["object"]), [VERTICES], iterations=1, spp=1)
    scene.fields = {name: Field(np.ones((8, 8, 8), np.float32), "clay") for name in ("one", "two")}
    with pytest.raises(ValueError, match="target 0: objects has a field but not the field 'two'"):
        fit(scene, Target(mask, objects=["one"]), [VERTICES], iterations=1, spp=1)

"""Values of instances that share a mesh: pictures and derivatives of separate meshes, and finite differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from edgegrad import Camera, Material, Mesh, Renderer, Scene, SunLight, World
from edgegrad.expression import Attribute, Channel, Math
from edgegrad.scene import parameters
from tests.support.shapes import ball
from tests.support.small_scenes import need

COLOR, RANDOM, GLOW = "own colour", "own number", "own light"
COUNT = 4
OPTIONS: dict[str, Any] = {"spp": 64, "max_depth": 3}


def placed() -> np.ndarray:
    rng = np.random.default_rng(5)
    out = np.tile(np.eye(4), (COUNT, 1, 1))
    out[:, :3, :3] += 0.2 * rng.normal(size=(COUNT, 3, 3))
    out[:, :3, 3] = [[-2.2, 0.0, 0.0], [0.0, 0.3, 0.5], [2.2, 0.0, 0.0], [0.0, 2.4, 0.2]]
    out[2, :3, 0] *= -1.0  # mirrored
    return out


def values(glows: bool) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(6)
    found = {COLOR: rng.uniform(0.1, 0.9, (COUNT, 3)), RANDOM: rng.uniform(0.2, 0.8, (COUNT, 1)),
             GLOW: rng.uniform(0.1, 2.0, (COUNT, 3)) if glows else np.zeros((COUNT, 3))}  # fmt: skip
    return {name: rows.astype(np.float32) for name, rows in found.items()}


def shared(glows: bool = False) -> Scene:
    """Balls that share a mesh, with shading of their own."""
    vertices, faces = ball(2)
    textures = {"base_color": Attribute(COLOR), "roughness": Math("ADD", Channel(Attribute(RANDOM), 0), 0.1)}
    if glows:
        textures["emission"] = Attribute(GLOW)
    # A mesh before it, so that neither faces nor instances begin at 0.
    other = np.tile(np.eye(4), (2, 1, 1))
    other[:, :3, 3] = [[-1.5, -2.0, -0.5], [1.5, -2.0, -0.5]]
    plain = replace(ball_mesh(0.5, "plain"), instances=other)
    mesh = Mesh(vertices, faces, ("painted",), smoothing=faces, instances=placed(), instance_attributes=values(glows))
    pose = np.eye(4)
    pose[2, 3] = 9.0
    return Scene(Camera(to_world=pose, width=24, height=24), {"plain": plain, "balls": mesh},
                 {"plain": Material(np.full(3, 0.5)), "painted": Material(kind="PRINCIPLED", textures=textures)},
                 {"sun": SunLight(np.array([0.3, 0.4, -1.0]))}, World(np.full(3, 0.4)))  # fmt: skip


def ball_mesh(size: float, material: str) -> Mesh:
    vertices, faces = ball(1)
    return Mesh(size * vertices, faces, (material,))


def apart(scene: Scene) -> Scene:
    """The same scene with a mesh for each ball, whose corners have the values."""
    mesh = scene.meshes["balls"]
    meshes = {"plain": scene.meshes["plain"]}
    assert mesh.instances is not None
    for k, matrix in enumerate(mesh.instances):
        own = {name: np.broadcast_to(rows[k], (len(mesh.faces), 3, rows.shape[1])).copy()
               for name, rows in mesh.instance_attributes.items()}
        meshes[f"ball{k}"] = replace(mesh, instances=matrix[None], instance_attributes={}, attributes=own)
    return replace(scene, meshes=meshes)


@pytest.mark.parametrize("glows", [False, True], ids=["dark", "glowing"])
def test_pictures_are_those_of_separate_meshes(glows: bool) -> None:
    need("native")
    scene = shared(glows)
    picture = Renderer(scene).render(**OPTIONS)
    other = Renderer(apart(scene)).render(**OPTIONS)
    np.testing.assert_allclose(picture, other, rtol=2e-3, atol=1e-5)
    scene.meshes["balls"].instance_attributes = {name: rows[::-1].copy() for name, rows in values(glows).items()}
    assert np.abs(Renderer(scene).render(**OPTIONS) - picture).mean() > 0.05 * picture.mean()


@pytest.mark.parametrize("layer", [COLOR, RANDOM, GLOW])
def test_gradients_are_those_of_separate_meshes(layer: str) -> None:
    need("native")
    scene = shared(glows=layer == GLOW)
    adjoint = np.random.default_rng(1).normal(size=(24, 24, 3)).astype(np.float32)
    path = f"meshes.balls.instance_attributes.{layer}"
    found = Renderer(scene).render_backward(adjoint, [path], **OPTIONS)[path]
    paths = [f"meshes.ball{k}.attributes.{layer}" for k in range(COUNT)]
    of_corners = Renderer(apart(scene)).render_backward(adjoint, paths, **OPTIONS)
    wanted = np.stack([of_corners[one].sum(axis=(0, 1)) for one in paths])
    np.testing.assert_allclose(found, wanted, rtol=5e-3, atol=5e-3 * np.abs(wanted).max())
    tangent = np.random.default_rng(2).normal(size=found.shape)
    image = Renderer(scene).render_forward({path: tangent}, **OPTIONS)
    np.testing.assert_allclose(np.vdot(image.astype(float), adjoint), np.vdot(found, tangent), rtol=1e-3)


@pytest.mark.parametrize("path", ["meshes.balls.instance_attributes.own colour", "meshes.balls.instances"])
def test_derivatives_are_those_of_finite_differences(path: str) -> None:
    need("native")
    scene = shared()
    value = np.asarray(parameters.get(scene, path), np.float64)
    tangent = np.random.default_rng(3).normal(size=value.shape)
    if path.endswith("instances"):
        tangent = np.zeros_like(value)
        tangent[:, 1, 3] = 1.0  # up the picture
    weight = np.random.default_rng(4).uniform(size=(24, 24, 3)) * np.linspace(0.0, 1.0, 24)[:, None]
    step, seeds = 0.05, range(24)

    def moved(by: float) -> Renderer:
        at = shared()
        parameters.put(at, path, value + by * tangent)
        return Renderer(at)

    renderers = {by: moved(by * step) for by in (-1.0, 1.0)}
    own = Renderer(scene)
    differences, found = [], []
    for seed in seeds:
        sides = [float(np.vdot(renderers[by].render(seed=seed, **OPTIONS), weight)) for by in (1.0, -1.0)]
        differences.append((sides[0] - sides[1]) / (2.0 * step))
        found.append(float(np.vdot(own.render_forward({path: tangent}, seed=seed, **OPTIONS), weight)))
    error = np.hypot(*(np.std(x, ddof=1) / np.sqrt(len(seeds)) for x in (differences, found)))
    assert error < 0.15 * abs(np.mean(differences))
    # Differences over the step have an error of their own.
    assert abs(np.mean(found) - np.mean(differences)) < 4.0 * error + 0.01 * abs(np.mean(differences))


def test_an_update_shows_other_values() -> None:
    need("native")
    scene = shared()
    renderer = Renderer(scene)
    renderer.render(spp=1)
    scene.meshes["balls"].instance_attributes = {name: rows[::-1].copy() for name, rows in values(False).items()}
    renderer.update([f"meshes.balls.instance_attributes.{COLOR}", f"meshes.balls.instance_attributes.{RANDOM}",
                     f"meshes.balls.instance_attributes.{GLOW}"])
    np.testing.assert_array_equal(renderer.render(**OPTIONS), Renderer(scene).render(**OPTIONS))


def test_values_keep_their_bits() -> None:
    """A value is not interpolated between corners that have it: nodes compare it with others."""
    need("native")
    scene = shared()
    rows = np.float32([0.1, 0.3, 0.7, 0.9])[:, None]
    scene.meshes["balls"].instance_attributes = {COLOR: rows, RANDOM: rows}
    away = Math("MULTIPLY", Math("ABSOLUTE", Math("SUBTRACT", Channel(Attribute(COLOR), 0), float(rows[2, 0]))), 1e9)
    glow = Math("MAXIMUM", Math("SUBTRACT", 1.0, away), 0.0)
    scene.materials["painted"] = Material(np.zeros(3), textures={"emission": glow})
    scene.world, scene.lights = World(np.zeros(3)), {"sun": SunLight(np.array([0.0, 0.0, 1.0]))}
    scene.meshes.pop("plain")
    picture = Renderer(scene).render(spp=16, max_depth=1)
    assert picture.max() == 1.0  # other balls are black: pixels are the shares of samples that meet this one
    np.testing.assert_array_equal(16.0 * picture, np.rint(16.0 * picture))


def test_wrong_instance_attributes_are_named() -> None:
    for change, message in (
        ({"instance_attributes": {"a": np.zeros((3, 1))}}, r"instance_attributes\['a'\] has 3 rows, but there are 4"),
        ({"instance_attributes": {"a": np.zeros((4, 5))}}, "must have 1 to 4 values per instance, not 5"),
        ({"instance_attributes": {"a": np.zeros(4)}}, r"must have the shape \(n, n\)"),
        ({"instances": None}, "instance_attributes needs instances"),
        ({"attributes": {COLOR: np.zeros((192, 3, 3))}}, "'own colour' is both in attributes and in instance_attr"),
        ({"instance_attributes": {"UV.tangent": np.zeros((4, 4))}}, "cannot hold tangents"),
    ):
        scene = shared()
        scene.meshes["balls"] = replace(scene.meshes["balls"], **change)
        with pytest.raises(ValueError, match=message) as raised:
            scene.validate()
        assert str(raised.value).startswith("mesh 'balls': ")

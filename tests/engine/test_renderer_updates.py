"""An updated renderer gives the same pictures as a new one, for every kind of parameter."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from edgegrad import Camera, Image, Material, Mesh, PointLight, Renderer, Scene, World
from edgegrad import expression as e
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.rich_scene import turn


def scene_of_all() -> Scene:
    vertices, faces = shapes.cube(1.0)
    rng = np.random.default_rng(1)
    places = np.tile(np.eye(4), (2, 1, 1))
    places[0, :3, 3], places[1, :3, 3] = [1.5, 0.0, 0.0], [-1.5, 0.0, 0.3]
    to_world = shapes.camera().to_world
    return Scene(
        Camera(to_world, 0.8, 24, 18),
        {
            "solid": Mesh(vertices, faces, ("paint",), smoothing=faces, normals=vertices.copy(),
                          attributes={"UVMap": rng.random((12, 3, 2)).astype(np.float32)}),
            "copies": Mesh(vertices, faces, ("clay",), instances=places),
        },
        {
            "paint": Material(textures={"base_color": e.Mix(0.2, e.ImageTexture("dots", e.Attribute("UVMap")), 0.7)}),
            "clay": Material(np.array([0.6, 0.5, 0.4])),
        },
        {"lamp": PointLight(np.array([2.0, -4.0, 3.0]), 300.0, 0.2)},
        World(np.ones(3), 0.3, "sky"),
        {"dots": Image(rng.random((4, 4, 3)).astype(np.float32)), "sky": Image(rng.random((4, 8, 3)).astype("f4"))},
    )  # fmt: skip


def placed(pose: Any) -> Any:
    out = np.array(pose)
    out[..., :3, :3] = turn(0.1, 0.3, -0.2) @ out[..., :3, :3]
    out[..., :3, 3] += [0.1, -0.1, 0.2]
    return out


CHANGES = {
    "meshes.solid.vertices": lambda v: 1.2 * v,
    "meshes.solid.normals": lambda v: v + np.array([0.5, 0.2, 0.0]),
    "meshes.solid.attributes.UVMap": lambda v: 0.5 * v,
    "meshes.solid.transform": placed,
    "meshes.copies.transform": placed,
    "meshes.copies.instances": placed,
    "meshes.copies.vertices": lambda v: 1.3 * v,
    "images.dots.pixels": lambda v: 1.0 - v,
    "images.sky.pixels": lambda v: 1.0 - v,
    "materials.paint.textures.base_color": lambda v: np.where(v == 0.2, 0.6, v),
    "materials.clay.base_color": lambda v: 0.5 * v,
    "materials.paint.emission": lambda v: v + 0.5,
    "lights.lamp.position": lambda v: v + 1.0,
    "lights.lamp.radius": lambda v: 3.0 * v,
    "world.color": lambda v: 0.0 * v,
    "world.rotation": lambda v: turn(0.0, 0.0, 1.0) @ v,
    "camera.to_world": placed,
    "camera.fov_x": lambda v: 1.2 * v,
}


@pytest.mark.parametrize("path", CHANGES)
@pytest.mark.parametrize("named", [True, False], ids=["named", "found"])
def test_updates_show_what_a_new_renderer_shows(path: str, named: bool) -> None:
    scene = scene_of_all()
    renderer = Renderer(scene, threads=1)
    before = renderer.render(spp=16, max_depth=3)
    parameters.put(scene, path, CHANGES[path](parameters.get(scene, path)))
    renderer.update([path] if named else None)
    after = renderer.render(spp=16, max_depth=3)
    fresh = Renderer(scene, threads=1).render(spp=16, max_depth=3)
    # Positions are relative to the first scene's centre: a few paths round to another side of an edge.
    assert np.mean(np.abs(after - fresh)) < 2e-3 * np.mean(np.abs(fresh))
    assert np.mean(np.abs(after - before)) > 1e-3 * np.mean(np.abs(before))


@pytest.mark.parametrize("path", CHANGES)
def test_gradients_forget_what_earlier_ones_have_found(path: str) -> None:
    scene = scene_of_all()
    used, unused = Renderer(scene, threads=1), Renderer(scene, threads=1)
    adjoint = np.random.default_rng(2).standard_normal((18, 24, 3)).astype(np.float32)
    wrt = ["meshes.solid.vertices", "meshes.copies.instances", "lights.lamp.position"]

    def gradient(renderer: Renderer) -> Any:
        return renderer.render_backward(adjoint, wrt, spp=2, max_depth=3)

    before = gradient(used)
    used.decide(wrt, max_depth=3)
    parameters.put(scene, path, CHANGES[path](parameters.get(scene, path)))
    used.update([path])
    unused.update([path])
    assert used.decide(wrt, max_depth=3) == unused.decide(wrt, max_depth=3)
    after, expected = gradient(used), gradient(unused)
    for name in wrt:
        np.testing.assert_array_equal(after[name], expected[name])
    assert any((after[name] != before[name]).any() for name in wrt)


def test_decisions_forget_what_they_have_been() -> None:
    scene = scene_of_all()
    renderer = Renderer(scene, threads=1)

    def outcome() -> str:
        decided = renderer.decide(["meshes.solid.vertices"], max_depth=2)
        return next(d.outcome for d in decided if d.part == "environment shadows")

    assert outcome() == "computed"
    scene.world.strength = 0.0
    renderer.update(["world.strength"])
    assert outcome() == "zero"


@pytest.mark.parametrize("named", [True, False], ids=["named", "found"])
def test_copies_of_vertices_that_move_apart_and_meet_again_change_the_edges(named: bool) -> None:
    """Two triangles in one plane, each with vertices of its own: a seam that opens shows the sky."""
    scene = scene_of_all()
    vertices = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    scene.meshes = {"halves": Mesh(vertices, np.arange(6).reshape(2, 3), ("clay",))}
    tangent = {"meshes.halves.vertices": np.tile([0.3, 0.1, 0.5], (6, 1))}
    renderer = Renderer(scene, threads=1)

    def derivative(of: Renderer) -> Any:
        return of.render_forward(tangent, spp=64, terms=["primary"])

    whole = derivative(renderer)
    opened = vertices + np.repeat([[0.0, 0, 0], [-0.4, 0, 0.4]], 3, axis=0)
    for places in (opened, vertices):
        scene.meshes["halves"].vertices = places
        renderer.update(["meshes.halves.vertices"] if named else None)
        fresh = derivative(Renderer(scene, threads=1))
        assert np.abs(derivative(renderer) - fresh).mean() < 0.1 * np.abs(fresh).mean()
    scene.meshes["halves"].vertices = opened
    assert np.abs(derivative(Renderer(scene)) - whole).mean() > 0.3 * np.abs(whole).mean()


@pytest.mark.parametrize("paths", [["materials.clay.emission"], None])
def test_instances_that_begin_to_glow_change_the_topology(paths: list[str] | None) -> None:
    scene = scene_of_all()
    renderer = Renderer(scene, threads=1)
    parameters.put(scene, "materials.clay.emission", np.ones(3))
    with pytest.raises(ValueError, match="its topology has changed; make a new Renderer"):
        renderer.update(paths)


def test_a_black_world_that_lights_up_shows_its_image() -> None:
    scene = scene_of_all()
    scene.world.color = np.zeros(3)
    renderer = Renderer(scene, threads=1)
    renderer.render(spp=1)
    scene.world.color = np.ones(3)
    renderer.update(["world.color"])
    np.testing.assert_array_equal(renderer.render(spp=4), Renderer(scene, threads=1).render(spp=4))


def test_updates_wait_for_the_pictures_of_other_threads() -> None:
    scene = scene_of_all()
    values = [scene.meshes["solid"].vertices, 1.2 * scene.meshes["solid"].vertices]
    shared = Renderer(scene)
    expected = []
    for value in values:
        scene.meshes["solid"] = replace(scene.meshes["solid"], vertices=value)
        shared.update(["meshes.solid.vertices"])
        expected.append(shared.render(spp=64))
    with ThreadPoolExecutor(1) as pool:
        pictures = pool.submit(lambda: [shared.render(spp=64) for _ in range(20)])
        for k in range(10_000):
            if pictures.done():
                break
            scene.meshes["solid"] = replace(scene.meshes["solid"], vertices=values[k % 2])
            shared.update(["meshes.solid.vertices"])
    assert all(any(np.array_equal(picture, one) for one in expected) for picture in pictures.result())


def test_a_progress_function_cannot_use_its_renderer() -> None:
    renderer = Renderer(scene_of_all())
    with pytest.raises(RuntimeError, match="renderer: its progress function can't use it"):
        renderer.render(spp=64, progress=lambda _: renderer.update(["materials.clay.base_color"]))
    assert renderer.render(spp=1).any()


@pytest.mark.parametrize("call", ["render", "render_caustics", "render_forward", "render_backward"])
@pytest.mark.parametrize("named", [False, True])
def test_each_call_does_an_update_anew_that_has_failed(call: str, named: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory runs out in the engine while it takes over a changed value; the next call sees the change."""
    path = "materials.clay.base_color"

    def scene() -> Scene:
        return shapes.scene(*shapes.ball(1))

    def result(renderer: Renderer) -> Any:
        options: dict[str, Any] = {"spp": 2, "max_depth": 2}
        if call == "render_forward":
            return renderer.render_forward({path: np.ones(3)}, **options)
        if call == "render_backward":
            height, width = renderer.scene.camera.size
            return renderer.render_backward(np.ones((height, width, 3)), [path], **options)[path]
        return getattr(renderer, call)(**options)

    def fails(*_: object) -> None:
        raise MemoryError

    changed = Renderer(scene())
    changed.scene.materials["clay"].base_color = np.array([0.1, 0.9, 0.4])
    with monkeypatch.context() as patch:
        patch.setattr(changed._engine, "update", fails)
        patch.setattr(changed._engine, "update_values", fails)
        with pytest.raises(MemoryError):
            changed.update([path] if named else None)
    expected = scene()
    expected.materials["clay"].base_color = np.array([0.1, 0.9, 0.4])
    np.testing.assert_array_equal(result(changed), result(Renderer(expected)))

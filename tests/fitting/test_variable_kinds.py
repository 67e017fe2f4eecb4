"""Steps of a fit by every kind of parameter: values stay valid and follow the tables' derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from edgegrad import Material, Scene, plan
from edgegrad.derivatives.table_derivatives import ParameterMap
from edgegrad.fitting.outcome.zero_gradients import why_untouched
from edgegrad.fitting.rigid_variables import depth_seen, rotations, scene_extent
from edgegrad.fitting.variables import unknown
from edgegrad.scene import parameters
from edgegrad.tables import tables
from tests.support import shapes as solids
from tests.support.rich_scene import everything, turn
from tests.support.table_values import WITHOUT, values


def one_of_each_kind() -> list[str]:
    """The first path of each kind of object and field, and all images."""
    scene, found = everything(), {}
    for path in parameters.paths(scene):
        held, field = parameters.owner(scene, path)
        if field not in WITHOUT:
            found.setdefault((path if field == "pixels" else type(held), field), path)
    return list(found.values())


@pytest.mark.parametrize("path", one_of_each_kind())
def test_steps_leave_the_scene_valid(path: str) -> None:
    """Gradients that push to one side drive each entry to its limit, and no further."""
    scene = everything()
    rng = np.random.default_rng(5)
    start = np.array(parameters.get(scene, path), np.float64)
    push = rng.choice([-1.0, 1.0], start.shape)
    changed = False
    for sign in (1.0, -1.0):
        parameters.put(scene, path, start)
        item = unknown(scene, path, None, None, None)
        for _ in range(40):
            parameters.put(scene, path, item.take_step(sign * push, 1.0))
        scene.validate()
        changed |= not np.array_equal(parameters.get(scene, path), start)
    assert changed


def loss_and_gradient(scene: Scene, goal: dict[str, Any], path: str) -> tuple[float, Any]:
    """Half the squared distance of the tables from a goal, and its gradient."""
    shaped = path.startswith(("meshes.", "images."))
    flat = tables.flatten(scene, goal["flat"].origin) if shaped else tables.with_values(scene, goal["flat"])
    apart = {name: part - goal[name] for name, part in values(flat).items()}
    gradient = ParameterMap(scene, flat, [path]).pull_back(apart)[path]
    return 0.5 * sum(float(np.vdot(part, part)) for part in apart.values()), gradient


def turned(pose: Any, pivot: Any) -> Any:
    out = np.array(pose)
    out[:3, :3] = turn(0.2, -0.1, 0.15) @ pose[:3, :3]
    out[:3, 3] = turn(0.2, -0.1, 0.15) @ (pose[:3, 3] - pivot) + pivot + np.array([0.1, -0.2, 0.15])
    return out


GOALS = {
    "camera.to_world": lambda v: turned(v, v[:3, 3]),
    "lights.area.to_world": lambda v: turned(v, v[:3, 3]),
    "meshes.moved.transform": lambda v: turned(v, v[:3, 3]),
    "meshes.copies.instances": lambda v: np.stack([turned(m, m[:3, 3]) for m in v]),
    "world.rotation": lambda v: turn(0.2, -0.1, 0.15) @ v,
    "lights.spot.direction": lambda v: turn(0.2, -0.1, 0.15) @ v,
    "lights.ball.position": lambda v: v + np.array([0.3, -0.2, 0.1]),
    "lights.ball.radius": lambda v: 0.25,
    "materials.clay.roughness": lambda v: 0.8,
    "camera.fov_x": lambda v: 0.7,
    "images.rgba.pixels": lambda v: 1.0 - v,
    "meshes.still.attributes.UVMap": lambda v: v + 0.05,
}


@pytest.mark.parametrize("path", GOALS)
def test_gradients_of_tables_lead_to_the_goal(path: str) -> None:
    scene, target = everything(), everything()
    parameters.put(target, path, GOALS[path](parameters.get(target, path)))
    flat = tables.flatten(scene)
    goal: dict[str, Any] = {"flat": flat, **values(tables.flatten(target, flat.origin))}
    item = unknown(scene, path, None, None, None)
    first = loss_and_gradient(scene, goal, path)[0]
    for k in range(60):
        factor = 0.02 + 0.49 * (1.0 + np.cos(np.pi * k / 60))
        parameters.put(scene, path, item.take_step(loss_and_gradient(scene, goal, path)[1], factor))
    assert loss_and_gradient(scene, goal, path)[0] < 1e-2 * first


def test_poses_stay_rigid_and_directions_keep_their_lengths() -> None:
    scene = everything()
    rng = np.random.default_rng(6)
    for path in ("meshes.moved.transform", "meshes.copies.instances", "lights.spot.direction", "world.rotation"):
        start = np.array(parameters.get(scene, path))
        item = unknown(scene, path, None, None, None)
        for _ in range(200):
            end = item.take_step(rng.normal(size=start.shape), 1.0)
        if start.ndim == 1:
            assert np.linalg.norm(end) == pytest.approx(np.linalg.norm(start), rel=1e-12)
        else:  # R A has the products A^T A of A
            before, after = start[..., :3, :3], end[..., :3, :3]
            products = [np.swapaxes(a, -1, -2) @ a for a in (before, after)]
            np.testing.assert_allclose(products[1], products[0], atol=1e-12)
        assert np.abs(end - start).max() > 0.01


def test_first_steps_of_poses_go_by_radians_and_extent() -> None:
    scene = everything()
    pose = scene.camera.to_world
    pivot = pose[:3, 3] - pose[:3, 2] * depth_seen(scene, scene.camera)
    gradient = np.zeros((4, 4))
    gradient[:3, 3] = 7.0 * pose[:3, 2]  # towards the pivot: no turn
    end = unknown(scene, "camera.to_world", 0.05, None, None).take_step(gradient, 1.0)
    np.testing.assert_allclose(end[:3, 3] - pose[:3, 3], -0.05 * scene_extent(scene) * pose[:3, 2], atol=1e-12)
    np.testing.assert_allclose(end[:3, :3], pose[:3, :3], atol=1e-12)
    gradient = np.zeros((4, 4))
    gradient[:3, :3] = np.cross([0.0, 0.0, 1.0], pose[:3, :3].T).T  # of a turn about z
    end = unknown(scene, "camera.to_world", 0.05, None, None).take_step(gradient, 1.0)
    np.testing.assert_allclose(end[:3, :3], turn(0.0, 0.0, -0.05) @ pose[:3, :3], atol=1e-12)
    np.testing.assert_allclose(end[:3, 3], pivot + turn(0.0, 0.0, -0.05) @ (pose[:3, 3] - pivot), atol=1e-12)


def test_cameras_turn_about_what_they_see() -> None:
    """The median depth of the vertices in the picture; without any, of those before the camera; else the extent."""
    scene = solids.scene(*solids.cube(2.0))
    scene.camera = solids.camera((0.0, -6.0, 0.0), size=(8, 8), fov_x=0.6)
    assert depth_seen(scene, scene.camera) == pytest.approx(6.0)
    scene.camera.fov_x = 0.35  # sees the far corners alone
    assert depth_seen(scene, scene.camera) == pytest.approx(7.0)
    scene.camera.fov_x = 0.01
    assert depth_seen(scene, scene.camera) == pytest.approx(6.0)
    scene.camera.to_world[:3, [0, 2]] *= -1.0  # looks away
    assert depth_seen(scene, scene.camera) == scene_extent(scene)


def test_rotations_are_exact_at_any_angle() -> None:
    for vector in ([0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.3, -0.2, 0.9], [0.0, 3.0, 0.0]):
        np.testing.assert_allclose(rotations(np.array([vector]))[0], turn(*vector), atol=1e-15)


def test_extent_spans_instances_and_transforms() -> None:
    scene = solids.scene(*solids.cube(2.0))
    mesh = scene.meshes["object"]
    assert scene_extent(scene) == pytest.approx(np.sqrt(12.0))
    mesh.transform = np.diag([2.0, 2.0, 2.0, 1.0])
    assert scene_extent(scene) == pytest.approx(2.0 * np.sqrt(12.0))
    mesh.instances = np.stack([np.eye(4), np.eye(4)])
    mesh.instances[1, 0, 3] = 4.0
    assert scene_extent(scene) == pytest.approx(np.sqrt(12.0**2 + 2.0 * 4.0**2))


def test_sizes_stay_above_zero_and_shares_within_one() -> None:
    scene = everything()
    for path, push, end in (("lights.ball.radius", 1.0, 0.2e-3), ("materials.clay.roughness", 1.0, 0.0),
                            ("materials.clay.metallic", -1.0, 1.0), ("lights.area.size", 1.0, 1e-3),
                            ("materials.clay.anisotropy", -1.0, 1.0), ("lights.disk.spread", -1.0, np.pi)):  # fmt: skip
        item = unknown(scene, path, 0.2, None, None)
        for _ in range(50):
            value = item.take_step(np.full(np.shape(parameters.get(scene, path)), push), 1.0)
        np.testing.assert_allclose(value, end)


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("materials.wood.alpha", "the picture does not depend on it"),
        ("lights.point.radius", "the picture does not depend on it"),
        ("meshes.still.attributes.unread", "the picture does not depend on it"),
        ("materials.spare.roughness", "no mesh or field uses this material"),
        ("materials.clay.roughness", "nothing that the cameras see depends on it"),
    ],
)
def test_why_nothing_depends_on_a_parameter(path: str, reason: str) -> None:
    scene = everything()
    scene.materials = {**scene.materials, "spare": Material()}
    scene.meshes = {"still": scene.meshes["still"]}  # has "clay" as a part of a mixture only
    scene.lights = {name: light for name, light in scene.lights.items() if name == "point"}
    assert why_untouched(scene, np.ones(1), path, plan(scene, [path])).startswith(reason)

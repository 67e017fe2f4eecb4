"""The vertices of a mesh under its modifiers: their map, gradients against differences of the picture, refusals."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad_addon.animated.driver import Driver
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.export.geometry.mesh import positions
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.session import Picture, Request, Session
from tests.support.animated import scenes as zoo
from tests.support.block_statistics import ALARM, NOTICED, check, compare
from tests.support.scenes import blender_scenes as bs

SPP, SEEDS, THETAS, PICTURES = 48, 3, 6, 6


def _mirrored(ob: Any) -> None:
    points = positions(ob.data)
    points[:, 0] = np.where(points[:, 0] < 0.0, 0.0, points[:, 0])
    ob.data.vertices.foreach_set("co", points.ravel())
    ob.modifiers.new("Mirror", "MIRROR")
    zoo.subdivided(ob)


def _array(ob: Any) -> None:
    ob.scale = (0.5, 0.5, 0.5)
    made = ob.modifiers.new("Array", "ARRAY")
    made.use_relative_offset, made.use_constant_offset = False, True
    made.constant_offset_displace = (2.4, 0.3, 0.2)


def _armature(ob: Any) -> None:
    rig = zoo.armature(ob)
    rig.pose.bones["Bone1"].rotation_euler = (0.4, 0.2, 0.1)
    zoo.subdivided(ob)


def _hooked(ob: Any) -> None:
    hook = ob.modifiers.new("Hook", "HOOK")
    hook.falloff_type = "NONE"
    hook.object = bs.add("Handle", None, (0.2, 0.1, 0.3), (0.3, 0.0, 0.2))
    hook.vertex_indices_set([1, 3, 5])
    zoo.subdivided(ob, 1)


def _smooth(ob: Any) -> None:
    made = ob.modifiers.new("Smooth", "SMOOTH")
    made.factor, made.iterations = 0.3, 1


def _triangulated(ob: Any) -> None:
    ob.modifiers.new("Triangulate", "TRIANGULATE").quad_method = "FIXED"


STACKS: dict[str, Callable[[Any], Any]] = {
    "subdivision": zoo.subdivided, "mirror and subdivision": _mirrored, "array": _array,
    "armature and subdivision": _armature, "hook and subdivision": _hooked, "smooth": _smooth,
    "triangulate": _triangulated,
}  # fmt: skip


def controlled(make: Callable[[Any], Any]) -> Driver:
    ob = zoo.stage()
    make(ob)
    bpy.context.view_layer.update()
    return Driver(bpy.context.scene, [bpy.context.scene.camera], [], ["Cube"])


def direction(driver: Driver) -> Any:
    control = driver.controls[0]
    return np.random.default_rng(3).normal(size=control.read().shape) * ~control.pinned


@pytest.mark.parametrize("stack", STACKS)
def test_gradients_equal_differences_of_the_picture(stack: str) -> None:
    driver = controlled(STACKS[stack])
    control, name = driver.controls[0], driver.variables[0].path
    start, along, h = control.read(), direction(driver), 0.02
    assert control.map is not None
    samples, sides = [], []
    for k in range(THETAS):
        scene = driver.export_at({name: start + h * (2.0 * (k + 0.5) / THETAS - 1.0) * along}).scene
        vertices = scene.meshes["Cube"].vertices
        tangent = {"meshes.Cube.vertices": control.map.push(along, len(vertices))}
        renderer = edgegrad.Renderer(scene)
        samples.append([renderer.render_forward(tangent, spp=SPP, seed=SEEDS * k + seed) for seed in range(SEEDS)])
    for side in (h, -h):
        renderer = edgegrad.Renderer(driver.export_at({name: start + side * along}).scene)
        sides.append(np.stack([renderer.render(spp=16 * SPP, seed=seed) for seed in range(PICTURES)]))
    difference = (sides[0].astype(np.float64) - sides[1]) / (2.0 * h)
    outcome = compare(np.array(samples), difference.mean(axis=0),
                      difference.std(axis=0, ddof=1) / np.sqrt(PICTURES))  # fmt: skip
    assert outcome.noticed(ALARM) < NOTICED
    check(outcome)


@pytest.mark.parametrize("stack", STACKS)
def test_maps_are_exact(stack: str) -> None:
    driver = controlled(STACKS[stack])
    control, name = driver.controls[0], driver.variables[0].path
    start, along = control.read(), direction(driver)
    assert control.map is not None
    exported = [driver.export_at({name: start + s * along}).scene.meshes["Cube"].vertices for s in (0.0, 0.2)]
    expected = 0.2 * control.map.push(along, len(exported[0]))
    assert np.abs(exported[1] - exported[0] - expected).max() < 5e-6
    gradient = np.random.default_rng(4).normal(size=exported[0].shape)
    placement = driver.place({name: start})
    pulled = placement.pull({"meshes.Cube.vertices": gradient}, 0)[name]
    assert np.vdot(pulled, along) == pytest.approx(np.vdot(gradient, control.map.push(along, len(gradient))))
    assert np.array_equal(control.read(), start)


def _twisted(ob: Any) -> None:
    zoo.subdivided(ob)
    made = ob.modifiers.new("Twist", "SIMPLE_DEFORM")
    made.deform_method, made.angle = "TWIST", 1.0


def _bevelled(ob: Any) -> None:
    ob.modifiers.new("Round", "BEVEL").width = 0.2


def _cast(ob: Any) -> None:
    ob.modifiers.new("Ball", "CAST").factor = 0.7


@pytest.mark.parametrize(("make", "name"), [(_twisted, "Twist"), (_bevelled, "Round"), (_cast, "Ball")])
def test_other_stacks_are_refused_by_the_name_of_the_modifier(make: Callable[[Any], None], name: str) -> None:
    with pytest.raises(Problem, match=rf"object 'Cube': .*modifier '{name}'.*apply that modifier"):
        controlled(make)
    assert all(one.show_render for one in bpy.data.objects["Cube"].modifiers)


def test_a_subdivision_cage_is_found_from_pictures(tmp_path: Path) -> None:
    ob = zoo.stage(40)
    zoo.subdivided(ob, 2)
    truth = positions(ob.data)
    pictures = []
    scene = bpy.context.scene
    bs.camera((4.2, 3.6, 3.0), (1.06, 0.0, 2.28), "Back")
    bs.camera((0.2, 0.3, 7.0), (0.0, 0.0, 0.0), "Top")
    for name in ("Camera", "Back", "Top"):
        bpy.data.cameras[name].lens = 90.0
        scene.camera = bpy.data.objects[name]
        scene.render.filepath = str(tmp_path / f"{name}.exr")
        bpy.ops.render.render(write_still=True)
        pictures.append(Picture(name, str(tmp_path / f"{name}.exr")))
    start = truth + np.random.default_rng(5).normal(0.0, 0.15, truth.shape).astype(np.float32)
    ob.data.vertices.foreach_set("co", start.ravel())
    ob.data.update()
    request = Request(pictures, Names(vertices=("Cube",)), iterations=50, samples=8, smoothness=0.0, in_place=True)
    session = Session.prepare(bpy.context, request)
    result = session.run()
    assert session.write(result)
    assert session.driver is not None
    found = session.driver.controls[0].map
    assert found is not None
    rows = int(found.rows.max()) + 1
    cage, surface = ([np.linalg.norm(move, axis=1).mean() for move in moves] for moves in (
        (start - truth, positions(ob.data) - truth),
        (found.push(start - truth, rows), found.push(positions(ob.data) - truth, rows))))  # fmt: skip
    print(f"mean error of the cage {cage[0]:.4f} -> {cage[1]:.4f}, of the surface {surface[0]:.4f} -> {surface[1]:.4f} "
          f"in {result.seconds:.1f} s")  # fmt: skip
    assert surface[1] < 0.25 * surface[0] and cage[1] < cage[0]


def test_vertices_on_a_mirror_stay_there(tmp_path: Path) -> None:
    ob = zoo.stage(16)
    _mirrored(ob)
    start = positions(ob.data)
    target = tmp_path / "target.exr"
    bpy.context.scene.render.filepath = str(target)
    bpy.ops.render.render(write_still=True)
    ob.data.vertices.foreach_set("co", (start * (1.0, 1.2, 0.8)).astype(np.float32).ravel())
    ob.data.update()
    request = Request([Picture("Camera", str(target))], Names(vertices=("Cube",)), iterations=5, samples=4)
    session = Session.prepare(bpy.context, request)
    assert session.write(session.run())
    key = ob.data.shape_keys.key_blocks["Edgegrad"]
    moved = np.array([point.co[:] for point in key.points])
    assert np.array_equal(moved[start[:, 0] == 0.0, 0], np.zeros(4)) and not np.allclose(moved, start, atol=1e-3)


def test_a_pose_and_the_vertices_under_it_are_fitted_together(tmp_path: Path) -> None:
    ob = zoo.stage(32)
    _armature(ob)
    target = tmp_path / "target.exr"
    bpy.context.scene.render.filepath = str(target)
    bpy.ops.render.render(write_still=True)
    bone = bpy.data.objects["Rig"].pose.bones["Bone1"]
    bone.rotation_euler[0] += 0.3
    ob.data.vertices.foreach_set("co", (positions(ob.data) * np.float32(1.1)).ravel())
    ob.data.update()
    request = Request([Picture("Camera", str(target))], Names(vertices=("Cube",)), iterations=15, samples=4,
                      animated=(Wanted('objects["Rig"].pose.bones["Bone1"].rotation_euler[0]'),))  # fmt: skip
    result = Session.prepare(bpy.context, request).run()
    assert result.losses[result.best] < 0.3 * result.losses[0]


def test_pushing_a_vertex_is_the_transpose_of_pulling_a_gradient() -> None:
    ob = zoo.stage(8)
    _armature(ob)
    camera = bpy.data.objects["Camera"]
    driver = Driver(bpy.context.scene, [camera], (Wanted('objects["Rig"].pose.bones["Bone1"].rotation_euler[0]'),),
                    ("Cube",))  # fmt: skip
    placed = driver.place({one.path: one.value for one in driver.variables})
    assert placed.push is not None
    rng = np.random.default_rng(0)
    gradient = {path: rng.standard_normal(np.shape(placed.parameters[path])) for path in placed.paths[0]}
    for path, pulled in placed.pull(gradient, 0).items():
        for k in range(min(pulled.size, 9)):
            pushed = placed.push(path, k, 0)
            assert sum(np.vdot(gradient[name], value) for name, value in pushed.items()) == pytest.approx(
                pulled.flat[k], rel=1e-9, abs=1e-12)


def test_newton_steps_bring_a_cage_to_its_place(tmp_path: Path) -> None:
    """Two of eight vertices under Subdivision, which few iterations leave on their way."""
    ob = zoo.stage(32)
    zoo.subdivided(ob, 1)
    bpy.context.scene.cycles.samples = 256
    truth = positions(ob.data).astype(np.float64)
    pictures = []
    for name in ("Camera", bs.camera((4.5, -3.5, 2.2), (1.2, 0.0, 0.9), "Side").name):
        bpy.context.scene.camera = bpy.data.objects[name]
        bpy.context.scene.render.filepath = str(tmp_path / f"{name}.exr")
        bpy.ops.render.render(write_still=True)
        pictures.append(Picture(name, bpy.context.scene.render.filepath))
    moved = truth.copy()
    moved[[4, 5]] += ((0.2, -0.1, 0.1), (-0.1, 0.1, 0.2))
    ob.data.vertices.foreach_set("co", moved.astype(np.float32).ravel())
    ob.data.update()

    def error(uncertain: bool, seed: int) -> float:
        """Mean over the rendered vertices."""
        request = Request(pictures, Names(vertices=("Cube",)), iterations=25, samples=4, uncertainty=uncertain,
                          seed=seed)  # fmt: skip
        session = Session.prepare(bpy.context, request)
        result = session.run()
        assert session.driver is not None
        (cage,) = session.driver.controls
        assert cage.map is not None
        off = cage.map.push(result.values[cage.path] - truth, len(cage.exported))
        return float(np.linalg.norm(off, axis=1).mean())

    # Steps are taken with some seeds, where the pictures' noise lets them lower the loss
    parts = [error(True, seed) / error(False, seed) for seed in (0, 1)]
    assert max(parts) <= 1.0 and min(parts) < 0.7, parts

"""Derivatives in the panel: pictures, colors of vertices and comparisons, against finite differences of the loss."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
import edgegrad_addon
from edgegrad import images
from edgegrad.fitting.driven import Numbers
from edgegrad.fitting.run import effect
from edgegrad_addon import rows
from edgegrad_addon.animated.stored import add_row
from edgegrad_addon.look.vertex_gradient import ATTRIBUTE, push_of
from edgegrad_addon.status import STATUS
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(name="scene")
def _scene(tmp_path: Path) -> Iterator[Any]:
    bs.empty(32)
    bs.camera((0, 0, 6), name="Front")
    bs.world((0.3, 0.3, 0.3))
    bs.light("SUN", "Sun", rotation=(0.3, 0.4, 0), energy=3.0)
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")), rotation=(0.4, 0.3, 0.0), scale=(1.0, 1.5, 1.0))
    edgegrad_addon.register()
    images.write_image(tmp_path / "target.exr", np.zeros((32, 32, 3), np.float32))
    bpy.ops.edgegrad.target_open(filepath=str(tmp_path / "target.exr"))
    yield bpy.context.scene
    edgegrad_addon.unregister()


def active(scene: Any, row: Any) -> None:
    scene.edgegrad.active_parameter = [*scene.edgegrad.parameters].index(row)


def pixels(name: str) -> Any:
    image = bpy.data.images[name]
    return np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[::-1, :, :3]


@pytest.mark.parametrize("kind", ["VERTICES", "BASE_COLOR", "POWER", "IMAGE", "PROPERTY"])
def test_a_gradient_agrees_with_differences(kind: str, scene: Any) -> None:
    owner = {"BASE_COLOR": bpy.data.materials["Clay"], "POWER": bpy.data.objects["Sun"]}.get(
        kind, bpy.data.objects["Cube"])  # fmt: skip
    if kind == "IMAGE":
        owner = bpy.data.images.new("Skin", 8, 8, alpha=False)
        owner.pixels.foreach_set(np.tile(np.array((0.4, 0.4, 0.4, 1.0), np.float32), 64))
        tree = bpy.data.materials["Clay"].node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = owner
        tree.links.new(node.outputs["Color"], bs.shader(bpy.data.materials["Clay"]).inputs["Color"])
    row = add_row(scene, owner, "location", 0) if kind == "PROPERTY" else rows.add_kind(scene, kind, owner)
    active(scene, row)
    assert bpy.ops.edgegrad.check(samples=16) == {"FINISHED"}
    assert len(STATUS.checks) == 1 and STATUS.checks[0].startswith(f"{row.name}: agrees, "), STATUS.checks
    assert bpy.ops.edgegrad.gradient(samples=16) == {"FINISHED"}
    shown = pixels("Edgegrad Gradient")
    assert shown.shape[0] > 32 and (shown[:32] != 1.0).any()  # the scale is below the picture


def test_check_moves_cameras_by_parts_of_a_pixel(scene: Any) -> None:
    """Steps of the exported arrays, which suffice for those, would move this picture by several pixels."""
    scene.render.resolution_x = scene.render.resolution_y = 256
    active(scene, add_row(scene, scene.camera, "location", 2))
    assert bpy.ops.edgegrad.check(samples=4) == {"FINISHED"}
    assert len(STATUS.checks) == 1 and "agrees" in STATUS.checks[0], STATUS.checks


def test_a_direction_is_one_number_of_a_property(scene: Any) -> None:
    active(scene, add_row(scene, bpy.data.objects["Cube"], "location"))
    pictures = []
    for direction in ("X", "Y"):
        scene.edgegrad.direction = direction
        bpy.ops.edgegrad.gradient(samples=8)
        pictures.append(pixels("Edgegrad Gradient"))
    assert np.abs(pictures[0] - pictures[1]).max() > 0.5
    scene.edgegrad.direction = "Z"
    scene.edgegrad.term = "primary"
    assert bpy.ops.edgegrad.gradient(samples=8) == {"FINISHED"}


def test_a_black_target_pulls_a_bright_cube_inwards(scene: Any) -> None:
    """A smaller cube has a smaller loss: the world is darker than its lit faces."""
    bpy.data.worlds[0].node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    rows.add_kind(scene, "VERTICES", bpy.data.objects["Cube"])
    assert bpy.ops.edgegrad.gradient_colors() == {"FINISHED"}
    colors = np.array([one.color[:] for one in bpy.data.meshes["Cube"].color_attributes[ATTRIBUTE].data])
    assert colors.shape == (8, 4) and (colors[:, 2] >= colors[:, 0]).all() and (colors[:, 2] > colors[:, 0]).any()
    assert not bpy.data.objects["Cube"].data.shape_keys


def test_the_push_of_vertices_is_per_area_and_outwards() -> None:
    """The gradient of a loss that falls by the volume over a sheet is 1 at each vertex, for any mesh and transform."""
    across = np.array([0.0, 0.1, 0.5, 2.0])
    points = np.array([(x, y, 0.0) for x in across for y in across])
    quads = [(4 * i + j, 4 * (i + 1) + j, 4 * (i + 1) + j + 1, 4 * i + j + 1) for i in range(3) for j in range(3)]
    faces = np.array([tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))])
    for matrix in (np.diag([2.0, 3.0, 0.5, 1.0]), np.diag([-2.0, 1.0, 5.0, 1.0])):
        mesh = edgegrad.Mesh(points, faces, ("m",), transform=matrix)
        world = points @ matrix[:3, :3].T
        gradient = np.zeros_like(points)  # in world space
        for face in faces:
            a, b, c = world[face]
            gradient[face, 2] -= np.linalg.norm(np.cross(b - a, c - a)) / 6.0
        push = push_of(mesh, gradient @ matrix[:3, :3])  # the chain rule, to the space of the mesh
        assert push == pytest.approx(np.ones(16))


def test_sensitivities_are_known_after_a_fit(scene: Any) -> None:
    rows.add_kind(scene, "POWER", bpy.data.objects["Sun"])
    rows.add_kind(scene, "BASE_COLOR", bpy.data.materials["Clay"])
    scene.edgegrad.iterations, scene.edgegrad.samples = 2, 4
    assert all(row.sensitivity < 0.0 for row in scene.edgegrad.parameters)
    assert bpy.ops.edgegrad.fit() == {"FINISHED"}
    found = [row.sensitivity for row in scene.edgegrad.parameters]
    assert max(found) == 1.0 and min(found) > 0.0
    assert bpy.data.images["Edgegrad Difference"].size[:] == (32, 32) and STATUS.cost > 0.0


def test_an_effect_is_the_change_by_first_steps() -> None:
    one = Numbers("x", np.zeros(2), np.array([0.1, 2.0]), np.full(2, -np.inf), np.full(2, np.inf))
    assert effect(one, np.array([3.0, -0.5])) == pytest.approx(1.3)

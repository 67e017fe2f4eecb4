"""Export: geometry, cameras, visibility, and one named warning for all that can't be read."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from bpy_extras.object_utils import world_to_camera_view  # type: ignore[import-not-found]
from mathutils import Vector

from edgegrad_addon.problem import Problem
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()
    bs.camera()


def panorama(lens: Any, kind: str, **values: float) -> None:
    lens.type = "PANO"
    owner = lens if hasattr(lens, "panorama_type") else lens.cycles
    owner.panorama_type = kind
    for name, value in values.items():
        setattr(owner, name, value)


@pytest.mark.parametrize(
    ("fit", "shift", "size", "percentage"),
    list(itertools.product(["AUTO", "HORIZONTAL", "VERTICAL"], [(0, 0), (0.2, -0.1)], [(64, 48), (48, 64)], [100, 50])),
)
def test_camera_projects_as_blenders(fit: Any, shift: Any, size: Any, percentage: Any) -> None:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = percentage
    ob = scene.camera
    ob.location, ob.rotation_euler, ob.scale = (1, -4, 2), (1.1, 0.2, 0.3), (2, 1, 0.5)
    lens = ob.data
    lens.sensor_fit, lens.sensor_width, lens.sensor_height, lens.lens = fit, 36.0, 20.0, 31.0
    lens.shift_x, lens.shift_y = shift
    bs.light("POINT")
    camera = bs.export().scene.camera
    bpy.context.view_layer.update()
    for point in [(0, 0, 0), (0.5, 1, 0.3), (-1, 0.2, 1.4)]:
        expected = world_to_camera_view(scene, ob, Vector(point))
        local = np.linalg.inv(camera.to_world) @ [*point, 1.0]
        pixel = camera.principal_point + camera.focal * np.array([local[0], -local[1]]) / -local[2]
        assert pixel[0] / camera.width == pytest.approx(expected.x, abs=1e-5)
        assert 1.0 - pixel[1] / camera.height == pytest.approx(expected.y, abs=1e-5)
    assert (camera.width, camera.height) == (size[0] * percentage // 100, size[1] * percentage // 100)


def test_transforms_modifiers_and_slots() -> None:
    red, blue = bs.material("Red", (0.8, 0.1, 0.1)), bs.material("Blue", (0.1, 0.1, 0.8))
    data = bs.cube("Cube", red, blue)
    data.polygons[2].material_index = 1
    ob = bs.add("Cube", data, (1, 2, 3), (0.3, 0.4, 0.5), (1, -2, 0.5))
    modifier = ob.modifiers.new("Subdivide", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    bs.light("POINT")
    export = bs.export()
    mesh = export.scene.meshes["Cube"]
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    expected = np.array([evaluated.matrix_world @ v.co for v in evaluated.data.vertices])
    assert mesh.vertices == pytest.approx(expected, abs=1e-6)
    assert len(mesh.faces) == 2 * 24
    assert mesh.materials == ("Red", "Blue")
    assert mesh.face_material is not None
    assert np.bincount(mesh.face_material).tolist() == [40, 8]
    assert export.scene.materials["Blue"].base_color == pytest.approx([0.1, 0.1, 0.8])


def test_slot_linked_to_the_object_wins() -> None:
    ob = bs.add("Cube", bs.cube("Cube", bs.material("Of data")))
    ob.material_slots[0].link = "OBJECT"
    ob.material_slots[0].material = bs.material("Of object", (0.2, 0.3, 0.4))
    bs.light("POINT")
    assert bs.export().scene.meshes["Cube"].materials == ("Of object",)


def test_collection_instances_are_exported_in_place() -> None:
    hidden = bpy.data.collections.new("Parts")
    part = bpy.data.objects.new("Part", bs.cube("Part"))
    hidden.objects.link(part)
    for k in range(3):
        empty = bs.add(f"Instancer {k}", None, (5 * k, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", hidden
    bs.light("POINT")
    meshes = bs.export().scene.meshes
    assert list(meshes) == ["Part"]
    instances = meshes["Part"].instances
    assert instances is not None
    assert sorted(instances[:, 0, 3]) == pytest.approx([0, 5, 10])
    assert meshes["Part"].vertices.mean(axis=0) == pytest.approx(np.zeros(3))


def test_text_comes_once() -> None:
    bs.add("Text", bpy.data.curves.new("Text", "FONT")).data.body = "Edge"
    bs.light("POINT")
    export = bs.export()
    assert list(export.scene.meshes) == ["Text"]
    assert len(export.scene.meshes["Text"].faces) > 0


def test_objects_hidden_in_renders_are_left_out() -> None:
    bs.light("POINT")
    for k, name in enumerate(("Shown", "Render", "Viewport", "Eye", "Collection", "Excluded")):
        bs.add(name, bs.cube(name), (3 * k, 0, 0))
    objects = bpy.data.objects
    objects["Render"].hide_render = True
    objects["Viewport"].hide_viewport = True
    objects["Eye"].hide_set(True)
    for name in ("Collection", "Excluded"):
        collection = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(objects[name])
        bpy.context.scene.collection.objects.unlink(objects[name])
    bpy.data.collections["Collection"].hide_render = True
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    export = bs.export()
    # The viewport hides two objects that a render shows.
    assert list(export.scene.meshes) == ["Shown", "Viewport", "Eye"]
    assert export.report.lines == []


def test_emission_and_diffuse_are_added() -> None:
    made = bs.material("Both", (0.2, 0.2, 0.2))
    tree = made.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1, 0.5, 0, 1), 2.0
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(bs.shader(made).outputs[0], both.inputs[0])
    tree.links.new(emission.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    bs.add("Cube", bs.cube("Cube", made))
    value = bs.export().scene.materials["Both"]
    assert value.base_color == pytest.approx([0.2] * 3) and value.emission == pytest.approx([2, 1, 0])


@pytest.mark.parametrize(
    ("break_it", "words"),
    [
        (lambda: setattr(bpy.context.scene, "camera", None), ["camera"]),
        (lambda: panorama(bpy.context.scene.camera.data, "MIRRORBALL"), ["camera 'Camera'", "Mirror Ball"]),
        (lambda: panorama(bpy.context.scene.camera.data, "FISHEYE_EQUIDISTANT", fisheye_fov=7.0),
         ["camera 'Camera'", "401 degrees"]),
        (lambda: panorama(bpy.context.scene.camera.data, "FISHEYE_LENS_POLYNOMIAL", fisheye_polynomial_k1=0.02),
         ["camera 'Camera'", "K0 to K4"]),
    ],
)
def test_cameras_that_cannot_be_rendered_are_refused(break_it: Any, words: Any) -> None:
    bs.light("POINT")
    break_it()
    with pytest.raises(Problem) as caught:
        bs.export()
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize(("scale", "named"), [((2, 2, 2), False), ((-1.5, 1.5, 1.5), False), ((1, 1, 0.5), True)])
def test_cameras_of_scaled_parents_are_rigid(scale: tuple[float, float, float], named: bool) -> None:
    bs.light("POINT")
    camera = bpy.context.scene.camera
    camera.rotation_euler = (1.0, 0.2, 0.3)
    camera.parent = bs.add("Rig", None)
    camera.parent.scale = scale
    bpy.context.view_layer.update()
    made = bs.export()
    made.scene.validate()
    axes = made.scene.camera.to_world[:3, :3]
    world = np.array(camera.matrix_world)[:3, :3]
    assert np.allclose(axes.T @ axes, np.eye(3), atol=1e-5)
    assert np.allclose(axes[:, 2], world[:, 2] / np.linalg.norm(world[:, 2]), atol=1e-6)
    assert np.sign(np.linalg.det(axes)) == np.sign(np.linalg.det(world))
    assert any("shears it" in line for line in made.report.lines) == named
    camera.parent.scale.z = 0.0
    bpy.context.view_layer.update()
    with pytest.raises(Problem, match="camera 'Camera': it is flattened"):
        bs.export()

"""The export reads what a render evaluates, and leaves Blender's data, modes, settings and last render as they are."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
bmesh = pytest.importorskip("bmesh")

from edgegrad import images
from edgegrad_addon import evaluation
from edgegrad_addon.export import export_scene
from edgegrad_addon.look.derivative import derivative_picture
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty(8)
    bs.camera()
    bs.light("POINT")


def collection(name: str, *members: Any) -> Any:
    """Layer collection of a new collection that holds these objects."""
    made = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(made)
    for ob in members:
        made.objects.link(ob)
        bpy.context.scene.collection.objects.unlink(ob)
    return bpy.context.view_layer.layer_collection.children[name]


def edit(*obs: Any) -> None:
    bpy.ops.object.select_all(action="DESELECT")
    for ob in obs:
        ob.select_set(True)
    bpy.context.view_layer.objects.active = obs[0]
    bpy.ops.object.mode_set(mode="EDIT")


def meshes() -> dict[str, Any]:
    export = bs.export()
    export.scene.validate()
    return dict(export.scene.meshes)


def settings() -> dict[str, Any]:
    """What an evaluation might change."""
    scene = bpy.context.scene
    simple = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")
    render = {p.identifier: getattr(scene.render, p.identifier)
              for p in scene.render.bl_rna.properties if p.type in simple and not p.is_readonly}  # fmt: skip
    layers = {layer.name: (layer.use, getattr(layer, "use_grease_pencil", None)) for layer in scene.view_layers}
    data = {kind: len(getattr(bpy.data, kind)) for kind in ("scenes", "images", "meshes", "objects", "cameras")}
    return {
        "render": {name: tuple(v) if hasattr(v, "__len__") and not isinstance(v, str) else v
                   for name, v in render.items()},
        "layers": layers, "data": data, "camera": scene.camera, "frame": (scene.frame_current, scene.frame_subframe),
        "window": bpy.context.view_layer.name,
    }  # fmt: skip


# ------------------------------------------------------------------------------------------------ what is read
def test_levels_and_switches_are_those_of_renders() -> None:
    for name, (viewport, render) in {"More": (0, 2), "Fewer": (2, 0)}.items():
        modifier = bs.add(name, bs.cube(name)).modifiers.new("Subdivide", "SUBSURF")
        modifier.levels, modifier.render_levels = viewport, render
    for name, (viewport, render) in {"On": (False, True), "Off": (True, False)}.items():
        modifier = bs.add(name, bs.cube(name)).modifiers.new("Array", "ARRAY")
        modifier.show_viewport, modifier.show_render = viewport, render
    counts = {name: len(mesh.vertices) for name, mesh in meshes().items()}
    assert counts == {"More": 98, "Fewer": 8, "On": 16, "Off": 8}


def test_every_way_of_hiding_in_the_viewport_is_ignored() -> None:
    for k, name in enumerate(("Eye", "Monitor", "Collection's eye", "Collection's monitor", "Excluded")):
        bs.add(name, bs.cube(name), (3 * k, 0, 0))
    objects = bpy.data.objects
    objects["Eye"].hide_set(True)
    objects["Monitor"].hide_viewport = True
    bs.light("POINT", "Lamp").hide_viewport = True
    collection("A", objects["Collection's eye"]).hide_viewport = True
    collection("B", objects["Collection's monitor"]).collection.hide_viewport = True
    collection("C", objects["Excluded"]).exclude = True
    export = bs.export()
    assert set(export.scene.meshes) == {"Eye", "Monitor", "Collection's eye", "Collection's monitor"}
    assert set(export.scene.lights) == {"Light", "Lamp"}
    assert export.report.lines == []


def test_instancers_and_emitters_are_shown_as_in_renders() -> None:
    part = bs.add("Part", bs.cube("Part"), (0, 0, 90))
    for name, render_type in (("Emitter", "OBJECT"), ("Bare", "NONE")):
        ob = bs.add(name, bs.plane(name, 2.0))
        ob.modifiers.new("Particles", "PARTICLE_SYSTEM")
        system = ob.particle_systems[0].settings
        system.count, system.frame_end, system.render_type, system.instance_object = 5, 1.0, render_type, part
        ob.show_instancer_for_render = False
    found = meshes()
    assert set(found) == {"Part"}
    assert len(found["Part"].instances) == 6


def test_frame_markers_and_animated_visibility_are_followed() -> None:
    ob = bs.add("Cube", bs.cube("Cube"))
    for frame, hidden in ((1, True), (5, False)):
        ob.hide_render = hidden
        ob.keyframe_insert("hide_render", frame=frame)
    scene, first = bpy.context.scene, bpy.context.scene.camera
    second = bs.camera((0, 0, 9), name="Second")
    for frame, camera in ((1, first), (4, second)):
        scene.timeline_markers.new("", frame=frame).camera = camera
    for frame, shown, height in ((1, False, 5.0), (6, True, 9.0)):
        scene.frame_set(frame)
        scene.camera = first
        export = bs.export()
        assert ("Cube" in export.scene.meshes) == shown
        assert export.scene.camera.to_world[2, 3] == pytest.approx(height)
        assert scene.camera == first


def test_rigid_bodies_are_where_their_simulation_puts_them() -> None:
    """Their cache belongs to the scene."""
    ob = bs.add("Ball", bs.cube("Ball"), (0, 0, 3))
    bpy.ops.rigidbody.world_add()
    bpy.context.view_layer.objects.active = ob
    bpy.ops.rigidbody.object_add()
    for frame in range(1, 8):
        bpy.context.scene.frame_set(frame)
    height = ob.matrix_world.translation.z
    assert height < 2.9
    assert meshes()["Ball"].vertices[:, 2].mean() == pytest.approx(height, abs=1e-5)


# ------------------------------------------------------------------------------------------------ view layers
def two_layers() -> tuple[Any, Any]:
    left, right = (collection(name, bs.add(name, bs.cube(name))) for name in ("Left", "Right"))
    first, second = bpy.context.view_layer, bpy.context.scene.view_layers.new("Second")
    right.exclude = True
    second.layer_collection.children[left.name].exclude = True
    return first, second


def test_the_view_layer_that_is_rendered_is_read() -> None:
    first, second = two_layers()
    first.use, second.use = False, True
    bpy.context.window.view_layer = first
    export = bs.export()
    assert list(export.scene.meshes) == ["Right"] and export.report.lines == []


def test_of_several_view_layers_the_first_is_read_and_the_others_are_named() -> None:
    _, second = two_layers()
    bpy.context.window.view_layer = second
    export = bs.export()
    assert list(export.scene.meshes) == ["Left"]
    (line,) = export.report.lines
    assert "'Second'" in line and "view layers" in line


def test_without_a_rendered_view_layer_the_active_one_is_read() -> None:
    first, second = two_layers()
    first.use = second.use = False
    bpy.context.window.view_layer = second
    assert list(meshes()) == ["Right"]
    assert not first.use and not second.use


def test_collections_that_only_indirect_rays_see_and_holdouts() -> None:
    collection("A", bs.add("Indirect", bs.cube("Indirect"))).indirect_only = True
    collection("B", bs.add("Hole", bs.cube("Hole"))).holdout = True
    export = bs.export()
    assert "camera" not in export.scene.meshes["Indirect"].visible_to
    assert "camera" in export.scene.meshes["Hole"].visible_to
    (line,) = export.report.lines
    assert "'Hole'" in line and "holdout" in line


# ------------------------------------------------------------------------------------------------ edit mode
def test_edit_mode_is_read_as_it_is_and_kept() -> None:
    data = bs.cube("Plain", bs.material("A"), bs.material("B", (0.1, 0.2, 0.3)))
    data.polygons[2].material_index = 1
    plain, rounded = bs.add("Plain", data), bs.add("Rounded", bs.cube("Rounded"), (4, 0, 0))
    modifier = rounded.modifiers.new("Subdivide", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 2
    before = meshes()
    edit(plain, rounded)
    found = meshes()
    assert (plain.mode, rounded.mode, bpy.context.mode) == ("EDIT", "EDIT", "EDIT_MESH")
    for name in ("Plain", "Rounded"):
        assert found[name].vertices == pytest.approx(before[name].vertices, abs=1e-6)
        assert np.array_equal(found[name].faces, before[name].faces)
        assert np.array_equal(found[name].face_material, before[name].face_material)


def test_unfinished_edits_are_exported() -> None:
    ob = bs.add("Cube", bs.cube("Cube"))
    edit(ob)
    body = bmesh.from_edit_mesh(ob.data)
    body.verts.ensure_lookup_table()
    body.verts[0].co.x -= 2.0
    bmesh.update_edit_mesh(ob.data)
    assert meshes()["Cube"].vertices[:, 0].min() == pytest.approx(-3.0)
    assert bmesh.from_edit_mesh(ob.data).is_valid


def test_attributes_of_a_mesh_in_edit_mode_are_read() -> None:
    made = bs.material("M")
    node = made.node_tree.nodes.new("ShaderNodeUVMap")
    made.node_tree.links.new(node.outputs["UV"], bs.shader(made).inputs["Color"])
    ob = bs.add("Cube", bs.cube("Cube", made))
    uv = np.random.default_rng(0).uniform(0, 1, 48).astype(np.float32)
    ob.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv)
    (before,) = (list(mesh.attributes.items()) for mesh in meshes().values())
    edit(ob)
    (after,) = (list(mesh.attributes.items()) for mesh in meshes().values())
    assert before and [name for name, _ in before] == [name for name, _ in after]
    assert all(np.array_equal(a, b) for (_, a), (_, b) in zip(before, after, strict=True))


# ------------------------------------------------------------------------------------------------ what is kept
def unusual_scene() -> Any:
    scene = bpy.context.scene
    scene.render.use_freestyle = scene.render.use_multiview = scene.render.use_persistent_data = True
    scene.render.use_compositing = scene.render.use_sequencer = True
    scene.view_layers.new("Second")
    scene.frame_set(3, subframe=0.25)
    bs.add("Cube", bs.cube("Cube"))
    return scene


def test_settings_data_and_engines_stay() -> None:
    scene = unusual_scene()
    before = settings()
    bs.export()
    assert settings() == before
    with pytest.raises(TypeError, match=evaluation.ENGINE):
        scene.render.engine = evaluation.ENGINE


def test_the_users_settings_are_in_place_while_they_are_read() -> None:
    scene = unusual_scene()
    before = settings()
    inside = evaluation.evaluate(scene, lambda _: settings())
    assert inside["layers"] == before["layers"] and inside["camera"] == before["camera"]
    different = {name for name, value in inside["render"].items() if value != before["render"][name]}
    assert different == {"engine"}


@pytest.mark.parametrize("error", [KeyError("x"), KeyboardInterrupt("stop"), Problem("p")])
def test_exceptions_come_out_as_they_were(error: BaseException) -> None:
    scene = unusual_scene()
    before = settings()

    def fail(_: Any) -> None:
        raise error

    with pytest.raises(type(error)) as caught:
        evaluation.evaluate(scene, fail)
    assert caught.value is error
    assert settings() == before


def test_blenders_reason_is_told(monkeypatch: Any) -> None:
    """A scene whose camera is gone when the render starts."""
    scene = unusual_scene()
    before = settings()
    monkeypatch.setattr(evaluation, "_active_camera", lambda *_: nullcontext(setattr(scene, "camera", None)))
    with pytest.raises(Problem, match=r"'Scene'.*no camera"):
        evaluation.evaluate(scene, lambda _: None)
    scene.camera = before["camera"]
    assert settings() == before


def test_the_last_render_stays(tmp_path: Any) -> None:
    scene = bpy.context.scene
    scene.cycles.samples = 1
    bs.world((0.25, 0.5, 0.75))
    bpy.ops.render.render()
    bs.export()
    bs.export()
    result = bpy.data.images["Render Result"]
    result.save_render(str(tmp_path / "kept.exr"))
    assert images.read_image(tmp_path / "kept.exr")[4, 4, :3] == pytest.approx([0.25, 0.5, 0.75], rel=1e-5)
    assert [slot.name for slot in result.render_slots].count(evaluation.SLOT) == 1


def test_a_camera_can_be_given_and_several() -> None:
    scene = bpy.context.scene
    other = bs.camera((0, 0, 7), name="Other")
    scene.camera = None
    with pytest.raises(Problem, match="has no camera"):
        export_scene(scene)
    third = bs.add("Third", bpy.data.cameras.new("Third"), (0, 0, 8))
    third.hide_render = True
    bpy.context.view_layer.update()
    export = export_scene(scene, [other, third])
    assert [view.to_world[2, 3] for view in export.views] == pytest.approx([7.0, 8.0])
    assert export.scene.camera is export.views[0] and scene.camera is None


def test_vertices_of_objects_that_the_viewport_hides_can_be_fitted() -> None:
    ob = bs.add("Cube", bs.cube("Cube"))
    ob.hide_viewport = True
    modifier = ob.modifiers.new("Subdivide", "SUBSURF")
    modifier.show_render = False
    picture, _, _ = derivative_picture(bpy.context, Names(vertices=("Cube",)), "X", samples=2)
    assert np.isfinite(picture).all() and np.abs(picture).max() > 0.0
    modifier.show_viewport, modifier.show_render = False, True
    with pytest.raises(Problem, match=r"'Cube'.*'Subdivide' changes the topology.*in renders"):
        derivative_picture(bpy.context, Names(vertices=("Cube",)), "X", samples=2)


def test_an_object_that_the_work_moves_keeps_its_modifiers() -> None:
    ob = bs.add("Cube", bs.cube("Cube"))
    ob.modifiers.new("Round", "SUBSURF").render_levels = 1

    def work(evaluated: evaluation.Evaluation) -> int:
        ob.location[0] += 0.1
        evaluated.depsgraph.update()
        return len(ob.evaluated_get(evaluated.depsgraph).data.vertices)

    assert evaluation.evaluate(bpy.context.scene, work) == 26

"""The lists of targets and parameters, the set-ups, and what is in the way of a fit."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import images
from edgegrad_addon import preflight, rows, setups
from edgegrad_addon.animated.stored import add_row, stored_wanted
from edgegrad_addon.operators.parameters import add_of_button
from edgegrad_addon.panel import derived
from edgegrad_addon.panel.parameters import AddMenu, ParameterList
from edgegrad_addon.problem import Problem
from edgegrad_addon.properties import request
from edgegrad_addon.session import Session
from edgegrad_addon.targets import rows as target_rows
from tests.support.animated import scenes as zoo
from tests.support.scenes import blender_scenes as bs

pytestmark = pytest.mark.usefixtures("scene")


def select(*names: str) -> None:
    for ob in bpy.context.view_layer.objects:
        ob.select_set(ob.name in names)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]] if names else None


def test_plus_takes_the_active_camera_then_the_next_without_a_target(scene: Any) -> None:
    for name in ("Left", "Right"):
        bs.camera(name=name)
    scene.camera = bpy.data.objects["Left"]
    for _ in range(4):
        bpy.ops.edgegrad.target_add()
    names = [row.camera.name if row.camera else None for row in scene.edgegrad.targets]
    assert names == ["Left", "Front", "Right", None]


def test_dropped_pictures_become_targets(scene: Any, tmp_path: Path) -> None:
    """The first one sets the size of renders; each of several needs a camera of its own; one alone may replace."""

    def drop(*names: str) -> None:
        bpy.ops.edgegrad.targets_drop(directory=str(tmp_path), files=[{"name": name} for name in names])

    def found() -> list[tuple[str, str]]:
        return [(row.camera.name, Path(row.image).name) for row in scene.edgegrad.targets]

    bs.camera(name="Side")
    scene.camera = bpy.data.objects["Front"]
    for k, name in enumerate("abc"):
        images.write_image(tmp_path / f"{name}.exr", np.ones((10, 20 + k, 3), np.float32))
    drop("a.exr")
    assert (scene.render.resolution_x, scene.render.resolution_y) == (20, 10)
    drop("b.exr")
    assert found() == [("Front", "a.exr"), ("Side", "b.exr")] and scene.render.resolution_x == 20
    drop("c.exr")
    assert found() == [("Front", "a.exr"), ("Side", "c.exr")]
    with pytest.raises(RuntimeError, match="every camera has a target"):
        drop("a.exr", "b.exr")
    scene.edgegrad.targets.clear()
    drop("a.exr", "b.exr")
    assert found() == [("Front", "a.exr"), ("Side", "b.exr")]


@pytest.mark.parametrize("suffix", [".exr", ".png", ".jpg", ".tif"])
def test_sizes_of_pictures_are_read_from_their_heads(suffix: str, tmp_path: Path) -> None:
    from PIL import Image

    file = tmp_path / f"one{suffix}"
    if suffix == ".exr":
        images.write_image(file, np.ones((7, 9, 3), np.float32))
    else:
        Image.new("RGB", (9, 7)).save(file)
    assert target_rows.picture_size(str(file)) == (9, 7)
    file.write_bytes(b"no picture")
    assert target_rows.picture_size(str(file)) is None
    assert target_rows.picture_size("") is None and target_rows.picture_size(str(tmp_path)) is None


def test_renders_become_as_large_as_the_picture(scene: Any, picture: str) -> None:
    scene.render.resolution_percentage, scene.render.use_border = 50, True
    assert bpy.ops.edgegrad.target_open(filepath=picture) == {"FINISHED"}
    assert (scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage) == (20, 10, 100)
    assert scene.edgegrad.targets[0].camera == scene.camera and not scene.render.use_border
    scene.render.resolution_x = 99
    assert target_rows.state(scene.edgegrad.targets[0], scene) == ("ERROR", "a picture.exr")
    bpy.ops.edgegrad.match_render()
    assert target_rows.state(scene.edgegrad.targets[0], scene) == ("CHECKMARK", "a picture.exr")


def test_each_obstacle_has_its_cure(scene: Any, picture: str) -> None:
    """Each cure is pressed as the panel's button does, until nothing is in the way."""
    row = rows.add_kind(scene, "POWER", bpy.data.objects["Lamp"])
    bpy.data.objects.remove(bpy.data.objects["Front"])
    scene.edgegrad.targets.add().image = picture
    seen = []

    def cure(**more: Any) -> None:
        found = preflight.obstacle(bpy.context)
        assert found is not None
        seen.append(found.operator)
        group, name = found.operator.split(".")
        getattr(getattr(bpy.ops, group), name)(**found.options, **more)

    cure()
    scene.camera = next(ob for ob in scene.objects if ob.type == "CAMERA")
    cure()  # the target of the camera that was removed keeps its picture
    target = scene.edgegrad.targets[0]
    assert (target.camera, target.image) == (scene.camera, picture)
    cure()
    scene.edgegrad.targets.add().image = picture
    cure()  # no camera is left for the second target
    assert len(scene.edgegrad.targets) == 1
    scene.edgegrad.targets.clear()
    cure(filepath=picture)
    scene.edgegrad.targets[0].image = "//nowhere.png"
    cure(filepath=picture)
    scene.render.resolution_x = 77
    cure()
    bpy.data.objects.remove(row.owner)
    cure()
    select("Cube")
    cure()
    bpy.ops.object.mode_set(mode="EDIT")
    cure()
    assert preflight.obstacle(bpy.context) is None
    for name in ("Cube", "Bulb"):
        if name == "Bulb":
            rows.add_kind(scene, "POWER", bs.light("POINT", "Bulb"))
        scene.collection.objects.unlink(bpy.data.objects[name])  # the list still holds it, as after a deletion
        cure()
        assert not scene.edgegrad.parameters
    del seen[-2:]
    assert seen == ["object.camera_add", "edgegrad.target_use_camera", "edgegrad.match_render", "edgegrad.row_remove",
                    "edgegrad.target_open", "edgegrad.target_open", "edgegrad.match_render", "edgegrad.row_remove",
                    "edgegrad.parameters_add", "object.mode_set"]  # fmt: skip


def test_rows_of_all_kinds_are_one_list(scene: Any) -> None:
    cube, lamp = bpy.data.objects["Cube"], bpy.data.objects["Lamp"]
    select("Cube", "Lamp")
    bpy.data.materials["Clay"].node_tree.nodes.new("ShaderNodeTexImage").image = bpy.data.images.new("Skin", 4, 4)
    for kind in rows.KINDS:
        bpy.ops.edgegrad.parameters_add(of=kind)
        bpy.ops.edgegrad.parameters_add(of=kind)  # no second row
    add_row(scene, cube, "location", 2)
    assert [rows.title(row)[1:] for row in scene.edgegrad.parameters] == [
        ("Cube", "Vertices"), ("Clay", "Base Color"), ("Clay", "Emission"), ("Lamp", "Power"), ("Skin", "Pixels"),
        ("Cube", "Location Z")]  # fmt: skip
    found = request(bpy.context)
    assert found.names.vertices == ("Cube",) and found.names.base_color == found.names.emission == ("Clay",)
    assert found.names.power == ("Lamp",) and [one.path for one in found.animated] == ['objects["Cube"].location[2]']
    cube.name, lamp.name = "Box", "Bulb"
    scene.edgegrad.parameters[1].enabled = False
    found = request(bpy.context)
    assert (found.names.vertices, found.names.base_color, found.names.power) == (("Box",), (), ("Bulb",))


def test_values_that_cannot_be_fitted_make_no_row(scene: Any) -> None:
    bs.light("POINT", "Twin").data = bpy.data.objects["Lamp"].data
    with pytest.raises(Problem, match="is shared with object"):
        rows.add_kind(scene, "POWER", bpy.data.objects["Lamp"])
    with pytest.raises(Problem, match="is no mesh"):
        rows.add_kind(scene, "VERTICES", bpy.data.objects["Lamp"])
    select("Front")
    with pytest.raises(RuntimeError, match="No mesh is selected"):
        bpy.ops.edgegrad.parameters_add(of="VERTICES")
    select("Cube")
    for name in ("location", "rotation_euler", "scale"):
        bpy.data.objects["Cube"].driver_add(name)
    with pytest.raises(RuntimeError, match="is driven"):
        bpy.ops.edgegrad.parameters_add(of="OBJECT")
    assert not scene.edgegrad.parameters


def test_a_removed_row_leaves_another_active(scene: Any) -> None:
    cube = bpy.data.objects["Cube"]
    for name in ("location", "scale", "delta_location"):
        add_row(scene, cube, name)
    scene.edgegrad.active_parameter = 2
    for number, name in ((0, "delta_location"), (1, "scale"), (0, "")):
        bpy.ops.edgegrad.row_remove(parameters=True, number=number)
        left = scene.edgegrad.parameters
        assert (left[scene.edgegrad.active_parameter].path if left else "") == name


def test_paths_are_named_as_buttons_are() -> None:
    ob = bpy.data.objects["Cube"]
    bend = ob.modifiers.new("Bend it", "SIMPLE_DEFORM")
    ob["Lift"] = 0.5
    clay = bpy.data.materials["Clay"]
    socket = bs.shader(clay).inputs["Roughness"]
    assert rows.words(ob, "rotation_euler") == "Rotation" and rows.words(ob, "rotation_euler", 2) == "Rotation Z"
    assert rows.words(ob, "rotation_quaternion", 0) == "Rotation W"
    assert rows.words(ob, bend.path_from_id("angle")) == "Bend it: Angle"
    assert rows.words(ob, '["Lift"]') == "Lift" and rows.words(ob, "location", 0).endswith("X")
    path = f"node_tree.{socket.path_from_id('default_value')}"
    assert rows.words(clay, path).endswith(": Roughness") and rows.words(ob, "gone.away").startswith("(missing)")


def test_rows_are_told_apart_in_little_room(scene: Any) -> None:
    ob, glass = bpy.data.objects["Cube"], bpy.data.materials.new("Glass")
    rig = zoo.armature(ob, 3, 0.7)
    for bone, side in zip(rig.pose.bones, "LRM", strict=True):
        bone.name = f"Upper arm of the giant.{side}"
        for axis in range(3):
            add_row(scene, rig, bone.path_from_id("rotation_euler"), axis)

    def add_socket(material: Any, node: Any, socket: str) -> None:
        add_row(scene, material, f"node_tree.{node.inputs[socket].path_from_id('default_value')}")

    for material in (*(bpy.data.materials.new("A rather long name") for _ in range(2)), glass):
        material.use_nodes = True
        for socket in ("Roughness", "Base Color", "Subsurface Weight", "Subsurface Scale"):
            add_socket(material, bs.shader(material), socket)
    for kind in ("ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfGlossy"):
        add_socket(glass, glass.node_tree.nodes.new(kind), "Roughness")
    for name in ("Left", "Right"):
        add_row(scene, ob, ob.modifiers.new(name, "SIMPLE_DEFORM").path_from_id("angle"))
    rows.add_kind(scene, "VERTICES", ob)
    for room in (20, 24, 60):
        found = [rows.names(row, room)[2] for row in scene.edgegrad.parameters]
        assert len(set(found)) == len(found) == 9 + 12 + 3 + 3 and max(map(len, found)) <= room, found
    first = scene.edgegrad.parameters[0]
    assert rows.names(first, 60)[2] == "Upper arm of the giant.L: Rotation X"
    assert rows.names(first, 20)[2] == "Upp…t.L: Rotation X"


def test_the_menu_of_plus_offers_the_tasks(scene: Any) -> None:
    """Where the list has rows, it is the only place that does."""
    tasks: list[SimpleNamespace] = []

    def operator(name: str, **_: Any) -> SimpleNamespace:
        tasks.append(SimpleNamespace(name=name))
        return tasks[-1]

    def operator_enum(name: str, task: str) -> None:
        operator(name).task = task

    layout = SimpleNamespace(label=lambda **_: None, separator=lambda: None, operator=operator,
                             operator_enum=operator_enum)  # fmt: skip
    AddMenu.draw(SimpleNamespace(layout=layout), bpy.context)
    assert [(one.name, one.task) for one in tasks] == [
        ("edgegrad.parameters_add", "of"), *(("edgegrad.set_up", name) for name in setups.SETUPS)]  # fmt: skip


def test_set_ups_choose_what_may_change(scene: Any) -> None:
    select("Cube")
    bpy.ops.edgegrad.target_add()
    said = setups.apply(bpy.context, "MATERIALS")
    assert "'Clay'" in said[0] and "'Lamp'" in said[0] and "200 iterations" in said[1]
    scene.edgegrad.samples = 3
    said = setups.apply(bpy.context, "CAMERA")
    assert scene.edgegrad.samples == 16 and "2 other parameters are switched off" in said
    assert [one.path.rpartition(".")[2] for one in stored_wanted(scene)] == ["location", "rotation_euler", "lens"]
    scene.edgegrad.parameters[0].enabled = True
    assert "1 other parameter is switched off" in setups.apply(bpy.context, "CAMERA")
    setups.apply(bpy.context, "SCULPT")
    assert request(bpy.context).names.vertices == ("Cube",) and not stored_wanted(scene)
    setups.apply(bpy.context, "MATERIALS")
    assert len(scene.edgegrad.parameters) == 6  # rows of before are used again
    with pytest.raises(Problem, match="no armature"):
        setups.apply(bpy.context, "POSE")
    zoo.armature(bpy.data.objects["Cube"], 3, 0.7)
    setups.apply(bpy.context, "POSE")
    assert len(stored_wanted(scene)) == 4


def test_a_base_color_from_a_texture_is_no_value(scene: Any) -> None:
    made = bpy.data.materials.new("Painted")
    made.use_nodes = True
    tree = made.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"],
                   tree.nodes["Principled BSDF"].inputs["Base Color"])  # fmt: skip
    assert setups.fed(made, "Base Color") and not setups.fed(made, "Roughness")
    bpy.data.objects["Cube"].data.materials.append(made)
    setups.apply(bpy.context, "MATERIALS")
    assert request(bpy.context).names.base_color == ("Clay",)


def test_rows_have_the_names_that_blender_filters_by(scene: Any) -> None:
    row, lamp = rows.add_kind(scene, "POWER", bpy.data.objects["Lamp"]), bpy.data.objects["Lamp"]
    add_row(scene, lamp, "location", 1)
    parameters = scene.edgegrad.parameters
    assert [one.name for one in parameters] == ["Lamp: Power", "Lamp: Location Y"]
    lamp.name = "Key"
    assert [one.name for one in parameters] == ["Key: Power", "Key: Location Y"]
    if bpy.app.version < (5, 2, 0):
        asked = SimpleNamespace(filter_name="LOCATION", bitflag_filter_item=1)
        assert ParameterList.filter_items(asked, bpy.context, scene.edgegrad, "parameters") == ([0, 1], [])
    else:  # the search of collections and the filter of lists read the same name
        assert parameters.find("Key: Power") == 0 and parameters.find("Key: Location Y") == 1
    row.owner = None
    assert row.name == "(removed): Power"


def test_images_of_what_is_selected_become_parameters(scene: Any) -> None:
    """Also those in groups of nodes; the button of an image's name stands for its pixels."""
    found = [bpy.data.images.new(name, 4, 2) for name in ("Skin", "Inner", "Grey")]
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.nodes.new("ShaderNodeTexImage").image = found[1]
    tree = bpy.data.materials["Clay"].node_tree
    tree.nodes.new("ShaderNodeTexImage").image = found[0]
    tree.nodes.new("ShaderNodeGroup").node_tree = group
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    bpy.ops.edgegrad.parameters_add(of="IMAGE")
    parameters = scene.edgegrad.parameters
    assert [row.name for row in parameters] == ["Skin: Pixels", "Inner: Pixels"]
    derived.see_rows(scene.edgegrad, 2, 500.0)
    assert derived.parameter(parameters[0]).beside == "4 × 2"
    assert request(bpy.context).names.image == ("Skin", "Inner")
    add_of_button(scene, found[2], "name", -1)
    add_of_button(scene, bpy.data.materials["Clay"], 'node_tree.nodes["Image Texture"].image', -1)
    assert [row.name for row in parameters] == ["Skin: Pixels", "Inner: Pixels", "Grey: Pixels"]


def test_buttons_of_nodes_add_values_of_their_datablock(scene: Any) -> None:
    """Blender tells the embedded node tree as their owner, which is in no list of the file's data."""
    scene.world = bpy.data.worlds.new("Sky")
    for owner in (bpy.data.materials["Clay"], scene.world, bpy.data.lights["Lamp"]):
        if owner.node_tree is None:  # Blender 5 warns about the property
            owner.use_nodes = True
        value = owner.node_tree.nodes.new("ShaderNodeValue")
        row = add_of_button(scene, owner.node_tree, value.outputs[0].path_from_id("default_value"), -1)
        assert row.owner == owner and row.path == 'node_tree.nodes["Value"].outputs[0].default_value'


def test_buttons_without_a_datablock_are_refused(scene: Any) -> None:
    with pytest.raises(Problem, match="setting of Blender"):
        add_of_button(scene, bpy.context.preferences, "view.ui_scale", -1)


def test_notes_name_rows_as_the_list_does(scene: Any, picture: str) -> None:
    scene.render.resolution_x, scene.render.resolution_y = 20, 10
    target = scene.edgegrad.targets.add()
    target.camera, target.image = bpy.data.objects["Front"], picture
    rows.add_kind(scene, "BASE_COLOR", bpy.data.materials["Clay"])
    add_row(scene, bpy.data.objects["Cube"], "location", 2)
    session = Session.prepare(bpy.context, request(bpy.context))
    path, moved = session.wrt[0], session.driver.variables[0].path
    assert rows.in_words(scene, session, [f"'{path}': 1 ± 2", f"'{moved}' stays", "plain", "plain"]) == [
        "'Clay: Base Color': 1 ± 2", "'Cube: Location Z' stays", "plain"]  # fmt: skip
    sentences = [f"'{path}': [0] 1 ± 2, [2] open", f"'{path}' [1] and '{moved}' can be exchanged", f"'{moved}': [0] 1"]
    assert rows.in_words(scene, session, sentences) == [
        "'Clay: Base Color': R 1 ± 2, B open", "'Clay: Base Color' G and 'Cube: Location Z' can be exchanged",
        "'Cube: Location Z': [0] 1"]  # fmt: skip


def test_numbers_are_named_as_blenders_buttons_name_them(scene: Any) -> None:
    cube, camera = bpy.data.objects["Cube"], bpy.data.cameras["Front"]
    cube["a list"], cube['a "name"'] = [0.25, 0.5], 1.0
    color = 'node_tree.nodes["Diffuse BSDF"].inputs[0].default_value'
    for owner, path, index, words in (
            (cube, "location", 1, "Location Y"), (cube, "color", 3, "Color A"),
            (cube, '["a list"]', 1, "a list [1]"), (cube, '["a \\"name\\""]', -1, 'a "name"'),
            (bpy.data.materials["Clay"], color, 0, "Diffuse BSDF: Color R"),
            (camera, "dof.aperture_fstop", -1, "Depth of Field: F-Stop")):  # fmt: skip
        row = add_row(scene, owner, path, index)
        assert row.name == f"{owner.name}: {words}"

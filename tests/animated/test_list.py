"""The list of parameters in the scene, the command line, and messages that a user can act on."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
import edgegrad_addon
from edgegrad import images
from edgegrad.scene.changes import changes
from edgegrad_addon import command_line
from edgegrad_addon.animated import data_path, gathering, refusals, stored
from edgegrad_addon.animated.driver import Driver
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.problem import Problem
from tests.support.animated import scenes as zoo
from tests.support.scenes import blender_scenes as bs


@pytest.fixture
def enabled() -> Iterator[None]:
    edgegrad_addon.register()
    yield
    edgegrad_addon.unregister()


@pytest.mark.parametrize("path", ['objects["Man in Black"].location', "objects['Man in Black'].location",
                                  r'objects["5\" in steel"].location[1]'])  # fmt: skip
def test_names_may_look_like_limits(path: str) -> None:
    assert Wanted.parse(path) == Wanted(path)
    assert Wanted.parse(f"{path} in -1:2") == Wanted(path, -1.0, 2.0)
    assert Wanted.parse(f"{path} in :2") == Wanted(path, None, 2.0)
    for limits in ("0", "nan:1", "low:1"):
        with pytest.raises(Problem, match="must have the form LOW:HIGH"):
            Wanted.parse(f"{path} in {limits}")


def driver(*paths: str) -> Driver:
    return Driver(bpy.context.scene, [bpy.context.scene.camera], [Wanted(path) for path in paths])


def refused(path: str, *words: str) -> None:
    with pytest.raises(Problem) as found:
        driver(path)
    assert all(word in str(found.value) for word in words), str(found.value)


def test_rows_survive_renames_removals_and_saving(enabled: None, tmp_path: Path) -> None:
    ob, scene = zoo.stage(), bpy.context.scene
    row = stored.add_row(scene, ob, "location")
    row.use_limits, row.low, row.high, row.step = True, -1.0, 2.0, 0.1
    stored.add_row(scene, bpy.data.lights["Lamp"], "energy")
    stored.add_row(scene, ob, "scale", 1)
    assert stored.add_row(scene, ob, "scale", 1) == scene.edgegrad.parameters[2] and len(scene.edgegrad.parameters) == 3
    ob.name = 'A "new" name'
    path = tmp_path / "list.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    wanted = stored.stored_wanted(scene)
    assert wanted[0] == Wanted('objects["A \\"new\\" name"].location', -1.0, 2.0, wanted[0].step)
    assert wanted[2].path.endswith(".scale[1]") and len(data_path.find(wanted[0].path)) == 3
    bpy.data.lights.remove(bpy.data.lights["Lamp"])
    with pytest.raises(Problem, match="its datablock was removed"):
        stored.stored_wanted(scene)
    scene.edgegrad.parameters[1].enabled = False
    assert len(stored.stored_wanted(scene)) == 2


def test_all_properties_of_one_thing(enabled: None) -> None:
    ob, scene = zoo.stage(), bpy.context.scene
    zoo.shape_key(ob, "Wide", 1, (0.3, 0, 0))
    zoo.driven_by(ob, "Lift", 0.1, ob, "location", 2)
    rig = zoo.armature(ob, 3, 0.7)
    wanted, notes = stored.wanted_of(zoo.CUBE)
    names = {one.path for one in wanted}
    assert {f"{zoo.CUBE}.rotation_euler", f'{zoo.CUBE}["Lift"]', f'{zoo.KEYS}.key_blocks["Wide"].value'} <= names
    assert f"{zoo.CUBE}.location" not in names and any("is driven" in note for note in notes)
    bones, _ = stored.wanted_of('objects["Rig"].pose.bones["Bone1"]')
    assert [one.path.rpartition(".")[2] for one in bones] == ["rotation_euler", "rotation_euler"]
    assert len(gathering.of_bones(rig, rig.pose.bones["Bone0"])) == 4  # and the location of the first one
    bpy.context.view_layer.objects.active = ob
    assert bpy.ops.edgegrad.parameters_add(of="OBJECT") == {"FINISHED"}
    assert {one.path for one in stored.stored_wanted(scene)} == names


def test_what_changes_nothing_is_dropped_and_named() -> None:
    zoo.stage()
    found = driver(f"{zoo.CLAY}.nodes[\"Diffuse BSDF\"].inputs[0].default_value", f"{zoo.CUBE}.scale")
    assert [len(one.places) for one in found.parameters] == [3, 3]
    assert len(found.notes) == 1 and "default_value[3]': changes nothing" in found.notes[0]
    refused('objects["Cube"].empty_display_size', "changes nothing that is rendered")


def test_refusals_name_the_thing_and_the_cure() -> None:
    ob = zoo.stage()
    refused('objects["Cub"].location', "there is no 'Cub'", "'Cube'")
    refused('objects["Cube"].nothing', "finds no property 'nothing'")
    refused('objects["Cube"].name', "only decimal numbers")
    refused('objects["Cube"]', "add a property")
    refused("location", "must be a datablock and a path", 'objects["Cube"].location')
    with pytest.raises(Problem, match="given twice"):
        driver(f"{zoo.CUBE}.location", f"{zoo.CUBE}.location[0]")
    zoo.driven_by(ob, "Turn", 0.2, ob, "rotation_euler", 1)
    refused(f"{zoo.CUBE}.rotation_euler", "is driven", "'[\"Turn\"]' of 'Cube'")
    ob.keyframe_insert("location", index=1)
    refused(f"{zoo.CUBE}.location", "location[1]", "is keyed", "remove its keyframes")
    refusals.check(data_path.find(f"{zoo.CUBE}.location[0]")[0])
    ball = bs.add("Ball", bs.cube("Ball", bpy.data.materials["Clay"]), (0, 0, 3))
    zoo.subdivided(ball, 4)
    ball.modifiers.new("Fewer", "DECIMATE").ratio = 0.5
    refused('objects["Ball"].modifiers["Fewer"].ratio', "the topology of object 'Ball' changes")
    with pytest.raises(Problem, match="outside of its limits"):
        Driver(bpy.context.scene, [bpy.context.scene.camera], [Wanted(f"{zoo.CUBE}.scale", 2.0, 3.0)])


def test_strips_count_only_while_they_have_an_effect() -> None:
    """The cure that the refusal names helps."""
    ob = zoo.stage()
    ob.keyframe_insert("location", frame=1)
    animation = ob.animation_data
    strip = animation.nla_tracks.new().strips.new("Strip", 1, animation.action)
    animation.action = None
    (place, *_) = data_path.find(f"{zoo.CUBE}.location")
    with pytest.raises(Problem, match="mute the strip"):
        refusals.check(place)
    strip.mute = True
    refusals.check(place)
    strip.mute, animation.use_nla = False, False
    refusals.check(place)


def test_linked_properties_are_refused(tmp_path: Path) -> None:
    zoo.stage()
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    zoo.stage()
    with bpy.data.libraries.load(str(path), link=True) as (_, target):
        target.materials = ["Clay"]
    linked = next(one for one in bpy.data.materials if one.library is not None)
    bpy.data.objects["Cube"].data.materials[0] = linked
    place = data_path.places(linked, 'node_tree.nodes["Diffuse BSDF"].inputs[0].default_value')[0]
    with pytest.raises(Problem, match=r"is linked from .*make it local"):
        refusals.check(place)


def test_probing_leaves_the_file_as_it_was() -> None:
    ob = zoo.stage()
    zoo.geometry_nodes(ob)
    zoo.lattice(ob)
    zoo.driven_by(ob, "Turn", 0.2, ob, "rotation_euler", 1)
    paths = [f"{zoo.CUBE}.location", f'{zoo.CUBE}["Turn"]', f'{zoo.CUBE}.modifiers["Nodes"]["Lift"]',
             'lattices["Lattice"].points[3].co_deform', 'cameras["Camera"].lens', 'lights["Lamp"].energy']  # fmt: skip
    bpy.context.view_layer.update()
    before = [place.read() for path in paths for place in data_path.find(path)]
    scene = bs.export().scene
    found = driver(*paths)
    found.place({one.path: one.value + 0.01 for one in found.variables})
    bpy.context.view_layer.update()
    assert [place.read() for path in paths for place in data_path.find(path)] == before
    assert not changes(scene, bs.export().scene)


def test_steps_that_change_the_topology_are_shortened() -> None:
    """A key pulls one side of a half cube towards the plane of a Mirror, which merges what is nearer than 1 mm."""
    ob = zoo.stage()
    for vertex in ob.data.vertices[:4]:
        vertex.co.x = 0.2
    ob.modifiers.new("Mirror", "MIRROR").merge_threshold = 0.05
    key = zoo.shape_key(ob, "Close", 0, (-0.2, 0.0, 0.0))
    for k in range(1, 4):
        key.data[k].co.x = 0.0
    key.value = 0.0
    found = driver(f'{zoo.KEYS}.key_blocks["Close"].value')
    name = found.variables[0].path
    placed = found.place({name: np.array([0.5])})
    assert placed.values[name] == [0.5]
    placed = found.place({name: np.array([1.0])})
    assert 0.5 < placed.values[name][0] < 0.9 and any("topology" in note for note in found.notes)
    assert key.value == 0.0


def test_command_line_fits_and_checks_the_stored_list(enabled: None, tmp_path: Path, capsys: Any) -> None:
    ob = zoo.stage(24)
    target, start, fitted = (tmp_path / name for name in ("target.exr", "start.blend", "fitted.blend"))
    images.write_image(target, edgegrad.render(bs.export().scene, spp=64))
    ob.location.x += 0.3
    stored.add_row(bpy.context.scene, ob, "location", 0)
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    digest = hashlib.sha256(start.read_bytes()).hexdigest()
    options = [str(start), "--target", f"Camera={target}", "--iterations", "40", "--samples", "8"]
    options += ["--save", str(fitted)]
    assert command_line.main(["fit", *options]) == 0
    assert hashlib.sha256(start.read_bytes()).hexdigest() == digest
    bpy.ops.wm.open_mainfile(filepath=str(fitted))
    assert bpy.data.objects["Cube"].location.x == pytest.approx(0.1, abs=0.02)
    assert bpy.context.scene.edgegrad.parameters[0].sensitivity == 1.0
    bpy.context.scene.edgegrad.parameters.clear()
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    parameter = ["--parameter", 'objects["Cube"].location[2] in -1:1', "--parameter", 'lights["Lamp"].energy']
    assert command_line.main(["fit", *options, *parameter, "--iterations", "2"]) == 0
    capsys.readouterr()
    assert command_line.main(["check", str(start), *parameter, "--samples", "64"]) == 0
    said = capsys.readouterr().out
    assert said.count(": agrees, difference") == 2
    assert command_line.main(["check", str(start)]) == 1
    assert "no property is given" in capsys.readouterr().err

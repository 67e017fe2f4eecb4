"""Results come back into the original data, and what can't be written is refused by name beforehand."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon import parameters
from edgegrad_addon.export.geometry.mesh import positions
from edgegrad_addon.look.derivative import _motion
from edgegrad_addon.problem import Problem
from edgegrad_addon.write_back.vertices import check_vertices
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()
    bs.camera()
    bs.light("POINT", "Bulb")


def cube(**settings: Any) -> Any:
    return bs.add("Cube", bs.cube("Cube", bs.material("Clay")), (1, 2, 3), (0.3, 0.4, 0.5), (1, -2, 0.5), **settings)


def check(ob: Any, in_place: Any = False) -> None:
    check_vertices(ob, bpy.context.scene, in_place)


def world_vertices() -> Any:
    return bs.export().scene.meshes["Cube"].vertices


def move(in_place: Any, only: Any = slice(None)) -> Any:
    """Write a random move of the cube's vertices; returns the world positions that should come out."""
    export = bs.export()
    before = export.scene.meshes["Cube"].vertices
    after = before.copy()
    after[only] += np.random.default_rng(1).normal(0, 0.3, before.shape)[only]
    parameters.write(export, "meshes.Cube.vertices", before, after, in_place)
    bpy.context.view_layer.update()
    return after


def key_points(name: Any) -> Any:
    key = bpy.data.meshes["Cube"].shape_keys.key_blocks[name]
    out = np.empty((len(key.points), 3), np.float32)
    key.points.foreach_get("co", out.ravel())
    return out


def test_new_shape_key_leaves_the_old_shape_as_its_basis() -> None:
    ob = cube()
    old = positions(ob.data)
    expected = move(in_place=False)
    assert world_vertices() == pytest.approx(expected, abs=1e-6)
    assert [key.name for key in ob.data.shape_keys.key_blocks] == ["Basis", "Edgegrad"]
    assert np.array_equal(key_points("Basis"), old)
    ob.data.shape_keys.key_blocks["Edgegrad"].value = 0.0
    bpy.context.view_layer.update()
    assert np.array_equal(positions(ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data), old)


def test_in_place_moves_the_mesh_its_bounds_and_normals() -> None:
    ob = cube()
    expected = move(in_place=True)
    assert ob.data.shape_keys is None
    assert world_vertices() == pytest.approx(expected, abs=1e-6)
    assert np.array(ob.bound_box).min(axis=0) == pytest.approx(positions(ob.data).min(axis=0), abs=1e-6)
    fresh = bpy.data.meshes.new_from_object(ob)
    for got, want in zip(ob.data.polygons, fresh.polygons, strict=True):
        assert got.normal[:] == pytest.approx(want.normal[:], abs=1e-6)


def test_vertices_of_an_unevenly_scaled_mesh_with_a_normal_map_are_written_in_its_own_space() -> None:
    ob = cube()
    ob.data.uv_layers.new()
    ob.data.materials[0] = bs.normal_mapped(1.0)
    bpy.context.view_layer.update()
    mesh = bs.export().scene.meshes["Cube"]
    assert np.allclose(mesh.transform, ob.matrix_world)
    moved = _motion(mesh, "Y") @ mesh.transform[:3, :3].T
    assert np.allclose(moved, [0.0, 1.0, 0.0])
    expected = move(in_place=True)
    assert np.allclose(positions(ob.data), expected, atol=1e-6)
    assert np.allclose(bs.export().scene.meshes["Cube"].vertices, expected, atol=1e-6)


@pytest.mark.parametrize("in_place", [False, True])
def test_mesh_with_shape_keys(in_place: Any) -> None:
    ob = cube()
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Smile")
    key.points[3].co.x += 0.7
    key.value = 0.6
    difference = key_points("Smile") - key_points("Basis")
    bpy.context.view_layer.update()
    check(ob, in_place)
    expected = move(in_place)
    assert world_vertices() == pytest.approx(expected, abs=2e-6)
    assert key_points("Smile") - key_points("Basis") == pytest.approx(difference, abs=1e-6)
    assert key.value == pytest.approx(0.6)


def test_vertices_that_stay_keep_their_bits() -> None:
    ob = cube()
    old = positions(ob.data)
    move(in_place=True, only=slice(0, 3))
    assert np.array_equal(positions(ob.data)[3:], old[3:])
    assert not np.array_equal(positions(ob.data)[:3], old[:3])


@pytest.mark.parametrize(
    ("kind", "settings", "words"),
    [
        ("SUBSURF", {}, "changes the topology"),
        ("MIRROR", {}, "changes the topology"),
        ("DISPLACE", {"strength": 0.5}, "moves vertices"),
        ("WELD", {"merge_threshold": 5.0}, "changes the topology"),
    ],
)
def test_modifiers_are_refused_by_name(kind: Any, settings: Any, words: Any) -> None:
    ob = cube()
    ob.modifiers.new("Harmless", "SMOOTH").factor = 0.0
    modifier = ob.modifiers.new("Culprit", kind)
    for name, value in settings.items():
        setattr(modifier, name, value)
    bpy.context.view_layer.update()
    with pytest.raises(Problem) as caught:
        check(ob)
    assert "'Cube'" in str(caught.value) and "'Culprit'" in str(caught.value) and words in str(caught.value)
    assert all(one.show_render for one in ob.modifiers)
    modifier.show_render = False
    check(ob)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda ob: bs.add("Twin", ob.data), ["'Cube'", "'Twin'", "shared"]),
        (lambda ob: setattr(ob, "scale", (0, 1, 1)), ["'Cube'", "zero"]),
    ],
)
def test_objects_that_cannot_be_written_are_refused(spoil: Any, words: Any) -> None:
    ob = cube()
    spoil(ob)
    bpy.context.view_layer.update()
    with pytest.raises(Problem) as caught:
        check(ob)
    assert all(word in str(caught.value) for word in words)


def test_only_meshes_have_vertices_to_fit() -> None:
    ob = bs.add("Text", bpy.data.curves.new("Text", "FONT"))
    with pytest.raises(Problem, match=r"'Text'.*meshes"):
        check(ob)


def test_colors_and_emission_go_to_their_sockets() -> None:
    cube()
    clay = bpy.data.materials["Clay"]
    lamp = bs.material("Lamp", (1, 1, 1), "ShaderNodeEmission", Strength=4.0)
    bs.add("Lamp", bs.plane("Lamp", 1.0, lamp))
    export = bs.export()
    parameters.write(export, "materials.Clay.base_color", None, np.array([0.1, 0.2, 0.3]), False)
    parameters.write(export, "materials.Lamp.emission", None, np.array([8.0, 2.0, 0.0]), False)
    assert bs.shader(clay).inputs["Color"].default_value[:] == pytest.approx((0.1, 0.2, 0.3, 1.0))
    again = bs.export().scene.materials
    assert again["Lamp"].emission == pytest.approx([8, 2, 0])
    assert again["Clay"].base_color == pytest.approx([0.1, 0.2, 0.3])
    assert bs.shader(lamp).inputs["Strength"].default_value == 4.0


def test_power_goes_to_the_light() -> None:
    cube()
    light = bpy.data.lights["Bulb"]
    if bpy.app.version >= (4, 5, 0):
        light.exposure = 1.0
    export = bs.export()
    parameters.write(export, "lights.Bulb.power", None, 50.0, False)
    written: Any = bs.export().scene.lights["Bulb"]
    assert written.power == pytest.approx(50.0)


def test_fed_sockets_are_refused_by_name() -> None:
    cube()
    tree = bpy.data.materials["Clay"].node_tree
    node = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(node.outputs[0], bs.shader(bpy.data.materials["Clay"]).inputs["Color"])
    with pytest.raises(Problem, match=r"'Clay'.*'Noise Texture'"):
        parameters.Names(base_color=("Clay",)).paths(bs.export())


def test_unknown_names_are_told_what_there_is() -> None:
    cube()
    export = bs.export()
    with pytest.raises(Problem, match=r"'Marble'.*'Clay'"):
        parameters.Names(base_color=("Marble",)).paths(export)
    with pytest.raises(Problem, match=r"'Lamp'.*'Bulb'"):
        parameters.Names(power=("Lamp",)).paths(export)
    with pytest.raises(Problem, match="no parameter"):
        parameters.Names().paths(export)

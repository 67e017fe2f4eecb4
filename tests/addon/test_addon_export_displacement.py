"""Export of true displacement: vertices move as in Cycles."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad.scene.placement import expanded
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from tests.support.scenes import blender_scenes as bs

pytestmark = pytest.mark.usefixtures("lit_scene")


def displaced(node: str = "ShaderNodeDisplacement", method: str = "DISPLACEMENT", **settings: Any) -> Any:
    """A material whose displacement is one node; returns the material and this node."""
    made = bs.material("Moved")
    made.displacement_method = method
    tree = made.node_tree
    move = tree.nodes.new(node)
    move.inputs["Scale"].default_value = 1.0
    for key, value in settings.items():
        setattr(move, key, value)
    tree.links.new(move.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    return made, move


def body(*materials: Any, scale: Any = (1, 1, 1), rotation: Any = (0, 0, 0)) -> Any:
    return bs.add("Body", bs.cube("Body", *materials), rotation=rotation, scale=scale)


def vertices(scale: Any = (1, 1, 1)) -> NDArray[np.float64]:
    points = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return np.array(points, np.float64) * scale


def test_height_times_scale_along_the_smooth_normal() -> None:
    made, move = displaced()
    move.inputs["Height"].default_value, move.inputs["Midlevel"].default_value = 0.9, 0.4
    move.inputs["Scale"].default_value = 0.3
    ob = body(made)
    ob.data.shade_smooth()
    export = bs.export()
    export.scene.validate()
    found = export.scene.meshes["Body"].vertices
    assert np.allclose(found, vertices() * (1.0 + 0.15 / np.sqrt(3.0)), atol=1e-5)
    assert not export.report.lines


@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
def test_spaces_under_uneven_scale(space: str) -> None:
    made, move = displaced(space=space)
    move.inputs["Height"].default_value, move.inputs["Scale"].default_value = 1.0, 0.2
    move.inputs["Midlevel"].default_value = 0.0
    scale = np.array([1.0, 2.0, 0.5])
    body(made, scale=scale).data.shade_smooth()
    upright = vertices() / scale  # the normal, in world space
    upright /= np.linalg.norm(upright, axis=1, keepdims=True)
    expected = vertices(scale) + 0.2 * upright
    if space == "OBJECT":
        own = upright * scale
        expected = vertices(scale) + 0.2 * own / np.linalg.norm(own, axis=1, keepdims=True) * scale
    found = expanded(bs.export().scene.meshes["Body"]).vertices
    assert np.allclose(found, expected, atol=1e-5)


def test_heights_are_read_at_the_vertices() -> None:
    made, move = displaced()
    where = made.node_tree.nodes.new("ShaderNodeTexCoord")
    apart = made.node_tree.nodes.new("ShaderNodeSeparateXYZ")
    made.node_tree.links.new(where.outputs["Object"], apart.inputs[0])
    made.node_tree.links.new(apart.outputs[0], move.inputs["Height"])
    move.inputs["Midlevel"].default_value = 0.0
    body(made).data.shade_smooth()
    mesh = bs.export().scene.meshes["Body"]
    expected = vertices() * (1.0 + vertices()[:, :1] / np.sqrt(3.0))
    assert np.allclose(mesh.vertices, expected, atol=1e-5)
    assert not mesh.attributes  # only the displacement needed coordinates


@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
def test_vectors(space: str) -> None:
    made, move = displaced("ShaderNodeVectorDisplacement", space=space)
    move.inputs["Vector"].default_value = (0.3, 0.1, 0.2, 1.0)
    move.inputs["Midlevel"].default_value, move.inputs["Scale"].default_value = 0.1, 2.0
    ob = body(made, scale=(1, 2, 1), rotation=(0, 0, 0.5 * np.pi))
    bpy.context.view_layer.update()
    matrix = np.array(ob.matrix_world, np.float64)[:3, :3]
    offset = np.array([0.4, 0.0, 0.2])
    expected = vertices() @ matrix.T + (matrix @ offset if space == "OBJECT" else offset)
    assert np.allclose(bs.export().scene.meshes["Body"].vertices, expected, atol=1e-5)


def test_other_materials_stay_and_keep_their_normals() -> None:
    made, move = displaced()
    move.inputs["Height"].default_value = 1.0
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(3)]
    mesh = bs.mesh("Body", [(x, y, 0) for x in range(4) for y in range(2)], faces, made, bs.material("Still"))
    mesh.polygons.foreach_set("material_index", [0, 1, 1])
    mesh.shade_smooth()
    bs.add("Body", mesh)
    found = bs.export().scene.meshes["Body"]
    assert np.allclose(found.vertices[:, 2], [0.5] * 4 + [0.0] * 4)
    normal = found.normals[found.smoothing]
    assert np.allclose(normal[found.face_material == 1][1:, :, :], (0, 0, 1))


def test_smooth_faces_that_displacement_turns_over_are_named() -> None:
    """A strip whose second half stays: its vertices at the border move beyond its far end, which turns it over."""
    made, move = displaced("ShaderNodeVectorDisplacement")
    move.inputs["Vector"].default_value, move.inputs["Midlevel"].default_value = (3.0, 0.0, 0.0, 1.0), 0.0
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(2)]
    mesh = bs.mesh("Body", [(x, y, 0) for x in range(3) for y in range(2)], faces, made, bs.material("Still"))
    mesh.polygons[1].material_index = 1
    mesh.shade_smooth()
    ob = bs.add("Body", mesh)
    bs.offset_shadow_rays(ob, 0.1)
    assert any("turns by more than a right angle" in line for line in bs.export().report.lines)
    bs.offset_shadow_rays(ob, 0.0)
    assert not any("right angle" in line for line in bs.export().report.lines)
    bs.offset_shadow_rays(ob, 0.1)
    move.inputs["Vector"].default_value = (0.3, 0.0, 0.0, 1.0)
    assert not any("right angle" in line for line in bs.export().report.lines)


def test_instances_move_once() -> None:
    made, move = displaced()
    move.inputs["Height"].default_value = 1.0
    mesh = bs.cube("Body", made)
    mesh.shade_smooth()
    for k in range(2):
        bs.add(f"Body {k}", mesh, (3.0 * k, 0, 0))
    (found,) = bs.export().scene.meshes.values()
    assert len(found.instances) == 2
    assert np.allclose(np.abs(found.vertices), 1.0 + 0.5 / np.sqrt(3.0), atol=1e-5)


def test_bump_alone_moves_nothing() -> None:
    made, move = displaced(method="BUMP")
    move.inputs["Height"].default_value = 1.0
    body(made)
    assert np.allclose(bs.export().scene.meshes["Body"].vertices, vertices())


def test_displacement_and_bump_keeps_the_normals() -> None:
    made, move = displaced(method="BOTH")
    where = made.node_tree.nodes.new("ShaderNodeTexCoord")
    apart = made.node_tree.nodes.new("ShaderNodeSeparateXYZ")
    made.node_tree.links.new(where.outputs["Object"], apart.inputs[0])
    made.node_tree.links.new(apart.outputs[0], move.inputs["Height"])
    mesh = bs.mesh("Body", [(x, y, 0) for x in range(4) for y in range(2)],
                   [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(3)], made)  # fmt: skip
    mesh.shade_smooth()
    bs.add("Body", mesh)
    found = bs.export().scene.meshes["Body"]
    assert np.allclose(found.vertices[:, 2], found.vertices[:, 0] - 0.5)
    assert np.allclose(found.normals[found.smoothing], (0, 0, 1))  # the bump bends them


def test_what_cannot_be_read_is_named() -> None:
    made, move = displaced()
    script = made.node_tree.nodes.new("ShaderNodeAmbientOcclusion")
    made.node_tree.links.new(script.outputs["AO"], move.inputs["Height"])
    body(made)
    export = bs.export()
    assert np.allclose(export.scene.meshes["Body"].vertices, vertices())
    assert any("its displacement is left out, since node 'Ambient Occlusion'" in line for line in export.report.lines)


def test_lamps_behind_open_surfaces_with_displacement_as_bump_are_named() -> None:
    made, move = displaced()
    waves = made.node_tree.nodes.new("ShaderNodeTexWave")
    made.node_tree.links.new(waves.outputs["Fac"], move.inputs["Height"])
    made.displacement_method = "BUMP"
    bs.camera((0.0, 0.0, 5.0))
    bs.add("Sheet", bs.plane("Sheet", 2.0, made))
    lamp = bs.light("POINT", "Lamp", (0.0, 3.0, 2.0))

    def named() -> bool:
        return any("lamps behind it ('Lamp') light it through" in line for line in bs.export().report.lines)

    assert not named()
    lamp.location.z = -2.0
    assert named()
    made.displacement_method = "BOTH"
    assert not named()


def test_displaced_vertices_are_not_fitted() -> None:
    body(displaced()[0])
    with pytest.raises(Problem, match="its material displaces its vertices"):
        Names(vertices=("Body",)).paths(bs.export())


def test_adaptive_subdivision_is_named() -> None:
    ob = body(displaced()[0])
    modifier = ob.modifiers.new("Subdivision", "SUBSURF")
    if not hasattr(modifier, "use_adaptive_subdivision"):
        pytest.skip("this version of Blender has it as an experimental setting of objects")
    modifier.use_adaptive_subdivision = True
    assert any("is subdivided adaptively by Cycles" in line for line in bs.export().report.lines)

"""Values of islands, of points and of attributes with names of Cycles' own, beside Cycles."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad_addon.export.geometry.islands import representatives
from tests.support.scenes import blender_scenes as bs

PIXELS = 16


def glowing(kind: str, output: str, **settings: Any) -> Any:
    """A material that glows with an output of a node."""
    made = bs.material(f"{kind} {settings}", (1.0, 1.0, 1.0), "ShaderNodeEmission")
    tree = made.node_tree
    node = tree.nodes.new(kind)
    for key, value in settings.items():
        setattr(node, key, value)
    tree.links.new(node.outputs[output], bs.shader(made).inputs["Color"])
    return made


def scene() -> None:
    made = bs.empty(PIXELS)
    camera = bs.camera()
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
    made.cycles.samples, made.cycles.use_adaptive_sampling, made.cycles.use_denoising = 64, False, False


def both(folder: Path) -> tuple[Any, Any, list[str]]:
    """Mean colours of 4 x 4 pixels by Edgegrad and by Cycles, and the lines of the export's report."""
    made = bs.export()
    ours = edgegrad.Renderer(made.scene).render(spp=64, seed=1, max_depth=1)
    means = (one[..., :3].reshape(4, 4, 4, 4, 3).mean(axis=(1, 3)) for one in (ours, bs.cycles(folder)))
    return *means, made.report.lines


def squares(name: str, made: Any) -> Any:
    """4 x 4 squares with space between them, in one mesh, some of which share a corner's place or an edge."""
    points, faces = [], []
    for x in range(4):
        for y in range(4):
            low, k = (x - 2.0, y - 2.0), len(points)
            points += [(low[0] + a, low[1] + b, 0.0) for a, b in ((0, 0), (0.9, 0), (0.9, 0.9), (0, 0.9))]
            faces.append(tuple(range(k, k + 4)))
    faces += [(1, 16, 19, 2), (17, 32, 35, 18)]  # joins three of them
    return bs.mesh(name, points, faces, made)


def test_random_numbers_of_islands(tmp_path: Path) -> None:
    scene()
    bs.add("Squares", squares("Squares", glowing("ShaderNodeNewGeometry", "Random Per Island")))
    ours, theirs, lines = both(tmp_path)
    np.testing.assert_allclose(ours, theirs, atol=0.02)
    assert theirs.std() > 0.1 and not lines
    assert not bs.export().scene.images  # texels of a bake would not suffice for many islands


def test_islands_are_joined_by_rank() -> None:
    found = representatives(np.array([(0, 1), (2, 3), (3, 1), (4, 5), (5, 0)], np.int32), 7)
    assert found.tolist() == [2, 2, 2, 2, 2, 2, 6]


@pytest.mark.parametrize("name", ["color", "density", "uv", "generated", "pointiness", "random_per_island", "Color"])
@pytest.mark.parametrize("kind", ["ShaderNodeAttribute", "ShaderNodeVertexColor"])
def test_names_of_attributes(kind: str, name: str, tmp_path: Path) -> None:
    scene()
    key = "attribute_name" if kind == "ShaderNodeAttribute" else "layer_name"
    bs.world((0.1, 0.1, 0.1))
    mesh = bs.plane("Plane", 4.0, glowing(kind, "Color", **{key: name}))
    layer = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.tile(np.float32([0.7, 0.2, 0.4, 1.0]), len(mesh.vertices)))
    bs.add("Plane", mesh)
    ours, theirs, _ = both(tmp_path)
    np.testing.assert_allclose(ours, theirs, atol=0.02)


@pytest.mark.parametrize("output", ["Generated", "Normal"])
def test_coordinates_of_points(output: str, tmp_path: Path) -> None:
    scene()
    bs.world((0.1, 0.1, 0.1))
    material = glowing("ShaderNodeTexCoord", output)
    group = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    points, given = group.nodes.new("GeometryNodePoints"), group.nodes.new("GeometryNodeSetMaterial")
    points.inputs["Count"].default_value, points.inputs["Radius"].default_value = 1, 1.8
    given.inputs["Material"].default_value = material
    group.links.new(points.outputs[0], given.inputs[0])
    group.links.new(given.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    bs.add("Point", bs.cube("Cube"), rotation=(0.9, 0.4, 0.2)).modifiers.new("Points", "NODES").node_group = group
    ours, theirs, _ = both(tmp_path)
    np.testing.assert_allclose(ours, theirs, atol=0.04)

"""The alpha of attributes, which is 1 where a layer has none or does not exist, and of images, beside Cycles."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.benchmarks.cycles_scenes import stage
from tests.support.scenes import blender_scenes as bs


@pytest.mark.parametrize(("kind", "alpha"), [(None, 1.0), ("FLOAT_VECTOR", 1.0), ("FLOAT_COLOR", 0.25)])
def test_alpha_of_attributes(kind: str | None, alpha: float, tmp_path: Path) -> None:
    scene = bs.empty(16)
    scene.cycles.samples = 4
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    made = bs.material("M", node="ShaderNodeEmission")
    mesh = bs.plane("Plane", 4.0, made)
    if kind is not None:
        layer = mesh.attributes.new("tone", kind, "POINT")
        name, value = ("color", (0.1, 0.2, 0.3, 0.25)) if kind == "FLOAT_COLOR" else ("vector", (0.1, 0.2, 0.3))
        layer.data.foreach_set(name, np.tile(np.float32(value), len(layer.data)))
    bs.add("Plane", mesh)
    read = made.node_tree.nodes.new("ShaderNodeAttribute")
    read.attribute_name = "tone"
    made.node_tree.links.new(read.outputs["Alpha"], bs.shader(made).inputs["Color"])
    export = bs.export()
    ours = edgegrad.Renderer(export.scene).render(spp=4, max_depth=1)
    assert np.allclose(ours, alpha, atol=1e-4)
    assert np.allclose(bs.cycles(tmp_path)[..., :3], alpha, atol=1e-3)
    assert not export.report.lines


@pytest.mark.parametrize(("node", "field", "alpha"), [("ShaderNodeAttribute", "attribute_name", 1.0),
                                                       ("ShaderNodeVertexColor", "layer_name", 0.0)])  # fmt: skip
def test_alpha_where_cycles_keeps_the_name(node: str, field: str, alpha: float, tmp_path: Path) -> None:
    """A layer named "color" is hidden: an Attribute node has the alpha 1 there, a Color Attribute node 0."""
    scene = bs.empty(16)
    scene.cycles.samples = 4
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    made = bs.material("M", node="ShaderNodeEmission")
    mesh = bs.plane("Plane", 4.0, made)
    layer = mesh.color_attributes.new("color", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.full(4 * len(layer.data), 0.25, np.float32))
    bs.add("Plane", mesh)
    read = made.node_tree.nodes.new(node)
    setattr(read, field, "color")
    stage.lamp("POINT", "Lamp", 1.0, (0.0, 0.0, 9.0))
    made.node_tree.links.new(read.outputs["Alpha"], bs.shader(made).inputs["Color"])
    export = bs.export()
    ours = edgegrad.Renderer(export.scene).render(spp=4, max_depth=1)
    assert np.allclose(ours, alpha, atol=1e-4)
    assert np.allclose(bs.cycles(tmp_path)[..., :3], alpha, atol=1e-3)
    assert any("rename the attribute" in line for line in export.report.lines)


@pytest.mark.parametrize(("value", "output", "read"), [(True, "Color", 1.0), (True, "Alpha", 1.0), (0.3, "Alpha", 1.0),
                                                       ((0.2, 0.6, 0.1, 0.4), "Alpha", 0.4), ((True, True), "Fac", 0.0),
                                                       (None, "Alpha", 0.0)])  # fmt: skip
def test_properties_of_objects(value: object, output: str, read: float, tmp_path: Path) -> None:
    scene = bs.empty(16)
    scene.cycles.samples = 4
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    stage.lamp("POINT", "Lamp", 1.0, (0.0, 0.0, 9.0))
    made = bs.material("M", node="ShaderNodeEmission")
    plane = bs.add("Plane", bs.plane("Plane", 4.0, made))
    if value is not None:
        plane["tone"] = value
    node = made.node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "OBJECT", "tone"
    made.node_tree.links.new(node.outputs[output], bs.shader(made).inputs["Color"])
    ours = edgegrad.Renderer(bs.export().scene).render(spp=4, max_depth=1)
    assert np.allclose(ours, read, atol=1e-4)
    assert np.allclose(bs.cycles(tmp_path)[..., :3], read, atol=1e-3)


@pytest.mark.parametrize("interpolation", ["Closest", "Linear"])
def test_colors_of_images_are_multiplied_by_alpha_as_code_values(interpolation: str, tmp_path: Path) -> None:
    scene = bs.empty(16)
    scene.cycles.samples = 4
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    made = bs.material("M", node="ShaderNodeEmission")
    bs.add("Plane", bs.plane("Plane", 4.0, made))
    read = made.node_tree.nodes.new("ShaderNodeTexImage")
    read.image = stage.image("Leaf", np.tile(np.float32((0.8, 0.4, 0.9, 0.5)), (4, 4, 1)))
    read.interpolation = interpolation
    made.node_tree.links.new(read.outputs["Color"], bs.shader(made).inputs["Color"])
    ours = edgegrad.Renderer(bs.export().scene).render(spp=4, max_depth=1)
    assert np.allclose(ours, bs.cycles(tmp_path)[..., :3], rtol=0.05)

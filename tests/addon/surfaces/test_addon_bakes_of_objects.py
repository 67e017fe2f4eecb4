"""Bakes have what the rendered object has: its values, those of the view layer, and no UV map if it has none."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.geometry.hashes import WORD, name_hash
from tests.support.scenes import blender_scenes as bs


def texture(vector: Callable[[Any], Any], name: str = "Baked") -> Any:
    """A material that glows with a texture which only Cycles evaluates, at what `vector` makes in its tree."""
    made = bs.material(name, (1.0, 1.0, 1.0), "ShaderNodeEmission")
    tree = made.node_tree
    node = tree.nodes.new("ShaderNodeTexGabor")
    node.inputs["Scale"].default_value = 1.0
    tree.links.new(vector(tree), node.inputs["Vector"])
    tree.links.new(node.outputs["Value"], bs.shader(made).inputs["Color"])
    return made


def number(value: float) -> Callable[[Any], Any]:
    def made(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeValue")
        node.outputs[0].default_value = value
        return node.outputs[0]

    return made


def output(kind: str, name: str, **settings: Any) -> Callable[[Any], Any]:
    def made(tree: Any) -> Any:
        node = tree.nodes.new(kind)
        for key, value in settings.items():
            setattr(node, key, value)
        return node.outputs[name]

    return made


def baked(*objects: tuple[str, Any, Callable[[Any], Any]]) -> dict[str, Any]:
    """The means of the baked images of objects (name, mesh, vector), by their objects' names."""
    for k, (name, mesh, vector) in enumerate(objects):
        mesh.materials.append(texture(vector, f"Baked {name}"))
        bs.add(name, mesh, (3.0 * k, 0.0, 0.0))
    images = bs.export().scene.images
    return {name: next(one.pixels for key, one in images.items() if key.endswith(f" on {name}")).mean(axis=(0, 1))
            for name, _, _ in objects}  # fmt: skip


def scene() -> None:
    bs.empty()
    bs.camera()
    bs.light("SUN")


def test_random_numbers() -> None:
    scene()
    value = name_hash("Own") / WORD
    random = output("ShaderNodeObjectInfo", "Random")
    found = baked(("Own", bs.cube("a"), random), ("Same", bs.cube("b"), number(value)),
                  ("Other", bs.cube("c"), random))  # fmt: skip
    np.testing.assert_allclose(found["Own"], found["Same"], rtol=1e-4)
    assert abs(found["Other"] - found["Own"]).max() > 1e-3


def test_objects_with_one_mesh_have_their_own_bakes() -> None:
    scene()
    mesh = bs.cube("Cube", texture(output("ShaderNodeObjectInfo", "Random")))
    for k, name in enumerate(("One", "Two")):
        bs.add(name, mesh, (3.0 * k, 0.0, 0.0))
    images = [one.pixels.mean() for one in bs.export().scene.images.values()]
    assert len(images) == 2 and abs(images[0] - images[1]) > 1e-3


def test_properties_and_the_view_layer() -> None:
    scene()
    bpy.context.scene["age"] = 0.61
    of_object = output("ShaderNodeAttribute", "Vector", attribute_type="OBJECT", attribute_name="age")
    of_layer = output("ShaderNodeAttribute", "Vector", attribute_type="VIEW_LAYER", attribute_name="age")
    mesh = bs.cube("a")
    mesh["age"] = 0.27
    found = baked(("Object", mesh, of_object), ("Same", bs.cube("b"), number(0.27)), ("Layer", bs.cube("c"), of_layer),
                  ("Equal", bs.cube("d"), number(0.61)), ("None", bs.cube("e"), of_object),
                  ("Zero", bs.cube("f"), number(0.0)))  # fmt: skip
    for own, same in (("Object", "Same"), ("Layer", "Equal"), ("None", "Zero")):
        np.testing.assert_allclose(found[own], found[same], rtol=1e-4)
    assert len({round(float(one[0]), 3) for one in found.values()}) == 3


@pytest.mark.parametrize("grouped", [False, True])
def test_within_groups(grouped: bool) -> None:
    scene()

    def within(tree: Any) -> Any:
        group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketFloat")
        end = group.nodes.new("NodeGroupOutput")
        group.links.new(output("ShaderNodeObjectInfo", "Random")(group), end.inputs[0])
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        return node.outputs[0]

    random = within if grouped else output("ShaderNodeObjectInfo", "Random")
    found = baked(("Own", bs.cube("a"), random), ("Same", bs.cube("b"), number(name_hash("Own") / WORD)))
    np.testing.assert_allclose(found["Own"], found["Same"], rtol=1e-4)
    assert len(bpy.data.node_groups) == int(grouped)


def test_a_mesh_without_uv_map_has_none_in_its_bake() -> None:
    scene()
    bare = bs.cube("a")
    while bare.uv_layers:
        bare.uv_layers.remove(bare.uv_layers[0])
    found = baked(("Bare", bare, output("ShaderNodeTexCoord", "UV")), ("Zero", bs.cube("b"), number(0.0)))
    np.testing.assert_allclose(found["Bare"], found["Zero"], rtol=1e-4)


def test_coordinates_of_the_window_are_named() -> None:
    scene()
    mesh = bs.cube("a", texture(output("ShaderNodeTexCoord", "Window")))
    bs.add("Cube", mesh)
    assert any("'Window'" in line for line in bs.export().report.lines)

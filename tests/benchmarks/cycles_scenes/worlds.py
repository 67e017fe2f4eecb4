"""Worlds that kinds of rays see differently, worlds that a view layer leaves out or replaces, and their visibility."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case


def _yard() -> Any:
    """A matt, a plastic and a metal ball on a disk under the open sky; returns the world's node tree."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    stage.add("Floor", stage.cylinder("Floor", stage.diffuse("Floor", (0.5, 0.5, 0.5)), radius=3.0, depth=0.2),
              (0, 0, -0.1))  # fmt: skip
    stage.row([stage.diffuse("Chalk"), stage.principled("Plastic", (0.2, 0.4, 0.7), Roughness=0.3),
               stage.principled("Metal", (0.9, 0.8, 0.6), Metallic=1.0, Roughness=0.1)], segments=48)  # fmt: skip
    stage.camera((0, -6, 1.6), (0, 0, 0.6), 38.0)
    return stage.world((0.3, 0.45, 0.7))


def _image() -> Any:
    """A sky whose upper half is brighter to one side."""
    height, width = 32, 64
    y, x = np.mgrid[0:height, 0:width] + 0.5
    longitude, latitude = (x / width - 0.5) * 2.0 * np.pi, (0.5 - y / height) * np.pi
    out = np.stack([0.4 + 0.3 * np.sin(longitude), 0.5 + 0.1 * np.cos(longitude), 0.6 + 0.3 * np.sin(latitude)], -1)
    out[latitude < 0] *= 0.3
    return stage.image("Sky", out.astype(np.float32), "Linear Rec.709", is_float=True)


def _environment(tree: Any) -> Any:
    return stage.node(tree, "ShaderNodeTexEnvironment", image=_image()).outputs["Color"]


def _mix(tree: Any, output: str, others: Any, seen: Any) -> None:
    """Link a Mix Shader of two Background nodes by an output of Light Path to the world's output."""
    path = stage.node(tree, "ShaderNodeLightPath").outputs[output]
    mixed = stage.node(tree, "ShaderNodeMixShader", {0: path, 1: others, 2: seen})
    tree.links.new(mixed.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])


def _background(tree: Any, color: Any, strength: float = 1.0) -> Any:
    return stage.node(tree, "ShaderNodeBackground", {"Color": color, "Strength": strength})


@case("An image lights the scene; the camera sees a grey backdrop (Is Camera Ray)")
def camera_backdrop() -> None:
    """What tutorials do to hide an environment image."""
    tree = _yard()
    _mix(tree, "Is Camera Ray", _background(tree, _environment(tree), 1.5), _background(tree, (0.6, 0.6, 0.6)))


@case("The camera sees an image; a constant sky lights the scene (Is Camera Ray)")
def camera_image() -> None:
    """The reverse."""
    tree = _yard()
    _mix(tree, "Is Camera Ray", _background(tree, (0.5, 0.6, 0.7)), _background(tree, _environment(tree), 1.2))


@case("Strength and colour of a world by arithmetic with Is Camera Ray")
def camera_arithmetic() -> None:
    """Bright for the camera, dim and reddish for surfaces."""
    tree = _yard()
    path = stage.node(tree, "ShaderNodeLightPath").outputs["Is Camera Ray"]
    strength = stage.node(tree, "ShaderNodeMath", {0: path, 1: 2.0, 2: 0.5}, operation="MULTIPLY_ADD")
    color = stage.node(tree, "ShaderNodeMixRGB", {
        "Fac": path, "Color1": (1.0, 0.6, 0.4), "Color2": (0.2, 0.5, 1.0)})  # fmt: skip
    background = tree.nodes["Background"]
    tree.links.new(strength.outputs[0], background.inputs["Strength"])
    tree.links.new(color.outputs[0], background.inputs["Color"])


@case("A gradient of nodes lights the scene, the camera sees black; Light Path within a node group")
def backdrop_in_group() -> None:
    """The world is baked as surfaces see it."""
    tree = _yard()
    group = bpy.data.node_groups.new("For the camera", "ShaderNodeTree")
    group.interface.new_socket("Factor", in_out="OUTPUT", socket_type="NodeSocketFloat")
    inner = group.nodes.new("ShaderNodeLightPath")
    group.links.new(inner.outputs["Is Camera Ray"], group.nodes.new("NodeGroupOutput").inputs[0])
    holder = tree.nodes.new("ShaderNodeGroup")
    holder.node_tree = group
    coordinates = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
    turned = stage.node(tree, "ShaderNodeMapping", {"Vector": coordinates, "Location": (1.0, 0.3, 0.0)})
    gradient = stage.node(tree, "ShaderNodeTexGradient", {"Vector": turned})
    mixed = stage.node(tree, "ShaderNodeMixShader", {
        0: holder.outputs[0], 1: _background(tree, gradient), 2: _background(tree, (0, 0, 0))})  # fmt: skip
    tree.links.new(mixed.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])


@case("Two images: one for the camera, one for light")
def two_images() -> None:
    """The camera's is the same, turned."""
    tree = _yard()
    coordinates = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
    turned = stage.node(tree, "ShaderNodeMapping", {"Vector": coordinates, "Rotation": (0.0, 0.0, 2.0)})
    other = stage.node(tree, "ShaderNodeTexEnvironment", {"Vector": turned}, image=_image())
    _mix(tree, "Is Camera Ray", _background(tree, _environment(tree)), _background(tree, other))


@case("A constant world that glossy rays see brighter (Is Glossy Ray)")
def glossy_backdrop() -> None:
    """Reflections of a world that is brighter than its light."""
    tree = _yard()
    _mix(tree, "Is Glossy Ray", _background(tree, (0.3, 0.4, 0.5)), _background(tree, (1.0, 0.9, 0.8), 1.5))


@case("A world that neither the camera nor glossy rays see (ray visibility)")
def unseen_world() -> None:
    """It lights rough surfaces."""
    _yard()
    flags = bpy.context.scene.world.cycles_visibility
    flags.camera = flags.glossy = False


@case("A view layer without its world (Environment filter off)", samples=192)
def layer_without_sky() -> None:
    """A lamp is all the light."""
    _yard()
    stage.lamp("AREA", "Key", 150.0, (-2.0, -3.0, 4.0), (0, 0, 0.5), size=1.0)
    bpy.context.view_layer.use_sky = False


@case("A view layer with another world (World Override)")
def layer_world() -> None:
    """The scene's own world is blue, the layer's is warm."""
    _yard()
    if hasattr(bpy.context.view_layer, "world_override"):  # from Blender 5.0 on
        own = bpy.context.scene.world
        stage.world((1.0, 0.8, 0.6), 0.8)
        bpy.context.view_layer.world_override, bpy.context.scene.world = bpy.context.scene.world, own

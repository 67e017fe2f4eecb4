"""Data that nobody meant to make, as old and much edited files have it; none of it may stop a picture."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


@case("Objects of all types, without data, of zero scale, with loose parts, and names with quotes", bounces=2)
def odd_objects() -> None:
    """Most of them are not rendered."""
    stage.studio(width=6.0)
    paint = stage.principled("Paint 'red' \"1\" / ü", (0.7, 0.1, 0.1))
    stage.row([paint, stage.principled("B" * 60, (0.1, 0.6, 0.2))], gap=1.6)
    for name, data in (("Armature", bpy.data.armatures.new("A")), ("Lattice", bpy.data.lattices.new("L")),
                       ("Speaker", bpy.data.speakers.new("S")), ("Empty", None),
                       ("Probe", bpy.data.lightprobes.new("P", "SPHERE")), ("Curve", bpy.data.curves.new("C", "CURVE")),
                       ("Text", bpy.data.curves.new("T", "FONT")), ("Surface", bpy.data.curves.new("U", "SURFACE")),
                       ("Ball", bpy.data.metaballs.new("M"))):  # fmt: skip
        stage.add(name, data, (0, 1, 0.5))
    stage.add("Flat", stage.plane("Flat", paint, size=1.0), (2.0, 0.5, 0.8), scale=(1.0, 1.0, 0.0))
    stage.add("Nothing", stage.cube("Nothing", paint), (2.0, 0.5, 0.8), scale=(0.0, 0.0, 0.0))
    stage.add("Line", stage.cube("Line", paint), (-2.0, 0.5, 0.8), scale=(0.0, 0.0, 0.7))
    stage.add("Image", None, (0, 2, 0.5)).empty_display_type = "IMAGE"
    loose = stage.mesh("Loose", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 1, 2)], paint)
    loose.edges.add(1)
    loose.edges[-1].vertices = (0, 3)
    stage.add("Loose", loose, (-2.5, -0.6, 0.3))
    faulty = stage.mesh("Faulty", [(0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)],
                        [(0, 1, 2), (0, 1, 4), (0, 1, 3)], paint)  # fmt: skip
    stage.add("Faulty", faulty, (1.6, -1.0, 0.3))
    many = stage.sphere("Many maps", paint, radius=0.4)
    for k in range(7):
        many.uv_layers.new(name=f"Map {k}")
    many.materials.append(None)
    for face in many.polygons:
        face.material_index = face.index % 5
    stage.add("Many maps", many, (0.0, -1.3, 0.4))


@case("A cube whose scale is zero along an axis: its faces lie on each other", bounces=2)
def flattened() -> None:
    """Scaled to zero by accident, or to hide it."""
    stage.studio(width=5.0)
    stage.add("Flat", stage.cube("Flat", stage.principled("Paint", (0.7, 0.1, 0.1))), (0.0, 0.5, 0.8),
              scale=(0.8, 0.8, 0.0))  # fmt: skip


@case("Node trees with holes: missing groups, unknown nodes, groups without outputs, no links", bounces=2)
def odd_nodes() -> None:
    """As versions, add-ons and lost libraries leave them."""
    stage.studio(width=5.0)

    def made(name: str, build: Any) -> Any:
        one = bpy.data.materials.new(name)
        if one.node_tree is None:
            one.use_nodes = True
        build(one.node_tree, next(node for node in one.node_tree.nodes if node.type == "BSDF_PRINCIPLED"))
        return one

    def lost_group(tree: Any, shader: Any) -> None:
        group = tree.nodes.new("ShaderNodeGroup")
        inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
        inner.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
        group.node_tree = inner
        tree.links.new(group.outputs[0], shader.inputs["Base Color"])

    def no_tree(tree: Any, shader: Any) -> None:
        tree.nodes.new("ShaderNodeGroup")
        tree.nodes.new("NodeFrame")
        tree.nodes.new("NodeReroute")

    def reroute(tree: Any, shader: Any) -> None:
        tree.links.new(tree.nodes.new("NodeReroute").outputs[0], shader.inputs["Roughness"])
        shader.inputs["Roughness"].default_value = 0.1

    def extremes(tree: Any, shader: Any) -> None:
        shader.inputs["Base Color"].default_value = (2.0, -1.0, 0.3, 1.0)
        shader.inputs["IOR"].default_value = 0.0
        shader.inputs["Emission Strength"].default_value = -1.0

    stage.row([made(one.__name__, one) for one in (lost_group, no_tree, reroute, extremes)])


@case("Cameras and render settings at their limits: clip end before clip start, tiny lens, empty region", bounces=1)
def odd_camera() -> None:
    """Values that the interface allows."""
    stage.studio(width=5.0)
    stage.row([stage.principled("Red", (0.7, 0.1, 0.1))])
    scene = bpy.context.scene
    lens = scene.camera.data
    lens.dof.use_dof, lens.dof.aperture_fstop, lens.dof.focus_distance = True, 8.0, 0.0
    scene.camera.scale = (2.0, -1.0, 0.5)
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.0, 1.0
    lens.clip_start, lens.clip_end = 1e-6, 1e9


@case("Lamps at their limits: no power, no size, no nodes' output, huge, black, below the floor", bounces=2)
def odd_lamps() -> None:
    """None of them may spoil the others."""
    stage.studio(width=5.0)
    stage.row([stage.principled("Red", (0.7, 0.1, 0.1)), stage.principled("Grey")])
    stage.lamp("POINT", "Off", 0.0, (0, 0, 3))
    stage.lamp("POINT", "Black", 100.0, (0, 0, 3), color=(0, 0, 0))
    stage.lamp("AREA", "Tiny", 5.0, (0.5, -0.5, 2), size=1e-4)
    stage.lamp("AREA", "Huge", 50.0, (0, 0, 40), size=200.0)
    stage.lamp("SPOT", "Wide", 30.0, (1.0, -1.0, 2.0), (1, 0, 0), spot_size=math.pi, spot_blend=1.0)
    stage.lamp("SPOT", "Narrow", 30.0, (-1.0, -1.0, 2.0), (-1, 0, 0), spot_size=0.02, spot_blend=0.0)
    stage.lamp("SUN", "Wide sun", 0.5, (0, 0, 5), (0.3, 0.2, 0), angle=math.pi)
    stage.lamp("POINT", "Below", 100.0, (0, 0, -1))
    lamp = stage.lamp("POINT", "Without output", 100.0, (0, 0, 2))
    if lamp.data.node_tree is None:
        lamp.data.use_nodes = True
    lamp.data.node_tree.nodes.clear()
    stage.lamp("AREA", "Flat", 100.0, (0, 0, 3)).scale = (1.0, 0.0, 1.0)


@case("Images of one texel, very wide ones, and colours below 0 and above 1", bounces=2)
def odd_images() -> None:
    """Textures of odd sizes and values."""
    stage.studio(width=5.0)
    one = stage.image("One", np.full((1, 1, 3), 0.4))
    wide = stage.image("Wide", np.random.default_rng(1).uniform(0, 1, (1, 300, 3)))
    bright = stage.image("Bright", np.random.default_rng(2).uniform(-1, 9, (8, 8, 3)), "Linear Rec.709", is_float=True)

    def shown(image: Any) -> Any:
        return stage.material(image.name, lambda tree: stage.node(tree, "ShaderNodeBsdfDiffuse", {
            "Color": stage.node(tree, "ShaderNodeTexImage", image=image)}))  # fmt: skip

    stage.row([shown(image) for image in (one, wide, bright)])

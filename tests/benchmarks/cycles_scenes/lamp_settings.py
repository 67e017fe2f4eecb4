"""Lights by nodes and their settings: falloff, temperature, sums of shaders, limits of bounces, negative light."""

from __future__ import annotations

import math
from typing import Any

import bpy

from . import stage
from .case import case


def _things() -> None:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.6, 0.6, 0.6)), size=8.0))
    stage.add("Wall", stage.plane("Wall", stage.diffuse("Wall", (0.6, 0.55, 0.5)), size=8.0), (0, 2.5, 0),
              (math.pi / 2, 0, 0))  # fmt: skip
    stage.row([stage.principled("Plastic", (0.2, 0.4, 0.7), Roughness=0.3), stage.diffuse("Chalk"),
               stage.principled("Metal", (0.9, 0.7, 0.4), Metallic=1.0, Roughness=0.3)],
              gap=1.7, segments=48)  # fmt: skip
    stage.camera((0, -6.5, 3.2), (0, 0.5, 0.7), 38.0)
    stage.lamp("AREA", "Fill", 40.0, (-2.0, -4.0, 4.0), (0, 0, 0.5), size=2.0)


def _nodes(ob: Any) -> tuple[Any, Any]:
    """Node tree of a lamp, and its Emission node."""
    data = ob.data
    if data.node_tree is None or bpy.app.version < (5, 1, 0):
        data.use_nodes = True
    return data.node_tree, next(node for node in data.node_tree.nodes if node.type == "EMISSION")


def _spot(**settings: Any) -> Any:
    return stage.lamp("SPOT", "Spot", 300.0, (1.5, -2.0, 3.5), (0.3, 0, 0.5), spot_size=1.0, shadow_soft_size=0.1,
                      **settings)  # fmt: skip


@case("A round area light and spots, sheared by the uneven scale of their parents",
      differs=("Cycles cuts off a part of the cones of sheared spots",))
def sheared_lamps() -> None:
    """Turned lamps that were parented to stretched objects."""
    _things()
    stage.lamp("AREA", "Disk", 120.0, (-1.5, -1.0, 3.0), (-0.5, 0.5, 0), shape="DISK", size=1.2)
    edge = stage.lamp("SPOT", "Edge", 300.0, (2.0, -1.5, 3.0), (0.6, 0, 0.3), spot_size=0.9, spot_blend=0.0)
    for ob, scale in ((bpy.data.objects["Disk"], (0.8, 1.3, 1.0)), (_spot(spot_blend=0.01), (1.2, 0.9, 0.8)),
                      (edge, (0.7, 1.1, 1.2))):  # fmt: skip
        parent = bpy.data.objects.new("Stretched", None)
        parent.scale = scale
        bpy.context.scene.collection.objects.link(parent)
        ob.parent = parent


@case("A spot by nodes: quadratic Light Falloff, Blackbody")
def quadratic_falloff() -> None:
    """Old files have this node in every lamp."""
    _things()
    tree, emission = _nodes(_spot())
    falloff = stage.node(tree, "ShaderNodeLightFalloff", {"Strength": 2.0})
    tree.links.new(falloff.outputs["Quadratic"], emission.inputs["Strength"])
    if bpy.app.version >= (4, 5, 0):  # before, the colour of a temperature can't be read
        warm = stage.node(tree, "ShaderNodeBlackbody", {"Temperature": 3200.0})
        tree.links.new(warm.outputs[0], emission.inputs["Color"])


@case("Lamps by nodes: a sum and a mix of Emission shaders, and arithmetic")
def summed_emission() -> None:
    """Two colours in one lamp."""
    _things()
    tree, emission = _nodes(_spot())
    red = stage.node(tree, "ShaderNodeEmission", {"Color": (1.0, 0.2, 0.1), "Strength": 0.8})
    blue = stage.node(tree, "ShaderNodeEmission", {"Color": (0.1, 0.3, 1.0), "Strength": 3.0})
    mixed = stage.node(tree, "ShaderNodeMixShader", {0: 0.25, 1: red, 2: blue})
    total = stage.node(tree, "ShaderNodeAddShader", {0: emission.outputs[0], 1: mixed})
    tree.links.new(total.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    strength = stage.node(tree, "ShaderNodeMath", {0: 0.5, 1: 0.4}, operation="MULTIPLY")
    tree.links.new(strength.outputs[0], emission.inputs["Strength"])


@case("A lamp that shines for camera rays only: it is dark, as in Cycles")
def lamp_for_the_camera() -> None:
    """Its strength is Is Camera Ray."""
    _things()
    tree, emission = _nodes(_spot())
    path = stage.node(tree, "ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], emission.inputs["Strength"])


@case("Lamps that are scaled, mirrored, or without 'Normalize', and a sun of angle zero")
def scaled_lamps() -> None:
    """Unapplied scale."""
    _things()
    panel = stage.lamp("AREA", "Mirrored", 40.0, (1.5, -1.0, 3.0), (0, 0, 0.5), shape="RECTANGLE", size=0.5, size_y=1.2)
    panel.scale = (-1.5, 0.7, 1.0)
    stage.lamp("POINT", "Scaled", 40.0, (-2.0, -1.0, 1.5), shadow_soft_size=0.2).scale = (2.0, 2.0, 2.0)
    stage.lamp("SUN", "Sharp", 0.5, (0, 0, 5), (1.0, 2.0, 0.0), angle=0.0)
    if bpy.app.version >= (4, 5, 0):
        stage.lamp("AREA", "Not normalized", 8.0, (0.0, -2.0, 3.0), (0, 0, 0.5), size=0.6, normalize=False)
        stage.lamp("POINT", "Small", 600.0, (0.8, -1.4, 1.4), shadow_soft_size=0.1, normalize=False)


@case("A lamp that lights only what the camera sees directly (Max Bounces 0)")
def lamp_without_bounces() -> None:
    """Indirect light of the spot is missing in Cycles."""
    _things()
    _spot().data.cycles.max_bounces = 0


@case("A lamp of negative power")
def negative_lamp() -> None:
    """It darkens the floor."""
    _things()
    stage.lamp("POINT", "Dark", -8.0, (1.0, -1.5, 1.0), shadow_soft_size=0.3)


@case("A spot with constant Light Falloff")
def constant_falloff() -> None:
    """Its light does not fall with distance."""
    _things()
    tree, emission = _nodes(_spot())
    falloff = stage.node(tree, "ShaderNodeLightFalloff", {"Strength": 0.15})
    tree.links.new(falloff.outputs["Constant"], emission.inputs["Strength"])


@case("A panel with a texture in its nodes")
def textured_lamp() -> None:
    """A checkered area light, which the export replaces by its mean."""
    _things()
    panel = stage.lamp("AREA", "Checks", 150.0, (1.5, -1.0, 3.0), (0, 0, 0.5), size=1.5)
    tree, emission = _nodes(panel)
    where = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
    checks = stage.node(tree, "ShaderNodeTexChecker", {
        "Vector": where, "Scale": 4.0, "Color1": (1, 0.5, 0.2), "Color2": (0.0, 0.1, 0.3)})  # fmt: skip
    tree.links.new(checks.outputs["Color"], emission.inputs["Color"])


IES = """IESNA:LM-63-2002
TILT=NONE
1 -1 1.0 5 1 1 2 0 0 0
1.0 1.0 0.0
0 22.5 45 67.5 90
0
400 350 150 30 0
"""


@case("A point lamp with an IES texture")
def ies_lamp() -> None:
    """A downlight."""
    _things()
    bulb = stage.lamp("POINT", "Downlight", 5.0, (0.5, -1.5, 2.5), shadow_soft_size=0.05)
    tree, emission = _nodes(bulb)
    text = bpy.data.texts.new("Downlight")
    text.write(IES)
    profile = stage.node(tree, "ShaderNodeTexIES", {"Strength": 1.0}, mode="INTERNAL", ies=text)
    tree.links.new(profile.outputs[0], emission.inputs["Strength"])

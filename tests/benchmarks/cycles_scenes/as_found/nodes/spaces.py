"""Spaces that nodes transform between, worlds by the camera's view, groups' odd sockets, and meshes without UV maps."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ... import stage
from ...case import case
from ..habits import checks, small


def _transformed(tree: Any, vector: Any, kind: str, source: str, target: str) -> Any:
    return stage.node(tree, "ShaderNodeVectorTransform", {0: vector}, vector_type=kind, convert_from=source,
                      convert_to=target)  # fmt: skip


def _positive(tree: Any, vector: Any) -> Any:
    return stage.node(tree, "ShaderNodeVectorMath", {0: vector}, operation="ABSOLUTE")


def _by_view(color: Callable[[Any], Any], camera_only: bool) -> None:
    """The world has the colour that `color` makes of the view, for the camera only or for all rays."""
    scene = small()
    tree = scene.world.node_tree
    background = tree.nodes["Background"]
    tree.links.new(color(tree).outputs[0], background.inputs["Color"])
    if camera_only:
        other = stage.node(tree, "ShaderNodeBackground", {"Color": (0.3, 0.3, 0.4), "Strength": 0.6})
        seen = stage.node(tree, "ShaderNodeLightPath").outputs["Is Camera Ray"]
        mixed = stage.node(tree, "ShaderNodeMixShader", {0: seen, 1: other, 2: background})
        tree.links.new(mixed.outputs[0], tree.nodes["World Output"].inputs[0])
    stage.row([stage.diffuse("Chalk"), stage.principled("Metal", Metallic=1.0, Roughness=0.3)])
    view = scene.camera
    view.rotation_euler.x += 0.35
    view.rotation_euler.z += 0.3
    view.data.shift_x, view.data.shift_y = 0.1, 0.05


def _screen(tree: Any) -> Any:
    """A gradient and squares fixed to the picture."""
    window = stage.node(tree, "ShaderNodeTexCoord").outputs["Window"]
    height = stage.node(tree, "ShaderNodeSeparateXYZ", {0: window}).outputs[1]
    ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": height})
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.1, 0.2, 0.6, 1), (0.9, 0.5, 0.2, 1)
    squares = stage.node(tree, "ShaderNodeTexChecker", {0: window, "Scale": 3.0})
    return stage.node(tree, "ShaderNodeMixRGB", {0: 0.3, 1: ramp, 2: squares})


@case("A world by Window coordinates: a gradient fixed to the picture, which lights the scene, too", bounces=2)
def world_by_window() -> None:
    """Backgrounds of tutorials."""
    _by_view(_screen, camera_only=False)


@case("A backdrop by Window coordinates that only the camera sees", bounces=2)
def backdrop_by_window() -> None:
    """Backgrounds of product pictures."""
    _by_view(_screen, camera_only=True)


@case("A world by Vector Transform to the camera's space", bounces=2)
def world_in_camera_space() -> None:
    """Light that turns with the camera."""

    def color(tree: Any) -> Any:
        direction = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
        return _positive(tree, _transformed(tree, direction, "VECTOR", "WORLD", "CAMERA"))

    _by_view(color, camera_only=False)


@case("Vector Transform: matcaps of the object's normal, positions and normals from space to space", bounces=2)
def spaces() -> None:
    """Materials that are lit by a picture."""
    small()
    picture = checks("Checks", size=32)

    def matcap(kind: str, target: str) -> stage.Shader:
        def shader(tree: Any) -> Any:
            seen = _transformed(tree, stage.node(tree, "ShaderNodeTexCoord").outputs["Normal"], kind, "OBJECT", target)
            place = stage.node(tree, "ShaderNodeMapping",
                               {"Vector": seen, "Location": (0.5, 0.5, 0), "Scale": (0.5,) * 3})  # fmt: skip
            texture = stage.node(tree, "ShaderNodeTexImage", {"Vector": place}, image=picture)
            return stage.node(tree, "ShaderNodeEmission", {"Color": texture})

        return shader

    def moved(kind: str, source: str, target: str) -> stage.Shader:
        def shader(tree: Any) -> Any:
            given = (stage.node(tree, "ShaderNodeTexCoord").outputs["Object"] if source == "OBJECT" else
                     stage.node(tree, "ShaderNodeNewGeometry").outputs[
                         "Position" if kind == "POINT" else "Normal"])  # fmt: skip
            vector = _positive(tree, _transformed(tree, given, kind, source, target))
            return stage.node(tree, "ShaderNodeEmission", {"Color": vector})

        return shader

    made = [matcap("NORMAL", "CAMERA"), matcap("VECTOR", "CAMERA"), matcap("NORMAL", "WORLD"),
            moved("POINT", "WORLD", "OBJECT"), moved("NORMAL", "WORLD", "OBJECT"), moved("VECTOR", "WORLD", "OBJECT"),
            moved("POINT", "OBJECT", "WORLD"), moved("NORMAL", "OBJECT", "WORLD")]  # fmt: skip
    for k, shader in enumerate(made):
        body = stage.monkey(f"Body {k}", stage.material(f"Space {k}", shader))
        scale = (0.4, 0.3, -0.5 if k == 3 else 0.4)
        stage.add(f"Body {k}", body, (-1.6 + 1.05 * (k % 4), 0.9 - 1.3 * (k // 4), 0.5), (0.3, 0.2, 0.4 * k), scale)


@case("Normal maps by Generated coordinates on text, metaballs, curves and meshes without a UV map", bounces=3)
def mapped_without_uv() -> None:
    """Dents on everything."""
    small()
    row = 0.5 + 0.2 * np.sin(np.linspace(0.0, 20.0, 32))
    dents = stage.image("Dents", np.stack([np.tile(row, (32, 1)), np.full((32, 32), 0.5), np.full((32, 32), 0.95)], -1),
                        "Non-Color")  # fmt: skip

    def dented(strength: float) -> Any:
        def shader(tree: Any) -> Any:
            place = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
            texture = stage.node(tree, "ShaderNodeTexImage", {"Vector": place}, image=dents)
            normal = stage.node(tree, "ShaderNodeNormalMap", {"Strength": strength, "Color": texture})
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.5, 0.6, 0.7), "Normal": normal,
                                                                 "Roughness": 0.3})  # fmt: skip

        return stage.material(f"Dented {strength}", shader)

    soft, strong = dented(1.0), dented(3.0)
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.bevel_depth = "Ab", 0.1, 0.03
    text.materials.append(soft)
    stage.add("Text", text, (-1.9, 0.4, 0.1), (1.1, 0, 0))
    drop = bpy.data.metaballs.new("Drop")
    drop.elements.new().radius = 0.8
    drop.render_resolution = 0.1
    drop.materials.append(soft)
    stage.add("Drop", drop, (0.2, 0.5, 0.5))
    wire = bpy.data.curves.new("Wire", "CURVE")
    wire.dimensions, wire.bevel_depth = "3D", 0.15
    spline = wire.splines.new("NURBS")
    spline.points.add(3)
    for point, place in zip(spline.points, ((0, 0, 0), (0.5, 0.5, 0.4), (1, -0.5, 0.2), (1.4, 0.3, 0.6)), strict=True):
        point.co = (*place, 1.0)
    wire.materials.append(strong)
    stage.add("Wire", wire, (0.6, -0.3, 0.3))
    for k, (made, smooth) in enumerate(((strong, True), (soft, False))):
        ball = stage.sphere(f"Ball {k}", made, radius=0.4, segments=24, smooth=smooth)
        ball.uv_layers.remove(ball.uv_layers[0])
        stage.add(f"Ball {k}", ball, (-0.9 + 1.0 * k, -0.7, 0.4), (0.2 * k, 0, 0))


@case("Groups with sockets of all types: numbers, integers, yes or no, vectors, colours, one into the next", bounces=3)
def group_sockets() -> None:
    """Groups that were made in a hurry."""
    small()
    group = bpy.data.node_groups.new("Sockets", "ShaderNodeTree")
    kinds = ("Float", "Int", "Bool", "Vector", "Color")
    for way in ("INPUT", "OUTPUT"):
        for kind in kinds:
            group.interface.new_socket(kind, in_out=way, socket_type=f"NodeSocket{kind}")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    for k in range(5):
        group.links.new(start.outputs[k], end.inputs[(k + 1) % 5])

    def through(k: int) -> stage.Shader:
        def shader(tree: Any) -> Any:
            used = stage.node(tree, "ShaderNodeGroup", node_tree=group)
            noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 3.0})
            vector = stage.node(tree, "ShaderNodeVectorMath", {0: noise.outputs[1], 1: (1.8, 1.2, 0.6)},
                                operation="MULTIPLY")  # fmt: skip
            given = (noise.outputs[1], vector.outputs[0], noise.outputs[0], vector.outputs[0], noise.outputs[1])[k]
            tree.links.new(given, used.inputs[k])
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": used.outputs[(k + 1) % 5]})

        return shader

    stage.row([stage.material(f"Through {kind}", through(k)) for k, kind in enumerate(kinds)], radius=0.45, gap=1.0)


@case("Paint on one side only, outlines by an inverted hull, culling for EEVEE", bounces=4)
def one_sided() -> None:
    """What engines do by culling."""
    small()

    def sided(front: Callable[[Any], Any], back: Callable[[Any], Any]) -> stage.Shader:
        return lambda tree: stage.node(tree, "ShaderNodeMixShader", {
            0: stage.node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"],
            1: front(tree), 2: back(tree)})  # fmt: skip

    def painted(color: tuple[float, ...]) -> Callable[[Any], Any]:
        return lambda tree: stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": color})

    def nothing(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfTransparent")

    box = stage.cube("Box", stage.material("One side", sided(painted((0.8, 0.2, 0.2)), nothing)), size=1.0)
    stage.add("Box", box, (-1.3, 0.2, 0.5), (0, 0, 0.5))

    def outline(tree: Any) -> Any:
        back = stage.node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
        front = stage.node(tree, "ShaderNodeMath", {0: 1.0, 1: back}, operation="SUBTRACT")
        seen = stage.node(tree, "ShaderNodeLightPath").outputs["Is Camera Ray"]
        both = stage.node(tree, "ShaderNodeMath", {0: front, 1: seen}, operation="MULTIPLY")
        ink = stage.node(tree, "ShaderNodeEmission", {"Color": (0.0, 0.0, 0.1)})
        return stage.node(tree, "ShaderNodeMixShader", {0: both, 1: nothing(tree), 2: ink})

    toy = stage.monkey("Toy", stage.diffuse("Skin", (0.8, 0.6, 0.4)), stage.material("Outline", outline))
    hull = stage.add("Toy", toy, (0.3, 0, 0.6), scale=0.6).modifiers.new("Hull", "SOLIDIFY")
    hull.thickness, hull.offset, hull.use_flip_normals, hull.use_rim, hull.material_offset = 0.06, 1.0, True, False, 1
    culled = stage.principled("Culled", (0.2, 0.6, 0.3))
    culled.use_backface_culling = True
    stage.add("Board", stage.plane("Board", culled, size=1.0), (1.6, 0.2, 0.6), (math.pi - 0.7, 0, 0))
    inside = stage.material("Shade", sided(painted((0.1, 0.2, 0.8)), lambda tree: stage.node(
        tree, "ShaderNodeEmission", {"Color": (0.9, 0.7, 0.1)})))  # fmt: skip
    stage.add("Tray", stage.grid("Tray", inside, size=0.8, cells=2), (1.2, -1.0, 0.5), (2.5, 0.3, 0))

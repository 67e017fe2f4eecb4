"""What carries the values that nodes read: islands of one mesh, points, curves, and attributes of odd names."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ... import stage
from ...case import case
from ..habits import small


def _chalk(name: str, color: Callable[[Any], Any]) -> Any:
    return stage.material(name, lambda tree: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color(tree)}))


def _hue(tree: Any, value: Any) -> Any:
    return stage.node(tree, "ShaderNodeCombineColor", {0: value, 1: 0.8, 2: 0.8}, mode="HSV")


@case("Random per Island on a meadow: many thousand blades in one mesh, each of its own colour", bounces=2)
def island_meadow() -> None:
    """Leaves and blades that were joined to one mesh."""
    small()
    rng = np.random.default_rng(2)
    points: list[Any] = []
    faces: list[tuple[int, ...]] = []
    for _ in range(30000):
        x, y, turn, height = rng.uniform(-3, 3), rng.uniform(-2, 2), rng.uniform(0, 6.3), rng.uniform(0.05, 0.2)
        across = np.array((0.015 * math.cos(turn), 0.015 * math.sin(turn), 0.0))
        place, count = np.array((x, y, 0.001)), len(points)
        points += [place - across, place + across, place + (0.0, 0.05, height)]
        faces.append((count, count + 1, count + 2))
    random = _chalk("Blades", lambda tree: _hue(
        tree, stage.node(tree, "ShaderNodeNewGeometry").outputs["Random Per Island"]))  # fmt: skip
    stage.add("Meadow", stage.mesh("Meadow", points, faces, random))


def _to_points(material: Any) -> Any:
    """Geometry nodes that make spheres of the vertices."""
    group = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    points, given = group.nodes.new("GeometryNodeMeshToPoints"), group.nodes.new("GeometryNodeSetMaterial")
    points.inputs["Radius"].default_value, given.inputs["Material"].default_value = 0.3, material
    group.links.new(start.outputs[0], points.inputs[0])
    group.links.new(points.outputs[0], given.inputs[0])
    group.links.new(given.outputs[0], end.inputs[0])
    return group


@case("Point clouds, also unevenly scaled ones, by Generated and Normal coordinates and layer weight", bounces=2)
def coordinates_of_points() -> None:
    """Balls of a molecule with a procedural texture that nothing is linked to."""
    small()
    colors: list[Callable[[Any], Any]] = [
        lambda tree: stage.node(tree, "ShaderNodeTexNoise", {"Scale": 3.0}).outputs[1],
        lambda tree: stage.node(tree, "ShaderNodeVectorMath", {0: stage.node(tree, "ShaderNodeTexCoord").outputs[
            "Normal"]}, operation="ABSOLUTE"),
        lambda tree: stage.node(tree, "ShaderNodeLayerWeight").outputs["Facing"],
    ]  # fmt: skip
    for k, color in enumerate(colors):
        for row, scale in enumerate(((1.0, 1.0, 1.0), (1.3, 0.6, 0.8))):
            name = f"Molecule {k} {row}"
            place = (1.6 * k - 1.6, 1.5 * row - 0.7, 0.7)
            ob = stage.add(name, stage.cube(name, size=0.7), place, (0.3, 0.2, 0.5), scale)
            ob.modifiers.new("Points", "NODES").node_group = _to_points(_chalk(name, color))


@case("Attributes whose names Cycles keeps for its own: color, density, uv, generated, pointiness", bounces=2)
def reserved_names() -> None:
    """Scans and simulations call their layers so. Cycles does not see them."""
    small()
    names = ("color", "density", "uv", "generated", "pointiness", "random_per_island", "Color")
    for k, name in enumerate(names):
        for row, kind in enumerate(("ShaderNodeAttribute", "ShaderNodeVertexColor")):
            key = "attribute_name" if row == 0 else "layer_name"
            read = _chalk(f"{name} {row}", lambda tree, kind=kind, key=key, name=name: stage.node(  # type: ignore[misc]
                tree, kind, **{key: name}).outputs[0])  # fmt: skip
            body = stage.sphere(f"{name} {row}", read, radius=0.35, segments=24)
            layer = body.color_attributes.new(name, "FLOAT_COLOR", "POINT")
            layer.data.foreach_set("color", np.tile(np.array([0.7, 0.2, 0.4, 1.0], np.float32), len(body.vertices)))
            stage.add(f"{name} {row}", body, (0.8 * k - 2.4, 1.2 * row - 0.5, 0.36))

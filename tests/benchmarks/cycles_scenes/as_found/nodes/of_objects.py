"""Textures that differ between objects: moved, turned and scaled at random, also where their values are baked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ... import stage
from ...case import case
from ..habits import checks, small


def _random(tree: Any) -> Any:
    return stage.node(tree, "ShaderNodeObjectInfo").outputs["Random"]


def _chalk(name: str, color: Callable[[Any], Any]) -> Any:
    return stage.material(name, lambda tree: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color(tree)}))


def _copies(material: Any, y: float, count: int = 5) -> None:
    """Objects that share a mesh."""
    body = stage.cube(material.name, material, size=0.9)
    for k in range(count):
        stage.add(f"{material.name} {k}", body, (1.15 * (k - 0.5 * (count - 1)), y, 0.46), (0, 0, 0.3 * k))


@case("Textures that Mapping and Vector Rotate nodes move, turn and scale at random for each object", bounces=2)
def varied_copies() -> None:
    """Wood and stone that shall not look the same on each copy."""
    small()

    def place(tree: Any, coordinate: str) -> Any:
        return stage.node(tree, "ShaderNodeTexCoord").outputs[coordinate]

    def moved(tree: Any) -> Any:
        by = stage.node(tree, "ShaderNodeMapping", {
            "Vector": place(tree, "UV"), "Location": _random(tree), "Rotation": _random(tree),
            "Scale": stage.node(tree, "ShaderNodeMath", {0: _random(tree), 1: 1.0}, operation="ADD")})  # fmt: skip
        return stage.node(tree, "ShaderNodeTexImage", {"Vector": by}, image=checks("Squares"))

    def turned(tree: Any) -> Any:
        angle = stage.node(tree, "ShaderNodeMath", {0: _random(tree), 1: 6.0}, operation="MULTIPLY")
        by = stage.node(tree, "ShaderNodeVectorRotate", {
            "Vector": place(tree, "Object"), "Axis": (0.3, 0.5, 1.0), "Angle": angle,
            "Center": _random(tree)})  # fmt: skip
        return stage.node(tree, "ShaderNodeTexWave", {"Vector": by, "Scale": 1.2, "Distortion": 1.0})

    _copies(_chalk("Moved", moved), -0.8)
    _copies(_chalk("Turned", turned), 0.8)


@case("Baked textures by values of objects: random, colour, property; on meshes without a UV map", bounces=2)
def baked_of_objects() -> None:
    """Nodes that only Cycles evaluates, by values that the object of a bake does not have."""
    small()

    def gabor(vector: Callable[[Any], Any]) -> Callable[[Any], Any]:
        return lambda tree: stage.node(tree, "ShaderNodeTexGabor", {"Vector": vector(tree), "Scale": 2.0})

    def shifted(tree: Any) -> Any:
        coordinates = stage.node(tree, "ShaderNodeTexCoord").outputs["Object"]
        return stage.node(tree, "ShaderNodeVectorMath", {0: coordinates, 1: _random(tree)}, operation="ADD")

    def kept(tree: Any) -> Any:
        kept = stage.node(tree, "ShaderNodeAttribute", attribute_type="OBJECT", attribute_name="age")
        layer = stage.node(tree, "ShaderNodeAttribute", attribute_type="VIEW_LAYER", attribute_name="age")
        return stage.node(tree, "ShaderNodeVectorMath", {0: kept.outputs[1], 1: layer.outputs[1]}, operation="ADD")

    def of_map(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]

    _copies(_chalk("Shifted", gabor(shifted)), -1.1, 4)
    _copies(_chalk("Kept", gabor(kept)), 0.1, 4)
    bpy.context.scene["age"] = 0.3
    for ob in bpy.data.objects:
        ob["age"] = 0.37 if ob.name.endswith("1") else 0.8
    for k, material in enumerate((_chalk("No map", gabor(of_map)), _chalk("Tangents", lambda tree: stage.node(
            tree, "ShaderNodeTangent", direction_type="UV_MAP")))):  # fmt: skip
        body = stage.sphere(material.name, material, radius=0.5, segments=48)
        body.uv_layers.remove(body.uv_layers[0])
        stage.add(material.name, body, (1.2 * k - 0.6, 1.3, 0.5))

"""Coordinates and normals of bodies that modifiers, keys and nodes deform, and of objects that are not meshes."""

from __future__ import annotations

from typing import Any

import bpy

from .. import stage
from ..case import case
from .habits import checks, small


def _by(output: str, name: str = "") -> Any:
    """A material that shows a coordinate as bands."""

    def shader(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord").outputs[output]
        bands = stage.node(tree, "ShaderNodeTexWave", {"Vector": place, "Scale": 2.0, "Distortion": 1.0})
        paint = stage.node(
            tree, "ShaderNodeMixRGB", {0: bands.outputs[1], 1: place, 2: (0.8, 0.6, 0.3)}, blend_type="MIX"
        )
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": paint})

    return stage.material(name or output, shader)


@case("Generated coordinates: own texture space, shape keys, armatures, subdivision, of a parent's mesh", bounces=2)
def texture_spaces() -> None:
    """Patterns that stick to what deforms."""
    small()
    made = _by("Generated")
    own = stage.sphere("Own space", made, radius=0.45, segments=24)
    own.use_auto_texspace = False
    own.texspace_location, own.texspace_size = (0.2, 0.0, 0.1), (0.3, 0.6, 0.9)
    stage.add("Own space", own, (-1.9, -0.4, 0.45))
    keyed = stage.add("Keyed", stage.sphere("Keyed", made, radius=0.45, segments=24), (-0.7, -0.4, 0.45))
    keyed.shape_key_add(name="Basis")
    high = keyed.shape_key_add(name="High")
    for point in high.data:
        point.co.z *= 1.8
    high.value = 0.8
    posed = stage.add("Posed", stage.cylinder("Posed", made, radius=0.3, depth=1.2), (0.5, -0.4, 0.6))
    bend = posed.modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.angle = "TWIST", 1.2
    fine = stage.add("Fine", stage.cube("Fine", made, size=0.9), (1.7, -0.4, 0.5))
    fine.modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    other = stage.add("Other", stage.cube("Other", made, size=0.7), (0.0, 1.0, 0.4), (0.2, 0.1, 0.5))
    other.data.texco_mesh = own
    arrayed = stage.add("Arrayed", stage.cube("Arrayed", made, size=0.3), (-1.9, 0.9, 0.2))
    arrayed.modifiers.new("Array", "ARRAY").count = 4


@case("Coordinates of curves, text, surfaces and metaballs: Generated, UV, Object, Normal", bounces=2)
def coordinates_of_curves() -> None:
    """Patterns on what is no mesh."""
    small()
    for k, output in enumerate(("Generated", "UV", "Object", "Normal")):
        text = bpy.data.curves.new(f"Text {output}", "FONT")
        text.body, text.size, text.extrude, text.bevel_depth = "Ab", 0.8, 0.08, 0.02
        text.materials.append(_by(output, f"Text {output}"))
        stage.add(f"Text {output}", text, (-2.0 + 1.1 * k, -0.9, 0.1), (0.8, 0, 0))
        path = bpy.data.curves.new(f"Path {output}", "CURVE")
        path.dimensions, path.bevel_depth, path.use_path = "3D", 0.12, False
        spline = path.splines.new("BEZIER")
        spline.bezier_points.add(1)
        for j, point in enumerate(spline.bezier_points):
            point.co, point.handle_left_type, point.handle_right_type = (0.7 * j, 0.0, 0.5 * j), "AUTO", "AUTO"
        path.materials.append(_by(output, f"Path {output}"))
        stage.add(f"Path {output}", path, (-2.1 + 1.1 * k, 0.4, 0.2))
    ball = bpy.data.metaballs.new("Meta")
    ball.elements.new().radius, ball.render_resolution = 0.9, 0.1
    ball.materials.append(_by("Generated", "Meta"))
    stage.add("Meta", ball, (0.0, 1.7, 0.5))


@case("Materials of single letters and of splines; a bevel of part of a curve; text on a curve", bounces=2)
def letters() -> None:
    """Logos."""
    small()
    red, blue = stage.principled("Red", (0.7, 0.2, 0.1)), stage.principled("Blue", (0.1, 0.2, 0.7))
    text = bpy.data.curves.new("Logo", "FONT")
    text.body, text.size, text.extrude = "abc", 1.0, 0.1
    text.materials.append(red)
    text.materials.append(blue)
    text.body_format[1].material_index = 1
    text.body_format[2].use_underline = True
    stage.add("Logo", text, (-2.0, -0.6, 0.1), (0.7, 0, 0))
    path = bpy.data.curves.new("Wires", "CURVE")
    path.dimensions, path.bevel_depth = "3D", 0.1
    path.bevel_factor_start, path.bevel_factor_end, path.use_fill_caps = 0.2, 0.7, True
    path.materials.append(red)
    path.materials.append(blue)
    for j in range(2):
        spline = path.splines.new("POLY")
        spline.points.add(3)
        for k, point in enumerate(spline.points):
            point.co, point.radius = (0.5 * k, 0.4 * j + 0.2 * (k % 2), 0.2 * k, 1.0), 1.0 - 0.2 * k
        spline.material_index, spline.use_smooth = j, j == 0
    stage.add("Wires", path, (0.3, -0.6, 0.2))
    around = bpy.data.curves.new("Around", "FONT")
    around.body, around.size, around.extrude = "around", 0.4, 0.03
    around.materials.append(blue)
    circle = bpy.data.curves.new("Circle", "CURVE")
    circle.dimensions = "2D"
    spline = circle.splines.new("NURBS")
    spline.points.add(5)
    for k, point in enumerate(spline.points):
        point.co = (0.8 * (k - 2.5) / 2.5, 0.3 * (k % 3), 0.0, 1.0)
    spline.use_endpoint_u = True
    around.follow_curve = stage.add("Circle", circle, (0.0, 1.0, 0.4))
    stage.add("Around", around, (0.0, 1.0, 0.4), (0.6, 0, 0))


@case("Geometry nodes: random scale and turn of instances, smooth shading, stored UVs, normals, joined with the input",
      bounces=2)  # fmt: skip
def node_bodies() -> None:
    """Scattering of tutorials."""
    small()
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    spread = stage.node(tree, "GeometryNodeDistributePointsOnFaces", {"Mesh": start.outputs[0], "Density": 6.0})
    body = stage.node(tree, "GeometryNodeMeshUVSphere", {"Segments": 10, "Rings": 6, "Radius": 0.15})
    smooth = stage.node(tree, "GeometryNodeSetShadeSmooth", {"Geometry": body})
    stored = stage.node(tree, "GeometryNodeStoreNamedAttribute", {"Geometry": smooth, "Name": "Own UV"},
                        data_type="FLOAT2", domain="CORNER")  # fmt: skip
    tree.links.new(body.outputs[1], next(one for one in stored.inputs if one.name == "Value" and one.enabled))
    painted = stage.node(tree, "GeometryNodeSetMaterial", {"Geometry": stored})

    def shader(nodes: Any) -> Any:
        where = stage.node(nodes, "ShaderNodeUVMap", uv_map="Own UV")
        texture = stage.node(nodes, "ShaderNodeTexImage", {"Vector": where}, image=checks("Checks"))
        return stage.node(nodes, "ShaderNodeBsdfPrincipled", {"Base Color": texture.outputs[0], "Roughness": 0.4})

    painted.inputs["Material"].default_value = stage.material("Bead", shader)
    size = stage.node(tree, "FunctionNodeRandomValue", {"Min": (0.4, 0.4, 0.4), "Max": (1.6, 1.0, 1.2)},
                      data_type="FLOAT_VECTOR")  # fmt: skip
    placed = stage.node(tree, "GeometryNodeInstanceOnPoints", {
        "Points": spread.outputs[0], "Instance": painted, "Rotation": spread.outputs["Rotation"],
        "Scale": size})  # fmt: skip
    joined = stage.node(tree, "GeometryNodeJoinGeometry", {0: placed})
    tree.links.new(start.outputs[0], joined.inputs[0])
    tree.links.new(joined.outputs[0], end.inputs[0])
    hill = stage.add("Hill", stage.sphere("Hill", stage.diffuse("Hill", (0.3, 0.5, 0.2)), radius=1.1, segments=32))
    hill.scale = (1.4, 1.0, 0.6)
    hill.modifiers.new("Scatter", "NODES").node_group = tree

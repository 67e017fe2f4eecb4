"""Values that vary by object, instance, island and attribute, and bodies that modifiers and nodes make."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _group(ob: Any, name: str) -> tuple[Any, Any, Any]:
    """A tree of geometry nodes as a modifier: the tree, its input and its output."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for kind in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=kind, socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    ob.modifiers.new(name, "NODES").node_group = tree
    return tree, start, end


def _attribute(kind: str, name: str, output: str = "Color") -> Any:
    def shader(tree: Any) -> Any:
        read = stage.node(tree, "ShaderNodeAttribute", attribute_type=kind, attribute_name=name)
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": read.outputs[output], "Roughness": 0.6})

    return stage.material(f"{kind} {name}", shader)


@case("Custom properties of objects, instancers and the view layer; Object Info: location, indices", bounces=2)
def custom_properties() -> None:
    """The Attribute node beside geometry."""
    stage.studio(width=6.0)
    bpy.context.scene["accent"] = (0.1, 0.6, 0.3)
    shared = _attribute("OBJECT", "tint")
    for k in range(3):
        ob = stage.add(f"Ball {k}", stage.sphere(f"Ball {k}", shared, radius=0.45), (-2.2 + 1.0 * k, -0.5, 0.45))
        if k < 2:
            ob["tint"] = (0.8 - 0.6 * k, 0.3, 0.2 + 0.5 * k)
    stage.add("Accent", stage.cube("Accent", _attribute("VIEW_LAYER", "accent"), size=0.8), (0.8, -0.5, 0.4))

    def indices(tree: Any) -> Any:
        info = stage.node(tree, "ShaderNodeObjectInfo")
        place = stage.node(
            tree, "ShaderNodeVectorMath", {0: info.outputs["Location"], 1: (0.3, 0.3, 0.3)}, operation="MULTIPLY"
        )
        number = stage.node(
            tree,
            "ShaderNodeMath",
            {0: info.outputs["Object Index"], 1: info.outputs["Material Index"]},
            operation="ADD",
        )
        tint = stage.node(tree, "ShaderNodeMath", {0: number, 1: 0.1}, operation="MULTIPLY")
        return stage.node(
            tree,
            "ShaderNodeBsdfDiffuse",
            {"Color": stage.node(tree, "ShaderNodeMixRGB", {0: tint, 1: place, 2: (0.9, 0.9, 0.2)})},
        )

    numbered = stage.material("Numbered", indices)
    numbered.pass_index = 2
    carrier = _attribute("INSTANCER", "tint")
    kit = bpy.data.collections.new("Kit")
    part = bpy.data.objects.new("Part", stage.cube("Part", carrier, size=0.6))
    part["tint"] = (0.2, 0.2, 0.9)
    kit.objects.link(part)
    for k in range(2):
        ob = stage.add(f"Numbered {k}", stage.cube("Numbered", numbered, size=0.6), (-1.5 + 1.2 * k, 1.0, 0.3))
        ob.pass_index = 3 * k
        shown = stage.add(f"Kit {k}", None, (1.0 + 1.0 * k, 1.0, 0.3))
        shown.instance_type, shown.instance_collection = "COLLECTION", kit
        shown["tint"] = (0.9, 0.5 * k, 0.1)


@case("Geometry: Random per Island, Parametric, Tangent, True Normal; the default Color Attribute", bounces=2)
def islands() -> None:
    """Bricks of one mesh that differ in tone."""
    stage.studio(width=5.5)

    def by(output: str) -> Any:
        def shader(tree: Any) -> Any:
            value = stage.node(tree, "ShaderNodeNewGeometry").outputs[output]
            if output == "Random Per Island":
                value = stage.node(tree, "ShaderNodeHueSaturation", {"Hue": value, "Color": (0.7, 0.3, 0.2)}).outputs[0]
            else:
                value = stage.node(tree, "ShaderNodeVectorMath", {0: value}, operation="ABSOLUTE").outputs[0]
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": value})

        return stage.material(output, shader)

    points: list[tuple[float, float, float]] = []
    faces: list[list[int]] = []
    for row in range(4):
        for column in range(4):
            base, x, z = len(points), -0.8 + 0.42 * column + 0.1 * (row % 2), 0.05 + 0.27 * row
            points += [(x + dx, dy, z + dz) for dx in (0, 0.4) for dy in (-0.1, 0.1) for dz in (0, 0.25)]
            faces += [
                [base + k for k in face]
                for face in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (1, 5, 7, 3), (0, 2, 6, 4))
            ]
    stage.add("Bricks", stage.mesh("Bricks", points, faces, by("Random Per Island")), (-1.6, 0.0, 0.0))
    for k, output in enumerate(("True Normal", "Tangent", "Incoming")):
        stage.add(output, stage.sphere(output, by(output), radius=0.4, segments=24), (-0.2 + 1.0 * k, -0.3, 0.4))
    painted = stage.grid(
        "Painted",
        stage.material(
            "Painted",
            lambda tree: stage.node(
                tree, "ShaderNodeBsdfDiffuse", {"Color": stage.node(tree, "ShaderNodeVertexColor")}
            ),
        ),
        size=1.2,
        cells=6,
    )
    for name, domain, kind in (("First", "POINT", "FLOAT_COLOR"), ("Second", "CORNER", "BYTE_COLOR")):
        layer = painted.color_attributes.new(name, kind, domain)
        colors = np.random.default_rng(len(layer.data)).uniform(0.1, 0.9, (len(layer.data), 4)).astype(np.float32)
        layer.data.foreach_set("color", colors.ravel())
    painted.color_attributes.render_color_index = 1
    stage.add("Painted", painted, (0.6, 1.2, 0.7), (1.2, 0, 0.2))


@case("Geometry nodes: attributes of points, faces and instances, Set Material, curves made to meshes", bounces=2)
def node_attributes() -> None:
    """Colours stored by nodes."""
    stage.studio(width=6.0)
    board = stage.add(
        "Board", stage.grid("Board", stage.diffuse("Bare"), size=2.0, cells=8), (-1.5, 0.2, 0.4), (0.3, 0, 0)
    )
    tree, start, end = _group(board, "Colours")
    place = stage.node(tree, "GeometryNodeInputPosition")
    color = stage.node(tree, "ShaderNodeVectorMath", {0: place, 1: (0.4, 0.4, 0.4)}, operation="ADD")
    stored = stage.node(
        tree,
        "GeometryNodeStoreNamedAttribute",
        {"Geometry": start.outputs[0], "Name": "tone"},
        data_type="FLOAT_VECTOR",
        domain="FACE",
    )
    tree.links.new(color.outputs[0], next(s for s in stored.inputs if s.name == "Value" and s.type == "VECTOR"))
    painted = stage.node(
        tree, "GeometryNodeSetMaterial", {"Geometry": stored, "Material": _attribute("GEOMETRY", "tone", "Vector")}
    )
    tree.links.new(painted.outputs[0], end.inputs[0])

    bead = stage.add(
        "Bead", stage.sphere("Bead", _attribute("INSTANCER", "shade", "Fac"), radius=0.18, segments=16), (0, -30, 0)
    )
    carrier = stage.add("Carrier", stage.grid("Carrier", stage.diffuse("Bare 2"), size=1.8, cells=3), (1.4, 0.0, 0.3))
    tree, start, end = _group(carrier, "Instances")
    source = stage.node(tree, "GeometryNodeObjectInfo", {"Object": bead, "As Instance": True})
    placed = stage.node(
        tree,
        "GeometryNodeInstanceOnPoints",
        {"Points": start.outputs[0], "Instance": next(s for s in source.outputs if s.type == "GEOMETRY")},
    )
    number = stage.node(
        tree, "ShaderNodeMath", {0: stage.node(tree, "GeometryNodeInputIndex"), 1: 0.06}, operation="MULTIPLY"
    )
    stored = stage.node(
        tree,
        "GeometryNodeStoreNamedAttribute",
        {"Geometry": placed, "Name": "shade"},
        data_type="FLOAT",
        domain="INSTANCE",
    )
    tree.links.new(number.outputs[0], next(s for s in stored.inputs if s.name == "Value" and s.type == "VALUE"))
    tree.links.new(stored.outputs[0], end.inputs[0])

    wire = stage.add("Wire", stage.mesh("Wire", [(0, 0, 0)], []), (0.0, 1.4, 0.6))
    tree, _, end = _group(wire, "Wire")
    spiral = stage.node(
        tree, "GeometryNodeCurveSpiral", {"Rotations": 2.0, "Start Radius": 0.6, "End Radius": 0.2, "Height": 0.8}
    )
    profile = stage.node(tree, "GeometryNodeCurvePrimitiveCircle", {"Radius": 0.06, "Resolution": 12})
    tube = stage.node(tree, "GeometryNodeCurveToMesh", {"Curve": spiral, "Profile Curve": profile.outputs[0]})
    smooth = stage.node(tree, "GeometryNodeSetShadeSmooth", {0: tube})
    copper = stage.node(
        tree,
        "GeometryNodeSetMaterial",
        {0: smooth, "Material": stage.principled("Copper", (0.9, 0.5, 0.3), Metallic=1.0, Roughness=0.3)},
    )
    tree.links.new(copper.outputs[0], end.inputs[0])


@case("Deformers: Lattice, Curve, Cast, Wave, Displace by a texture, Simple Deform, Shrinkwrap, Build", bounces=2)
def deformers() -> None:
    """Modifiers that move vertices."""
    stage.studio(width=6.0)
    clay = stage.principled("Clay", (0.6, 0.5, 0.4), Roughness=0.5)

    def body(name: str, x: float, y: float) -> Any:
        ob = stage.add(name, stage.cube(name, clay, size=0.8), (x, y, 0.5))
        divide = ob.modifiers.new("Subdivision", "SUBSURF")
        divide.subdivision_type, divide.levels, divide.render_levels = "SIMPLE", 1, 3
        return ob

    twisted = body("Twisted", -2.2, 0.0).modifiers.new("Twist", "SIMPLE_DEFORM")
    twisted.deform_method, twisted.angle, twisted.deform_axis = "TWIST", 1.2, "Z"
    cast = body("Cast", -1.0, 0.0).modifiers.new("Cast", "CAST")
    cast.factor = 0.7
    bumpy = body("Bumpy", 0.2, 0.0).modifiers.new("Displace", "DISPLACE")
    clouds = bpy.data.textures.new("Clouds", "CLOUDS")
    clouds.noise_scale = 0.4
    bumpy.texture, bumpy.strength = clouds, 0.3
    wave = body("Wave", 1.4, 0.0).modifiers.new("Wave", "WAVE")
    wave.height, wave.width, wave.time_offset = 0.2, 0.4, -20.0
    frame = stage.add("Lattice", bpy.data.lattices.new("Lattice"), (2.5, 0.0, 0.5))
    for point in frame.data.points:
        if point.co.z > 0:
            point.co_deform = (0.4 * point.co.x, 0.4 * point.co.y, point.co.z)
    body("Tapered", 2.5, 0.0).modifiers.new("Lattice", "LATTICE").object = frame
    path = bpy.data.curves.new("Path", "CURVE")
    path.dimensions = "3D"
    spline = path.splines.new("BEZIER")
    spline.bezier_points.add(2)
    for point, place in zip(spline.bezier_points, ((-2.0, 1.5, 0.4), (0.0, 2.2, 0.8), (2.0, 1.5, 0.4)), strict=True):
        point.co, point.handle_left_type, point.handle_right_type = place, "AUTO", "AUTO"
    along = stage.add("Path", path)
    chain = stage.add("Chain", stage.cube("Chain", stage.diffuse("Links", (0.2, 0.4, 0.6)), size=0.25))
    array = chain.modifiers.new("Array", "ARRAY")
    array.fit_type, array.curve, array.relative_offset_displace = "FIT_CURVE", along, (1.4, 0, 0)
    chain.modifiers.new("Curve", "CURVE").object = along


@case("Subdivision: creases, boundary and UV smoothing, Catmull-Clark beside simple, Multiresolution", bounces=2)
def subdivision() -> None:
    """Bodies of few faces, with textures that the subdivision stretches."""
    stage.studio(width=6.0)
    checks = stage.material(
        "Checks",
        lambda tree: stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {
                "Base Color": stage.node(
                    tree,
                    "ShaderNodeTexChecker",
                    {
                        "Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["UV"],
                        "Scale": 8.0,
                        "Color1": (0.8, 0.3, 0.1),
                        "Color2": (0.1, 0.3, 0.5),
                    },
                )
            },
        ),
    )
    for k, smoothing in enumerate(("NONE", "PRESERVE_BOUNDARIES", "SMOOTH_ALL", "PRESERVE_CORNERS")):
        made = stage.cube(f"Cube {k}", checks, size=1.0)
        for face in made.polygons:
            face.use_smooth = True
        if k == 2:
            crease = made.attributes.new("crease_edge", "FLOAT", "EDGE")
            crease.data.foreach_set("value", [0.8 if edge.index % 3 == 0 else 0.0 for edge in made.edges])
        ob = stage.add(f"Cube {k}", made, (-2.1 + 1.4 * k, -0.3, 0.5), (0, 0, 0.3))
        divide = ob.modifiers.new("Subdivision", "SUBSURF")
        divide.levels, divide.render_levels, divide.uv_smooth = 1, 3, smoothing
    head = stage.add("Head", stage.monkey("Head", checks), (0.0, 1.4, 0.8), scale=0.7)
    bpy.context.view_layer.objects.active = head
    head.modifiers.new("Multires", "MULTIRES")
    with bpy.context.temp_override(object=head, active_object=head):
        bpy.ops.object.multires_subdivide(modifier="Multires")


@case("Mirrored parts: negative scales with normal maps, bump, anisotropy, text and instances", bounces=2, samples=64)
def mirrored_parts() -> None:
    """Left and right halves of one mesh."""
    stage.studio(width=6.0)
    rng = np.random.default_rng(4)
    slopes = np.concatenate([0.5 + rng.uniform(-0.25, 0.25, (16, 16, 2)), np.ones((16, 16, 1))], axis=2)
    normals = stage.image("Normals", slopes, "Non-Color")

    def mapped(tree: Any) -> Any:
        color = stage.node(tree, "ShaderNodeTexImage", image=normals)
        return stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {
                "Base Color": (0.5, 0.4, 0.3),
                "Roughness": 0.4,
                "Normal": stage.node(tree, "ShaderNodeNormalMap", {"Color": color}),
            },
        )

    def bumped(tree: Any) -> Any:
        height = stage.node(
            tree,
            "ShaderNodeTexWave",
            {"Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["Object"], "Scale": 3.0},
        )
        return stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {"Base Color": (0.3, 0.5, 0.3), "Normal": stage.node(tree, "ShaderNodeBump", {"Height": height})},
        )

    def brushed(tree: Any) -> Any:
        return stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {
                "Metallic": 1.0,
                "Roughness": 0.4,
                "Anisotropic": 0.8,
                "Anisotropic Rotation": 0.15,
                "Tangent": stage.node(tree, "ShaderNodeTangent", direction_type="UV_MAP"),
            },
        )

    for k, shader in enumerate((mapped, bumped, brushed)):
        made = stage.sphere(shader.__name__, stage.material(shader.__name__, shader), radius=0.45, segments=48)
        for side in (1.0, -1.0):
            stage.add(
                f"{shader.__name__} {side}",
                made,
                (0.5 * side + 2.0 * (k - 1), -0.4, 0.5),
                (0.2, 0.3, 0.4),
                (side, 1.0, 1.0),
            )
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.size = "Left", 0.05, 0.7
    text.materials.append(bpy.data.materials["bumped"])
    for side in (1.0, -1.0):
        stage.add(f"Text {side}", text, (0.3 * side, 1.2, 0.3), (1.3, 0, 0), (side, 1.0, 1.0))

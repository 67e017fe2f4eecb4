"""Geometry: normals, instances, modifiers, what is made into meshes."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case


@case("Smooth, flat, sharp and custom normals; material slots per face; mirrored objects")
def normals() -> None:
    """Coarse bodies that show their normals."""
    stage.studio()
    plastic = stage.principled("Plastic", (0.3, 0.5, 0.7), Roughness=0.35)
    stage.add("Smooth", stage.sphere("Smooth", plastic, radius=0.6, segments=12), (-2.4, -0.6, 0.6))
    stage.add("Flat", stage.sphere("Flat", plastic, radius=0.6, segments=12, smooth=False), (-0.8, -0.6, 0.6))
    sharp = stage.cylinder("Sharp", plastic, radius=0.55, depth=1.2, segments=12, smooth=True)
    edges = sharp.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
    caps = [{tuple(sorted(pair)) for pair in face.edge_keys} for face in sharp.polygons if len(face.vertices) > 4]
    for edge in sharp.edges:
        edges.data[edge.index].value = any(tuple(sorted(edge.vertices)) in cap for cap in caps)
    stage.add("Sharp", sharp, (0.8, -0.6, 0.6), (0.4, 0, 0))
    stage.add("Custom", _bent_normals(plastic), (2.4, -0.6, 0.6), (0.9, 0, 0))
    slots = stage.cube(
        "Slots", plastic, stage.diffuse("Red", (0.7, 0.1, 0.1)), stage.diffuse("Green", (0.1, 0.6, 0.2)), size=0.9
    )
    slots.polygons.foreach_set("material_index", np.arange(6) % 3)
    stage.add("Slots", slots, (-1.6, 1.0, 0.6), (0.3, 0.2, 0.5))
    stage.add("Mirrored", stage.monkey("Mirrored", plastic), (0.2, 1.0, 0.75), (0, 0, 0.5), (-0.7, 0.7, 0.7))
    stage.add("Inside out", stage.monkey("Inside out", plastic), (1.9, 1.0, 0.75), (0, 0, -0.4), (0.5, 0.9, 0.7))


def _bent_normals(one: Any) -> Any:
    """A flat board that looks like a bowl."""
    board = stage.grid("Custom", one, size=1.2)
    board.polygons.foreach_set("use_smooth", np.ones(len(board.polygons), bool))
    points = np.array([v.co for v in board.vertices])
    board.normals_split_custom_set_from_vertices(np.column_stack([0.8 * points[:, :2], np.ones(len(points))]).tolist())
    return board


@case("Balls in the sun whose custom normals point up or aside, also into their faces; a lit leaf")
def leaning_normals() -> None:
    """Normals that are painted, or taken from another mesh, as foliage and characters have them."""
    stage.studio()
    bpy.data.objects["Key"].hide_render = bpy.data.objects["Rim"].hide_render = True
    stage.lamp("SUN", "Sun", 2.0, (3.0, -4.0, 5.0), (0, 0, 0))
    clay, metal = stage.diffuse("Clay", (0.7, 0.5, 0.4)), stage.principled("Metal", Metallic=1.0, Roughness=0.35)
    leaf = stage.simple("Leaf", "ShaderNodeBsdfTranslucent", {"Color": (0.4, 0.7, 0.2)})
    up, aside = (0, 0, 9), (1.5, 0, 0)
    for k, (name, one, lean) in enumerate(
        (("Up", clay, up), ("Aside", clay, aside), ("Metal", metal, up), ("Leaf", leaf, (0, 0, 0)))
    ):
        ball = stage.sphere(name, one, radius=0.6, segments=24)
        normals = np.array([v.normal for v in ball.vertices]) + lean
        ball.normals_split_custom_set_from_vertices(
            (normals / np.linalg.norm(normals, axis=1, keepdims=True)).tolist())  # fmt: skip
        stage.add(name, ball, (1.5 * (k - 1.5), 0.0, 0.8))


@case("Free normals of points, faces and corners, on meshes with some flat faces")
def free_normals() -> None:
    """Blender's window shows those of faces as flat faces; Cycles shows their means at the vertices."""
    stage.studio()
    plastic = stage.principled("Plastic", (0.3, 0.5, 0.7), Roughness=0.35)
    for k, domain in enumerate(("POINT", "FACE", "CORNER")):
        drum = stage.cylinder(domain, plastic, radius=0.6, depth=1.3, segments=9, smooth=True)
        drum.polygons.foreach_set("use_smooth", np.arange(len(drum.polygons)) % 4 > 0)
        owners = {"POINT": drum.vertex_normals, "FACE": drum.polygon_normals, "CORNER": drum.corner_normals}[domain]
        own = np.array([one.vector for one in owners])
        if domain == "CORNER":  # not all alike around a vertex
            own += np.random.default_rng(1).normal(0.0, 0.2, own.shape)
            edges = drum.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
            edges.data.foreach_set("value", np.arange(len(edges.data)) % 3 == 0)
        free = drum.attributes.new("custom_normal", "FLOAT_VECTOR", domain)
        free.data.foreach_set("vector", (own + (0.2, -0.1, 0.3)).astype(np.float32).ravel())
        stage.add(domain, drum, (1.7 * k - 1.7, 0, 0.7), (0.3, 0.2, 0))


@case("Sharp edges, which part islands and means of edge attributes: boxes and custom normals; Pointiness")
def sharp_islands() -> None:
    """Cycles renders these meshes as if their sharp edges were split, so that their sides are islands."""
    stage.studio()

    def shaded(by: str) -> Any:
        def shader(tree: Any) -> Any:
            info = stage.node(tree, "ShaderNodeNewGeometry")
            worn = stage.node(tree, "ShaderNodeAttribute", attribute_name="worn")
            value = worn.outputs["Fac"] if by == "worn" else info.outputs[by]
            hue = stage.node(tree, "ShaderNodeHueSaturation", {"Hue": value, "Color": (0.7, 0.3, 0.2)})
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": hue})

        return stage.material(by, shader)

    for k, by in enumerate(("Random Per Island", "worn", "Pointiness")):
        for custom in (False, True):
            name, seed = f"{by} {custom}", np.random.default_rng(3 * k + custom)
            made = shaded(by)
            body = stage.monkey(name, made) if custom else stage.cylinder(name, made, segments=9, smooth=True)
            edges = body.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
            edges.data.foreach_set("value", seed.random(len(body.edges)) < 0.4)
            body.polygons.foreach_set("use_smooth", seed.random(len(body.polygons)) < 0.8)
            worn = body.attributes.new("worn", "FLOAT", "EDGE")
            worn.data.foreach_set("value", seed.random(len(body.edges)).astype(np.float32))
            if custom:
                body.normals_split_custom_set([tuple(one.vector) for one in body.corner_normals])
            stage.add(name, body, (1.8 * k - 1.8, 1.2 - 2.0 * custom, 0.6), (0.2, 0.3, 0.1), 0.55)


@case("Instances: collections, geometry nodes-free parenting on faces, mirrored and scaled")
def instances() -> None:
    """A collection that is placed many times, and an object on the vertices of another."""
    stage.studio()
    group = bpy.data.collections.new("Group")
    one = stage.add("Part", stage.monkey("Part", stage.principled("Part", (0.7, 0.4, 0.2), Roughness=0.4)), scale=0.35)
    two = stage.add("Foot", stage.cube("Foot", stage.diffuse("Foot", (0.2, 0.5, 0.4)), size=0.5), (0, 0, -0.4))
    for ob in (one, two):
        bpy.context.scene.collection.objects.unlink(ob)
        group.objects.link(ob)
    for k in range(7):
        empty = stage.add(f"Place {k}", None, (0.95 * (k - 3), -0.4 - 0.1 * k, 0.65), (0, 0, 0.4 * k), 0.6 + 0.08 * k)
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    bpy.data.objects["Place 3"].scale = (-0.9, 0.9, 1.2)
    carrier = stage.add("Carrier", stage.grid("Carrier", size=5.0, cells=6), (0, 1.4, 0.3))
    carrier.instance_type = "VERTS"
    carrier.show_instancer_for_render = False
    child = stage.add(
        "Bead", stage.sphere("Bead", stage.principled("Bead", (0.2, 0.3, 0.7), Roughness=0.2), radius=0.2)
    )
    child.parent = carrier


@case("Curves, text, surfaces and metaballs, and modifiers as they render")
def converted() -> None:
    """What Blender turns into meshes."""
    stage.studio()
    paint = stage.principled("Paint", (0.6, 0.2, 0.3), Roughness=0.4)
    path = bpy.data.curves.new("Path", "CURVE")
    path.dimensions, path.bevel_depth, path.bevel_resolution = "3D", 0.12, 4
    spline = path.splines.new("BEZIER")
    spline.bezier_points.add(3)
    for k, point in enumerate(spline.bezier_points):
        point.co = (0.7 * (k - 1.5), 0.3 * (-1) ** k, 0.4 * (k % 2))
        point.handle_left_type = point.handle_right_type = "AUTO"
    path.materials.append(paint)
    stage.add("Path", path, (-1.8, -0.5, 0.3))
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.bevel_depth, text.align_x = "edge", 0.1, 0.02, "CENTER"
    text.materials.append(stage.diffuse("Ink", (0.1, 0.3, 0.6)))
    stage.add("Text", text, (0.9, -0.7, 0.3), (1.3, 0, 0))
    ball = bpy.data.metaballs.new("Meta")
    ball.render_resolution = ball.resolution = 0.12
    for x in (-0.35, 0.35):
        ball.elements.new().co = (x, 0, 0)
    ball.materials.append(paint)
    stage.add("Meta", ball, (-1.4, 1.2, 0.7), scale=0.6)
    box = stage.add("Rounded", stage.cube("Rounded", paint, size=0.9), (0.7, 1.2, 0.6), (0, 0, 0.4))
    divide = box.modifiers.new("Subdivision", "SUBSURF")
    divide.levels, divide.render_levels = 2, 2
    strip = stage.add("Array", stage.cube("Array", stage.diffuse("Strip", (0.3, 0.6, 0.3)), size=0.3), (1.8, 1.2, 0.4))
    array = strip.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace = 4, (0.3, 0.2, 1.1)

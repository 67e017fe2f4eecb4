"""Hair: particle systems with and without children, CURVES objects, point clouds."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case


def _set() -> None:
    """A floor, soft light and a camera near the origin, for small pictures."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.4, 0.4, 0.42)), size=20.0))
    stage.lamp("AREA", "Key", 250.0, (-3.0, -3.0, 4.0), (0, 0, 0.6), size=2.0)
    stage.world((0.4, 0.5, 0.65), 0.6)
    stage.camera((0.0, -4.5, 2.2), (0, 0, 0.75), 50.0)


def _grow(ob: Any, count: int, length: float, **settings: Any) -> Any:
    """Add a particle system of hair to an object, with the render's numbers in the viewport, too."""
    ob.modifiers.new("Hair", "PARTICLE_SYSTEM")
    made = ob.particle_systems[-1].settings
    made.type, made.count, made.hair_length = "HAIR", count, length
    for key, value in settings.items():
        setattr(made, key, value)
    made.display_step, made.display_percentage, made.child_percent = (
        made.render_step, 100, made.rendered_child_count)  # fmt: skip
    return made


@case("Hair of a particle system, as a beginner adds it: long, thick strands, the default Principled", bounces=2)
def hair_default() -> None:
    """A sphere with hair, all settings but number and length untouched."""
    _set()
    ob = stage.add("Head", stage.sphere("Head", stage.principled("Brown", (0.35, 0.2, 0.1)), radius=0.6, segments=32),
                   (0, 0, 0.7))
    _grow(ob, 400, 0.5)


@case("Fur of interpolated children, roughness and clumps; the hair has the second material", bounces=2, samples=64)
def fur() -> None:
    """Two materials, thin strands."""
    _set()
    ob = stage.add(
        "Body",
        stage.sphere("Body", stage.diffuse("Skin", (0.7, 0.5, 0.4)), stage.diffuse("Fur", (0.5, 0.3, 0.15)),
                     radius=0.7, segments=32),
        (0, 0, 0.75), (0.3, 0.2, 0))  # fmt: skip
    _grow(ob, 300, 0.25, child_type="INTERPOLATED", rendered_child_count=40, material=2, roughness_1=0.05,
          clump_factor=0.5, radius_scale=0.008, tip_radius=0.2)  # fmt: skip


@case("Grass on a plane of uneven scale that is itself hidden: curved strands, colour along them", bounces=2)
def grass() -> None:
    """Hair Info and the emitter's UV map in the material; Show Emitter off."""
    _set()

    def blade(tree: Any) -> Any:
        info = stage.node(tree, "ShaderNodeHairInfo")
        uv = stage.node(tree, "ShaderNodeUVMap")
        split = stage.node(tree, "ShaderNodeSeparateXYZ", {"Vector": uv})
        low = stage.node(tree, "ShaderNodeCombineColor", {"Red": split.outputs[0], "Green": 0.25, "Blue": 0.02})
        mix = stage.node(tree, "ShaderNodeMix", {0: info.outputs["Intercept"]}, data_type="RGBA")
        tree.links.new(low.outputs[0], mix.inputs[6])
        mix.inputs[7].default_value = (0.7, 0.8, 0.2, 1.0)
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": mix.outputs[2]})

    ob = stage.add("Lawn", stage.grid("Lawn", stage.material("Blade", blade), size=2.0, cells=4), (0, 0, 0.02),
                   scale=(1.0, 0.5, 0.6))
    ob.show_instancer_for_render = False
    made = _grow(ob, 500, 0.9, brownian_factor=0.25, radius_scale=0.03, root_radius=1.0, tip_radius=0.1, shape=0.3,
                 use_close_tip=False)
    made.child_type = "SIMPLE"
    made.rendered_child_count = made.child_percent = 3


@case("Hair that fades out: a Transparent shader mixed in by Hair Info's Intercept", bounces=2)
def fading_hair() -> None:
    """Rays pass a strand once."""
    _set()

    def fade(tree: Any) -> Any:
        info = stage.node(tree, "ShaderNodeHairInfo")
        body = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.4, 0.2, 0.1)})
        return stage.node(tree, "ShaderNodeMixShader", {0: info.outputs["Intercept"], 1: body,
                                                        2: stage.node(tree, "ShaderNodeBsdfTransparent")})  # fmt: skip

    ob = stage.add("Head", stage.sphere("Head", stage.material("Fade", fade), radius=0.6, segments=32), (0, 0, 0.7))
    _grow(ob, 400, 0.5, radius_scale=0.006, child_type="SIMPLE", rendered_child_count=12, tip_radius=0.3)


@case("Hair in a collection that is placed three times, once mirrored and once unevenly scaled; two systems", bounces=2)
def instanced_hair() -> None:
    """Instances share their strands."""
    _set()
    group = bpy.data.collections.new("Group")
    ob = stage.add(
        "Ball",
        stage.sphere("Ball", stage.diffuse("Brown", (0.4, 0.25, 0.1)), stage.diffuse("Blue", (0.1, 0.2, 0.6)),
                     radius=0.35, segments=24))  # fmt: skip
    bpy.context.scene.collection.objects.unlink(ob)
    group.objects.link(ob)
    _grow(ob, 250, 0.15, radius_scale=0.01)
    _grow(ob, 150, 0.3, radius_scale=0.01, material=2, child_type="INTERPOLATED", rendered_child_count=2)
    for k, scale in enumerate(((1, 1, 1), (-1.2, 1.2, 1.2), (1.0, 1.0, 0.5))):
        place = stage.add(f"Place {k}", None, (-1.2 + 1.2 * k, 0, 0.5), (0.2, 0.1 * k, 0.4), scale)
        place.instance_type, place.instance_collection = "COLLECTION", group


@case("Curves made by geometry nodes on meshes, which Cycles does not draw", bounces=2)
def node_curves() -> None:
    """Mesh to Curve with radii, and the same curves instanced on points: nothing but the floor is seen."""
    _set()
    paint = stage.principled("Wire", (0.7, 0.5, 0.1), Roughness=0.4)
    for k in range(2):
        tree = bpy.data.node_groups.new(f"Curves {k}", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        start = tree.nodes.new("NodeGroupInput")
        curve = stage.node(tree, "GeometryNodeMeshToCurve", {"Mesh": start.outputs[0]})
        wide = stage.node(tree, "GeometryNodeSetCurveRadius", {"Curve": curve, "Radius": 0.012})
        made = stage.node(tree, "GeometryNodeSetMaterial", {"Geometry": wide})
        made.inputs["Material"].default_value = paint
        if k:
            made = stage.node(tree, "GeometryNodeInstanceOnPoints",
                              {"Points": stage.node(tree, "GeometryNodeMeshLine", {"Count": 4}), "Instance": made,
                               "Scale": (0.5, 0.5, 0.8)})  # fmt: skip
        stage.node(tree, "NodeGroupOutput", {0: made})
        ob = stage.add(f"Wire {k}", stage.grid(f"Wire {k}", paint, size=1.0, cells=5), (-0.8 + 1.5 * k, 0, 0.6),
                       (1.1, 0.2, 0.3), 0.8)
        ob.modifiers.new("Curves", "NODES").node_group = tree


def _curves(kind: str, radius: float, numbers: int, place: float, paint: Any) -> None:
    """A CURVES object whose curves have five points and a hidden root."""
    data = bpy.data.hair_curves.new(kind)
    data.add_curves([5] * numbers)
    t = np.linspace(0.0, 1.0, 5)
    points = np.concatenate([
        np.stack([1.3 * n / numbers + place + 0.12 * np.sin(6.0 * t + n), 0.3 * np.cos(5.0 * t + 0.3 * n),
                  1.7 * t - 0.2], axis=1)
        for n in range(numbers)])  # fmt: skip
    data.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radii = data.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.tile(radius * (1.0 - 0.8 * t), numbers).astype(np.float32))
    data.set_types(type=kind)
    data.materials.append(paint)
    stage.add(kind, data)


@case("CURVES objects: thin smooth curves and poly curves", bounces=2)
def curves_object() -> None:
    """Catmull-Rom curves and poly curves of a few pixels."""
    _set()
    _curves("CATMULL_ROM", 0.02, 40, -1.35, stage.principled("Blue", (0.2, 0.3, 0.7), Roughness=0.4))
    _curves("POLY", 0.02, 20, 0.1, stage.principled("Red", (0.7, 0.3, 0.2), Roughness=0.4))


@case("Thick curves, drawn as tubes (Curves: 3D)", bounces=2)
def thick_curves() -> None:
    """Curves that are wide in the picture."""
    _set()
    bpy.context.scene.cycles_curves.shape = "THICK"
    _curves("CATMULL_ROM", 0.08, 4, -1.35, stage.principled("Blue", (0.2, 0.3, 0.7), Roughness=0.4))
    _curves("POLY", 0.08, 4, 0.1, stage.principled("Red", (0.7, 0.3, 0.2), Roughness=0.4))


RIBBONS = (
    "where curves are wide in the picture: Cycles' ribbons lie in the middle of the tubes whose normals they have, so "
    "that shadows and reflections near them start elsewhere; here curves are tubes"
)


@case("Thick curves as Cycles' default ribbons", bounces=2, differs=[RIBBONS])
def wide_ribbons() -> None:
    """The same as ribbons."""
    thick_curves()
    bpy.context.scene.cycles_curves.shape = "RIBBONS"


@case("Point clouds made by geometry nodes: spheres of many sizes", bounces=2)
def point_cloud() -> None:
    """Mesh to Points, with a material."""
    _set()
    for k, (radius, cells) in enumerate(((0.15, 4), (0.03, 24))):
        paint = stage.principled(f"Bead {k}", (0.7, 0.3 + 0.3 * k, 0.2), Roughness=0.5)
        tree = bpy.data.node_groups.new(f"Points {k}", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        start = tree.nodes.new("NodeGroupInput")
        made = stage.node(tree, "GeometryNodeMeshToPoints", {"Mesh": start.outputs[0], "Radius": radius})
        painted = stage.node(tree, "GeometryNodeSetMaterial", {"Geometry": made})
        painted.inputs["Material"].default_value = paint
        stage.node(tree, "NodeGroupOutput", {0: painted})
        ob = stage.add(f"Points {k}", stage.grid(f"Points {k}", paint, size=1.4, cells=cells),
                       (-0.9 + 1.8 * k, 0.2, 0.8), (0.7, 0.3, 0.0))
        ob.modifiers.new("Points", "NODES").node_group = tree

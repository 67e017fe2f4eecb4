"""Rooms, kitchens, bathrooms, streets and gardens as architects' files have them."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _box(size: Any = (5.0, 5.0, 2.8)) -> None:
    """A closed room of one mesh whose faces look inwards, with slots for floor, walls and ceiling."""
    floor = stage.principled("Parquet", (0.4, 0.25, 0.14), Roughness=0.35)
    wall = stage.principled("Plaster", (0.75, 0.73, 0.7), Roughness=0.9)
    ceiling = stage.principled("White", (0.85, 0.85, 0.85), Roughness=0.9)
    room = stage.cube("Room", floor, wall, ceiling, size=1.0)
    room.flip_normals()
    for face in room.polygons:
        face.material_index = 1 if abs(face.normal.z) < 0.5 else (0 if face.center.z < 0 else 2)
    stage.add("Room", room, (0, 0, 0.5 * size[2]), scale=size)
    stage.world((0.05, 0.05, 0.06), 1.0)


def _tiles(tree: Any, scale: float = 6.0) -> Any:
    uv = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
    return stage.node(
        tree,
        "ShaderNodeTexBrick",
        {
            "Vector": uv,
            "Color1": (0.8, 0.82, 0.8),
            "Color2": (0.7, 0.75, 0.75),
            "Mortar": (0.25, 0.25, 0.25),
            "Scale": scale,
            "Mortar Size": 0.03,
        },
        offset=0.0,
    )


def _tiled(name: str) -> Any:
    def shader(tree: Any) -> Any:
        brick = _tiles(tree)
        bump = stage.node(tree, "ShaderNodeBump", {"Height": brick.outputs["Fac"], "Strength": 0.5, "Distance": 0.05})
        bump.invert = True
        rough = stage.node(tree, "ShaderNodeMapRange", {"Value": brick.outputs["Fac"], 3: 0.08, 4: 0.7})
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": brick, "Roughness": rough, "Normal": bump})

    return stage.material(name, shader)


@case("A room with nineteen lamps of all kinds: downlights, strips, a sun through no window", bounces=4, samples=96)
def many_lamps() -> None:
    """Light chosen among many lamps of very different power."""
    _box()
    for k in range(12):
        x, y = -1.9 + 1.25 * (k % 4), -1.5 + 1.5 * (k // 4)
        stage.lamp(
            "SPOT" if k % 3 else "POINT",
            f"Downlight {k}",
            12.0 if k % 3 else 4.0,
            (x, y, 2.7),
            (x, y, 0),
            shadow_soft_size=0.04,
            color=(1.0, 0.85, 0.7),
        )
    for k in range(6):
        stage.lamp(
            "AREA",
            f"Strip {k}",
            3.0 + 5.0 * k,
            (-2.3, -2.0 + 0.8 * k, 0.4 + 0.3 * k),
            (0, 0, 1.0),
            shape="RECTANGLE",
            size=0.6,
            size_y=0.05,
        )
    stage.lamp("SUN", "Sun", 5.0).rotation_euler = (0.5, 0.3, 0)
    for k in range(4):
        stage.add(
            f"Chair {k}",
            stage.cube(f"Chair {k}", stage.principled(f"Wood {k}", (0.5 - 0.1 * k, 0.2, 0.1)), size=0.5),
            (-1.2 + 0.8 * k, 0.5 * (k % 2), 0.25),
            (0, 0, 0.4 * k),
        )
    stage.add(
        "Globe",
        stage.sphere("Globe", stage.principled("Chrome", Metallic=1.0, Roughness=0.08), radius=0.3),
        (0.8, -0.8, 0.3),
    )
    stage.camera((0.0, -2.35, 1.4), (0, 1.0, 1.0), 20.0)


@case(
    "A kitchen: tiles with bump, brushed steel, bottles of thin glass, a strip of light under a cupboard",
    bounces=8,
    samples=128,
)
def kitchen() -> None:
    """Glass of two walls, anisotropic metal."""
    _box((4.0, 3.0, 2.6))
    stage.add(
        "Splashback",
        stage.plane("Splashback", _tiled("Tiles"), size=1.0),
        (0, 1.48, 1.3),
        (math.pi / 2, 0, 0),
        (3.6, 0.8, 1.0),
    )
    stone = stage.principled("Granite", (0.08, 0.08, 0.09), Roughness=0.15, Specular_IOR_Level=0.6)
    stage.add("Top", stage.cube("Top", stone, size=1.0), (0, 1.15, 0.87), scale=(3.6, 0.7, 0.06))
    front = stage.principled("Lacquer", (0.7, 0.1, 0.08), Coat_Weight=0.8, Roughness=0.4)
    stage.add("Front", stage.cube("Front", front, size=1.0), (0, 1.2, 0.42), scale=(3.6, 0.6, 0.84))
    steel = stage.principled("Steel", (0.7, 0.7, 0.72), Metallic=1.0, Roughness=0.3, Anisotropic=0.7)
    stage.add("Pot", stage.cylinder("Pot", steel, radius=0.2, depth=0.3, segments=48, smooth=True), (0.8, 1.1, 1.05))
    glass = stage.principled("Glass", (0.95, 1.0, 0.97), Transmission_Weight=1.0, Roughness=0.0, IOR=1.5)
    for k in range(3):
        bottle = stage.add(
            f"Bottle {k}",
            stage.cylinder(f"Bottle {k}", glass, radius=0.08, top=0.05, depth=0.35, segments=24, smooth=True),
            (-0.9 + 0.3 * k, 1.1, 1.09),
        )
        bottle.modifiers.new("Solidify", "SOLIDIFY").thickness = 0.01
    stage.lamp("AREA", "Strip", 20.0, (0, 1.2, 1.75), (0, 1.2, 0), shape="RECTANGLE", size=3.0, size_y=0.04)
    stage.lamp("AREA", "Ceiling", 40.0, (0, 0, 2.5), (0, 0, 0), shape="DISK", size=0.6)
    stage.camera((0.0, -1.4, 1.5), (0, 1.2, 1.1), 24.0)


@case("A bathroom: a mirror, frosted glass, porcelain, a lamp with a picture", bounces=8, samples=128)
def bathroom() -> None:
    """A mirror sees the room again."""
    _box((3.0, 3.0, 2.5))
    stage.add(
        "Tiles", stage.plane("Tiles", _tiled("Tiles"), size=1.0), (0, 1.49, 1.0), (math.pi / 2, 0, 0), (3.0, 2.0, 1)
    )
    mirror = stage.simple("Mirror", "ShaderNodeBsdfGlossy", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.0})
    stage.add("Mirror", stage.cube("Mirror", mirror, size=1.0), (0.4, 1.46, 1.5), scale=(1.0, 0.03, 0.8))
    frosted = stage.simple(
        "Frosted", "ShaderNodeBsdfGlass", {"Roughness": 0.35, "IOR": 1.45, "Color": (0.8, 0.95, 0.9)}
    )
    stage.add("Screen", stage.cube("Screen", frosted, size=1.0), (-0.9, 0.6, 0.9), (0, 0, 0.2), (0.02, 1.2, 1.8))
    porcelain = stage.principled("Porcelain", (0.9, 0.9, 0.88), Roughness=0.05, Coat_Weight=0.3)
    stage.add("Basin", stage.sphere("Basin", porcelain, radius=0.3, segments=32), (0.4, 1.1, 0.8), scale=(1, 0.8, 0.4))
    lamp = stage.lamp("AREA", "Lamp", 50.0, (0.3, -0.3, 2.4), (0.3, 0.3, 0), shape="SQUARE", size=0.5)
    lamp.data.use_nodes = True
    stage.lamp("POINT", "Bulb", 6.0, (0.4, 1.3, 2.05), shadow_soft_size=0.05)
    stage.camera((0.2, -1.35, 1.4), (0, 1.2, 1.1), 24.0)


@case(
    "A street: Sky Texture with its sun, houses by Array, panes of glass in front of dark rooms", bounces=6, samples=96
)
def street() -> None:
    """Architecture by day."""
    tree = stage.world()
    sky = stage.node(tree, "ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation = 0.6, 2.2
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs[0])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.1
    stage.add("Road", stage.plane("Road", stage.principled("Asphalt", (0.12, 0.12, 0.13), Roughness=0.8), size=60.0))
    brick = stage.material(
        "Brick",
        lambda tree: stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {
                "Base Color": stage.node(
                    tree,
                    "ShaderNodeTexBrick",
                    {"Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["Object"], "Scale": 3.0},
                ),
                "Roughness": 0.85,
            },
        ),
    )
    house = stage.add("House", stage.cube("House", brick, size=1.0), (-4.0, 3.0, 1.5), scale=(1.8, 2.0, 3.0))
    rows = house.modifiers.new("Array", "ARRAY")
    rows.count, rows.relative_offset_displace = 4, (1.15, 0, 0)
    pane = stage.principled("Pane", (0.3, 0.4, 0.4), Alpha=0.25, Roughness=0.1)
    dark = stage.principled("Room", (0.05, 0.04, 0.03))
    for k in range(4):
        x = -4.0 + 2.07 * k
        stage.add(f"Room {k}", stage.plane(f"Room {k}", dark, size=1.0), (x, 1.995, 1.6), (math.pi / 2, 0, 0))
        stage.add(f"Pane {k}", stage.cube(f"Pane {k}", pane, size=1.0), (x, 1.93, 1.6), scale=(1.0, 0.02, 1.0))
    stage.camera((0.5, -6.0, 1.7), (-0.6, 3, 1.4), 28.0)


@case("A garden: leaves cut out by alpha, translucent light, blades scattered by Geometry Nodes", bounces=5, samples=96)
def garden() -> None:
    """Plants of planes."""
    stage.lamp("SUN", "Sun", 4.0, (0, 0, 5), angle=0.01).rotation_euler = (0.7, -0.4, 0.3)
    stage.world((0.5, 0.65, 0.9), 0.8)
    stage.add("Lawn", stage.plane("Lawn", stage.principled("Soil", (0.15, 0.12, 0.08), Roughness=1.0), size=20.0))
    y, x = np.mgrid[-1:1:64j, -1:1:64j]
    leaf = np.stack([0.15 + 0 * x, 0.4 + 0.2 * y, 0.05 + 0 * x, (np.abs(x) < 0.6 * np.cos(1.5 * y)) * 1.0], -1)
    picture = stage.image("Leaf", leaf)

    def shader(tree: Any) -> Any:
        found = stage.node(tree, "ShaderNodeTexImage", image=picture)
        both = stage.node(
            tree,
            "ShaderNodeAddShader",
            {
                0: stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": found, "Roughness": 0.6}),
                1: stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": found}),
            },
        )
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {0: found.outputs["Alpha"], 1: stage.node(tree, "ShaderNodeBsdfTransparent"), 2: both},
        )

    blade = stage.add("Blade", stage.plane("Blade", stage.material("Leaf", shader), size=0.5), (0, 0, -5))
    host = stage.add("Bush", stage.sphere("Bush", radius=0.9, segments=16), (0, 0, 1.0))
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    points = stage.node(tree, "GeometryNodeDistributePointsOnFaces", {"Mesh": start.outputs[0], "Density": 25.0})
    seen = stage.node(tree, "GeometryNodeObjectInfo", {"Object": blade})
    made = stage.node(
        tree,
        "GeometryNodeInstanceOnPoints",
        {
            "Points": points.outputs["Points"],
            "Instance": seen.outputs["Geometry"],
            "Rotation": points.outputs["Rotation"],
        },
    )
    tree.links.new(made.outputs[0], end.inputs[0])
    host.modifiers.new("Scatter", "NODES").node_group = tree
    stage.camera((0.0, -5.0, 1.8), (0, 0, 0.9), 42.0)


@case("Neon: bevelled curves that glow, a wet dark floor, text", bounces=4, samples=96)
def neon() -> None:
    """Emission of curves by Blackbody and colour, seen in a rough mirror."""
    stage.world((0.01, 0.01, 0.02), 1.0)

    def floor(tree: Any) -> Any:
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 3.0, "Detail": 4.0})
        ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": noise})
        ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.4, 0.6
        ramp.color_ramp.elements[0].color = (0.05, 0.05, 0.05, 1)
        ramp.color_ramp.elements[1].color = (0.5, 0.5, 0.5, 1)
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.05, 0.05, 0.06), "Roughness": ramp})

    stage.add("Floor", stage.plane("Floor", stage.material("Wet", floor), size=10.0))
    stage.add(
        "Wall",
        stage.plane("Wall", stage.principled("Wall", (0.3, 0.28, 0.3)), size=10.0),
        (0, 1.5, 0),
        (math.pi / 2, 0, 0),
    )
    warm = stage.material(
        "Warm",
        lambda tree: stage.node(
            tree,
            "ShaderNodeEmission",
            {"Color": stage.node(tree, "ShaderNodeBlackbody", {"Temperature": 2400.0}), "Strength": 12.0},
        ),
    )
    data = bpy.data.curves.new("Tube", "CURVE")
    data.dimensions, data.bevel_depth, data.bevel_resolution, data.resolution_u = "3D", 0.04, 2, 6
    line = data.splines.new("BEZIER")
    line.bezier_points.add(3)
    for k, point in enumerate(line.bezier_points):
        point.co = (-1.5 + k, 1.2, 1.0 + 0.5 * (k % 2))
        point.handle_left_type = point.handle_right_type = "AUTO"
    data.materials.append(warm)
    stage.add("Tube", data)
    words = bpy.data.curves.new("Words", "FONT")
    words.body, words.extrude, words.size = "OPEN", 0.04, 0.8
    words.materials.append(stage.emitter("Pink", (1.0, 0.1, 0.5), 5.0))
    stage.add("Words", words, (-1.0, 1.1, 0.25), (math.pi / 2, 0, 0))
    stage.add(
        "Ball",
        stage.sphere("Ball", stage.principled("Plastic", (0.3, 0.4, 0.6), Roughness=0.2), radius=0.35),
        (1.3, 0.3, 0.35),
    )
    stage.camera((0.0, -4.5, 1.4), (0, 1, 0.7), 35.0)

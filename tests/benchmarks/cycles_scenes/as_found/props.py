"""Props, vehicles and characters as kits and engines have them: few faces, smooth shading, packed textures."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _painted(name: str, seed: int, channels: int = 3, **settings: Any) -> Any:
    """A small texture of blocks."""
    blocks = np.random.default_rng(seed).uniform(0.15, 0.85, (12, 12, channels)).repeat(6, 0).repeat(6, 1)
    return stage.image(name, blocks, **settings)


def _dents() -> Any:
    x, y = np.meshgrid(*[np.linspace(0.0, 6.0 * np.pi, 96)] * 2)
    tilt = np.stack([0.5 + 0.15 * np.sin(x), 0.5 + 0.15 * np.cos(y), np.full_like(x, 0.95)], axis=-1)
    return stage.image("Dents", tilt, "Non-Color")


def _sun_and_sky(energy: float = 3.0, rotation: Any = (0.9, 0.1, 0.6)) -> None:
    stage.lamp("SUN", "Sun", energy, (0, 0, 5), angle=0.02).rotation_euler = rotation
    stage.world((0.45, 0.6, 0.85), 0.6)


def _on_the_ground(width: float = 5.0) -> None:
    stage.add("Ground", stage.plane("Ground", stage.principled("Soil", (0.3, 0.25, 0.2), Roughness=0.9), size=30.0))
    stage.camera((0.0, -width, 0.45 * width), (0, 0.0, 0.6), 40.0)


@case(
    "A lantern of few faces, shaded smooth: packed textures, a normal map, blended glass, a flame",
    bounces=5,
    samples=64,
)
def low_poly_lantern() -> None:
    """A prop of an engine's kit, in the sun."""
    _sun_and_sky()
    _on_the_ground()
    packed, base, dents = _painted("ORM", 1, colorspace="Non-Color"), _painted("Base", 2), _dents()

    def iron(tree: Any) -> Any:
        parts = stage.node(tree, "ShaderNodeSeparateColor", {0: stage.node(tree, "ShaderNodeTexImage", image=packed)})
        normal = stage.node(
            tree, "ShaderNodeNormalMap", {"Color": stage.node(tree, "ShaderNodeTexImage", image=dents), "Strength": 0.8}
        )
        return stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {
                "Base Color": stage.node(tree, "ShaderNodeTexImage", image=base),
                "Roughness": parts.outputs[1],
                "Metallic": parts.outputs[2],
                "Normal": normal,
            },
        )

    metal = stage.material("Iron", iron)
    for k, (radius, top, z, depth) in enumerate(((0.6, 0.5, 0.15, 0.3), (0.55, 0.1, 1.5, 0.5), (0.1, 0.1, 1.8, 0.2))):
        stage.add(
            f"Part {k}",
            stage.cylinder(f"Part {k}", metal, radius=radius, top=top, depth=depth, segments=8, smooth=True),
            (-0.3, 0, z),
        )
    pane = stage.principled("Pane", (0.7, 0.8, 0.75), Alpha=0.25, Roughness=0.15)
    stage.add("Panes", stage.cylinder("Panes", pane, radius=0.42, depth=0.95, segments=8, smooth=True), (-0.3, 0, 0.78))
    flame = stage.principled("Flame", (0, 0, 0), Emission_Color=(1.0, 0.5, 0.1, 1.0), Emission_Strength=8.0)
    stage.add("Flame", stage.sphere("Flame", flame, radius=0.12, segments=8), (-0.3, 0, 0.7), scale=(1, 1, 1.8))
    barrel = stage.cylinder("Barrel", metal, radius=0.45, depth=1.0, segments=10, smooth=True)
    stage.add("Barrel", barrel, (1.2, 0.6, 0.45), (math.pi / 2, 0, 0.5))


@case(
    "A character of few faces: skin with subsurface light, an armature, particle hair, eyes behind a cornea",
    bounces=4,
    samples=96,
)
def low_poly_character() -> None:
    """Bodies that a subdivision smooths, posed by bones."""
    stage.studio(width=4.5)
    skin = stage.principled(
        "Skin",
        (0.75, 0.5, 0.4),
        Subsurface_Weight=0.6,
        Subsurface_Scale=0.05,
        Subsurface_Radius=(1.0, 0.3, 0.15),
        Roughness=0.45,
    )
    head = stage.add("Head", stage.sphere("Head", skin, radius=0.55, segments=16), (0, 0, 1.35), scale=(0.9, 1.0, 1.1))
    head.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    hair = stage.principled("Hair", (0.12, 0.06, 0.03), Roughness=0.35)
    head.data.materials.append(hair)
    head.modifiers.new("Hair", "PARTICLE_SYSTEM")
    made = head.particle_systems[-1].settings
    made.type, made.count, made.hair_length, made.material = "HAIR", 500, 0.12, 2
    made.radius_scale = 0.01
    made.display_step = made.render_step
    cloth = stage.principled("Cloth", (0.15, 0.25, 0.5), Sheen_Weight=0.6, Roughness=0.8)
    body = stage.cylinder("Body", cloth, radius=0.55, top=0.3, depth=1.0, segments=10, smooth=True)
    trunk = stage.add("Body", body, (0, 0, 0.5))
    data = bpy.data.armatures.new("Bones")
    bones = stage.add("Bones", data)
    bpy.context.view_layer.objects.active = bones
    bpy.ops.object.mode_set(mode="EDIT")
    for k in range(2):
        bone = data.edit_bones.new(f"Bone {k}")
        bone.head, bone.tail = (0, 0, 0.5 * k), (0, 0, 0.5 * k + 0.5)
        if k:
            bone.parent = data.edit_bones[0]
    bpy.ops.object.mode_set(mode="OBJECT")
    bones.pose.bones[1].rotation_mode = "XYZ"
    bones.pose.bones[1].rotation_euler = (0.3, 0, 0.4)
    for k in range(2):
        group = trunk.vertex_groups.new(name=f"Bone {k}")
        group.add([v.index for v in body.vertices if (v.co.z > 0) == bool(k)], 1.0, "REPLACE")
    trunk.modifiers.new("Armature", "ARMATURE").object = bones
    white, iris = stage.principled("White", (0.8, 0.8, 0.8)), stage.principled("Iris", (0.05, 0.2, 0.3))
    cornea = stage.principled("Cornea", (1, 1, 1), Transmission_Weight=1.0, Roughness=0.0, IOR=1.35)
    for x in (-0.2, 0.2):
        ball = stage.sphere("Eye", white, iris, radius=0.11, segments=24)
        for face in ball.polygons:
            face.material_index = int(face.center.z > 0.09)
        stage.add("Eye", ball, (x, -0.48, 1.45), (1.4, 0, 0))
        stage.add("Cornea", stage.sphere("Cornea", cornea, radius=0.12, segments=24), (x, -0.48, 1.45))


@case("Ground of few faces, shaded smooth, under a low sun, with instances of coarse rocks", bounces=3, samples=64)
def low_sun_on_terrain() -> None:
    """Hills of an engine's level."""
    _sun_and_sky(4.0, (1.35, 0.0, 0.9))
    land = stage.grid("Land", stage.principled("Grass", (0.25, 0.35, 0.12), Roughness=0.95), size=12.0, cells=16)
    for vertex in land.vertices:
        vertex.co.z = 0.45 * math.sin(1.3 * vertex.co.x) * math.cos(1.1 * vertex.co.y)
    land.shade_smooth()
    stage.add("Land", land)
    rock = stage.sphere("Rock", stage.principled("Stone", (0.4, 0.38, 0.35)), radius=0.4, segments=8)
    shift = np.random.default_rng(4).uniform(-0.08, 0.08, (len(rock.vertices), 3))
    for vertex, by in zip(rock.vertices, shift, strict=True):
        vertex.co += vertex.co.__class__(by)
    for k in range(7):
        stage.add(f"Rock {k}", rock, (-3 + k, -1.5 + (k * 5 % 7) * 0.5, 0.3), (0.3 * k, 0.2, k), 0.6 + 0.1 * k)
    stage.camera((0.0, -7.0, 3.0), (0, 0, 0.1), 38.0)


@case(
    "A car: metallic paint with a coat and flakes, tinted glass, chrome, mirrored wheels, an image of a sky",
    bounces=8,
    samples=96,
)
def toy_car() -> None:
    """Two wheels have a negative scale."""
    stage.add("Ground", stage.plane("Ground", stage.principled("Asphalt", (0.1, 0.1, 0.1), Roughness=0.6), size=20.0))
    height, width = 32, 64
    y, x = np.mgrid[0:height, 0:width] + 0.5
    sky = np.stack([0.5 + 0.3 * np.sin(x / 10), 0.6 + 0.2 * np.cos(x / 8), 0.9 - 0.4 * y / height], -1)
    sky[3:8, 10:20] = 12.0
    stage.image_world(sky)

    def paint(tree: Any) -> Any:
        flakes = stage.node(tree, "ShaderNodeTexVoronoi", {"Scale": 60.0})
        normal = stage.node(tree, "ShaderNodeBump", {"Height": flakes, "Strength": 0.1})
        facing = stage.node(tree, "ShaderNodeLayerWeight", {"Blend": 0.4}).outputs["Facing"]
        mix = stage.node(tree, "ShaderNodeMixRGB", {0: facing, 1: (0.6, 0.02, 0.02), 2: (0.15, 0.0, 0.03)})
        return stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {
                "Base Color": mix,
                "Metallic": 0.7,
                "Roughness": 0.35,
                "Coat Weight": 1.0,
                "Coat Roughness": 0.05,
                "Normal": normal,
            },
        )

    body = stage.add(
        "Body", stage.cube("Body", stage.material("Paint", paint), size=1.0), (0, 0, 0.55), (0, 0, 0.5), (2.6, 1.2, 0.5)
    )
    edge = body.modifiers.new("Bevel", "BEVEL")
    edge.width, edge.segments = 0.12, 3
    body.data.shade_smooth()
    body.modifiers.new("Weighted", "WEIGHTED_NORMAL")
    glass = stage.simple("Tinted", "ShaderNodeBsdfGlass", {"Color": (0.5, 0.65, 0.6), "IOR": 1.45, "Roughness": 0.0})
    stage.add("Cabin", stage.cube("Cabin", glass, size=1.0), (0, 0, 0.98), (0, 0, 0.5), (1.3, 1.0, 0.4))
    rubber = stage.principled("Rubber", (0.03, 0.03, 0.03), Roughness=0.7)
    chrome = stage.principled("Chrome", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.05)
    wheel = stage.cylinder("Wheel", rubber, chrome, radius=0.35, depth=0.25, segments=20, smooth=True)
    for face in wheel.polygons:
        face.material_index = int(len(face.vertices) > 4)
    for k, (along, side) in enumerate(((-0.9, -0.6), (0.9, -0.6), (-0.9, 0.6), (0.9, 0.6))):
        x, y = along * math.cos(0.5) - side * math.sin(0.5), along * math.sin(0.5) + side * math.cos(0.5)
        stage.add(f"Wheel {k}", wheel, (x, y, 0.35), (math.pi / 2, 0, 0.5), (1, 1, math.copysign(1.0, side)))
    stage.camera((0.5, -5.5, 2.0), (0, 0, 0.5), 42.0)


@case("Rings of gold with cut stones: glass of high index, sharp and rough metal", bounces=12, samples=128)
def jewellery() -> None:
    """Facets, many bounces."""
    stage.studio(width=4.0)
    gold = stage.principled("Gold", (1.0, 0.7, 0.3), Metallic=1.0, Roughness=0.12)
    stone = stage.simple("Diamond", "ShaderNodeBsdfGlass", {"IOR": 2.4, "Roughness": 0.0})
    ruby = stage.principled("Ruby", (0.8, 0.05, 0.1), Transmission_Weight=1.0, Roughness=0.0, IOR=1.77)
    for k, gem in enumerate((stone, ruby)):
        x = -0.7 + 1.5 * k
        bpy.ops.mesh.primitive_torus_add(
            location=(x, 0, 0.5), rotation=(math.pi / 2, 0, 0.4 * k), major_radius=0.45, minor_radius=0.07
        )
        ring = bpy.context.object
        ring.data.materials.append(gold)
        ring.data.shade_smooth()
        stage.add(
            f"Crown {k}", stage.cylinder(f"Crown {k}", gem, radius=0.3, top=0.17, depth=0.14, segments=8), (x, 0, 1.16)
        )
        stage.add(
            f"Pavilion {k}",
            stage.cylinder(f"Pavilion {k}", gem, radius=0.0, top=0.3, depth=0.27, segments=8),
            (x, 0, 0.94),
        )

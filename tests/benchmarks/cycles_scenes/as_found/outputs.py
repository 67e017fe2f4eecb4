"""Outputs of nodes that depend on who asks: the ray, the object, the particle, the instance, the camera."""

from __future__ import annotations

import math
from typing import Any

import bpy

from .. import stage
from ..case import case


def _small(width: float = 5.5) -> None:
    """A small picture of the studio."""
    stage.studio(width=width)
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 96, 72


def _scaled(tree: Any, value: Any, factor: Any, offset: Any = (0.0, 0.0, 0.0)) -> Any:
    """The value times factor plus offset, as a vector."""
    return stage.node(tree, "ShaderNodeVectorMath", {0: value, 1: factor, 2: offset}, operation="MULTIPLY_ADD")


def _from(name: str, kind: str, output: str, factor: Any, offset: Any = (0.0, 0.0, 0.0), **settings: Any) -> Any:
    """A diffuse material whose colour is an output of a node, scaled."""

    def shader(tree: Any) -> Any:
        value = stage.node(tree, kind, **settings).outputs[output]
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": _scaled(tree, value, factor, offset)})

    return stage.material(name, shader)


def _particles(made: Any, at: float, name: str) -> None:
    """A plane that emits small cubes of this material, with sizes that differ."""
    carrier = stage.add(f"Carrier {name}", stage.grid(f"Carrier {name}", size=0.6, cells=4), (at, 0.0, 0.3))
    shown = stage.add(f"Seed {name}", stage.cube(f"Seed {name}", made, size=2.0), (0, 0, -50.0))
    settings = carrier.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 24, 1, 8, 40
    settings.lifetime_random = 0.5
    settings.render_type, settings.instance_object = "OBJECT", shown
    settings.particle_size, settings.size_random = 0.09, 0.6
    settings.normal_factor, settings.physics_type = 2.0, "NEWTON"
    settings.effector_weights.gravity = 0.2


@case("Particle Info: index, age, lifetime, place, size, velocity of emitted cubes", bounces=2, samples=64)
def particle_info() -> None:
    """Sparks that cool as they age."""
    _small()
    third = 1.0 / 24.0
    outputs = (
        ("Index", (third, 0.2, 0.2)),
        ("Age", (0.06, 0.02, 0.02)),
        ("Lifetime", (0.02, 0.01, 0.01)),
        ("Location", (0.5, 0.5, 0.5)),
        ("Size", (8.0, 4.0, 1.0)),
        ("Velocity", (0.4, 0.4, 0.4)),
        ("Random", (1.0, 0.5, 0.2)),
    )
    for k, (output, factor) in enumerate(outputs):
        _particles(_from(output, "ShaderNodeParticleInfo", output, factor), 0.75 * (k - 3), output)
    bpy.context.scene.frame_set(14)


@case(
    "Hair Info: strand, intercept, length, thickness, random",
    bounces=2,
    samples=64,
    differs=(
        "strands are thick for their length: Cycles' ribbons lie in the middle of the tubes that are rendered here",
    ),
)
def hair_info() -> None:
    """Coloured by where and which strand."""
    _small()
    outputs = (
        ("Intercept", (1.0, 0.3, 0.1)),
        ("Length", (1.2, 0.6, 0.2)),
        ("Thickness", (9.0, 4.0, 2.0)),
        ("Random", (1.0, 0.6, 0.3)),
        ("Is Strand", (0.1, 0.6, 0.3)),
    )
    for k, (output, factor) in enumerate(outputs):
        made = _from(output, "ShaderNodeHairInfo", output, factor)
        ball = stage.add(output, stage.sphere(output, made, radius=0.3, segments=24), (0.95 * (k - 2), 0, 0.4))
        settings = ball.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
        settings.type, settings.count, settings.hair_length = "HAIR", 250, 0.3
        settings.length_random = 0.6
        settings.root_radius, settings.tip_radius, settings.radius_scale = 1.0, 0.3, 0.05


@case("Camera Data: view vector, depth, distance, also in a mirror and in a camera of a scaled parent", bounces=3)
def camera_data() -> None:
    """Depth cues by nodes."""
    _small()
    stage.row(
        [
            _from("Vector", "ShaderNodeCameraData", "View Vector", (0.5, 0.5, 0.5), (0.4, 0.4, 0.2)),
            _from("Depth", "ShaderNodeCameraData", "View Z Depth", (0.08, 0.05, 0.02)),
            _from("Distance", "ShaderNodeCameraData", "View Distance", (0.02, 0.05, 0.08)),
        ]
    )
    mirror = stage.principled("Mirror", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.0)
    stage.add("Mirror", stage.plane("Mirror", mirror, size=6.0), (0, 1.6, 1.0), (math.pi / 2 - 0.2, 0, 0))
    rig = stage.add("Rig", None, (0.5, -0.3, 0.1), (0.0, 0.0, 0.05), (2.0, 2.0, 2.0))
    camera = bpy.context.scene.camera
    bpy.context.view_layer.update()
    placed = camera.matrix_world.copy()
    camera.parent = rig
    camera.matrix_world = placed


@case("Geometry: backfacing, incoming, normals, pointiness on open and closed, flat and smooth bodies", bounces=2)
def geometry_outputs() -> None:
    """Each output as a colour."""
    _small()
    node = "ShaderNodeNewGeometry"
    stage.row(
        [
            _from("Incoming", node, "Incoming", (0.5, 0.5, 0.5), (0.4, 0.4, 0.2)),
            _from("True", node, "True Normal", (0.4, 0.4, 0.4), (0.4, 0.4, 0.4)),
            _from("Normal", node, "Normal", (0.4, 0.4, 0.4), (0.4, 0.4, 0.4)),
            _from("Position", node, "Position", (0.3, 0.3, 0.3), (0.3, 0.3, 0.1)),
        ],
        y=-0.6,
        segments=12,
    )
    back = _from("Backfacing", node, "Backfacing", (0.6, 0.2, 0.1), (0.1, 0.2, 0.3))
    for k in range(3):
        card = stage.plane(f"Card {k}", back, size=0.9)
        turn, scale = (1.2 + math.pi * (k % 2), 0.2, 0.5 * k), (1, 1, 1 - 2 * (k == 2))
        stage.add(f"Card {k}", card, (-1.3 + 1.2 * k, 0.9, 0.6), turn, scale)
    pointed = _from("Pointiness", node, "Pointiness", (1.5, 1.0, 0.5), (-0.4, -0.2, 0.0))
    stage.add("Head", stage.monkey("Head", pointed, smooth=False), (2.0, 0.8, 0.8), (0, 0, 0.3), 0.6)


@case("Light Path: every yes-or-no output as the factor of a mix", bounces=4, samples=96)
def light_path_flags() -> None:
    """Materials that differ for kinds of rays, seen directly, in a mirror and through glass."""
    _small()

    def by(output: str) -> Any:
        def shader(tree: Any) -> Any:
            flag = stage.node(tree, "ShaderNodeLightPath").outputs[output]
            return stage.node(
                tree,
                "ShaderNodeMixShader",
                {
                    0: flag,
                    1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.5, 0.3)}),
                    2: stage.node(tree, "ShaderNodeBsdfTransparent", {"Color": (0.3, 0.6, 0.9)}),
                },
            )

        return stage.material(output, shader)

    flags = (
        "Is Camera Ray",
        "Is Shadow Ray",
        "Is Diffuse Ray",
        "Is Glossy Ray",
        "Is Singular Ray",
        "Is Reflection Ray",
        "Is Transmission Ray",
    )
    stage.row([by(flag) for flag in flags], y=-0.2, radius=0.3, z=0.35, gap=0.75)
    mirror = stage.principled("Mirror", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.0)
    rough = stage.principled("Rough", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.3)
    for k, made in enumerate((mirror, rough)):
        wall = stage.plane(made.name, made, size=3.0)
        stage.add(made.name, wall, (-1.5 + 3.0 * k, 1.2, 1.0), (math.pi / 2 - 0.2, 0, 0))
    glass = stage.simple("Glass", "ShaderNodeBsdfGlass", {"Roughness": 0.0, "IOR": 1.1})
    stage.add("Pane", stage.cube("Pane", glass, size=1.0), (0.0, -1.0, 0.3), (0, 0, 0), (4.0, 0.1, 0.3))


@case(
    "Wireframe: by pixels and by length, as lines and as holes",
    bounces=2,
    samples=64,
)
def wireframes() -> None:
    """The technical drawing."""
    _small()

    def lines(size: float, pixels: bool, holes: bool) -> Any:
        def shader(tree: Any) -> Any:
            wire = stage.node(tree, "ShaderNodeWireframe", {"Size": size}, use_pixel_size=pixels)
            body = "ShaderNodeBsdfTransparent" if holes else "ShaderNodeBsdfDiffuse"
            return stage.node(
                tree,
                "ShaderNodeMixShader",
                {
                    0: wire,
                    1: stage.node(tree, body),
                    2: stage.node(tree, "ShaderNodeEmission", {"Color": (0.1, 0.7, 0.3)}),
                },
            )

        return stage.material(f"{size} {pixels} {holes}", shader)

    stage.row(
        [lines(0.03, False, False), lines(1.5, True, False), lines(0.05, False, True), lines(0.4, True, True)],
        segments=10,
        smooth=False,
    )
    stage.add(
        "Pipe",
        stage.cylinder("Pipe", lines(0.04, False, False), radius=0.4, depth=0.9, segments=7),
        (0.0, 1.4, 0.5),
        (0.4, 0.3, 0),
    )


@case("Object Info of nested instances: random, colour, alpha, place; Attribute of instancers", bounces=2)
def instance_info() -> None:
    """Collections of collections, coloured by instance."""
    _small()
    inner, outer = (bpy.data.collections.new(name) for name in ("Inner", "Outer"))
    outputs = (
        ("Random", (1.0, 0.6, 0.2)),
        ("Color", (1.0, 1.0, 1.0)),
        ("Alpha", (0.2, 0.8, 0.4)),
        ("Location", (0.25, 0.25, 0.25)),
    )
    for k, (output, factor) in enumerate(outputs):
        offset = (0.3, 0.3, 0.3) if output == "Location" else (0.0, 0.0, 0.0)
        made = _from(output, "ShaderNodeObjectInfo", output, factor, offset)
        ob = bpy.data.objects.new(output, stage.cube(output, made, size=0.4))
        ob.location, ob.color = (0.55 * k, 0.0, 0.25), (0.2 * k, 0.5, 0.9 - 0.2 * k, 0.3 + 0.2 * k)
        inner.objects.link(ob)
    for k in range(2):
        empty = bpy.data.objects.new(f"Inner {k}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
        empty.location, empty.color = (0.0, 0.7 * k, 0.0), (0.9, 0.1, 0.1, 0.9)
        outer.objects.link(empty)
    for k in range(2):
        empty = stage.add(f"Outer {k}", None, (-1.9 + 2.1 * k, -0.6, 0.0), (0, 0, 0.1 * k), (1, 1 - 2.0 * k, 1))
        empty.instance_type, empty.instance_collection = "COLLECTION", outer
        empty.color = (0.1, 0.9, 0.1, 0.5)


@case("Lamps and glowing meshes within collection instances, turned, mirrored and scaled", bounces=2, samples=64)
def instanced_lamps() -> None:
    """Street lamps."""
    _small()
    bpy.data.objects["Key"].data.energy = 40.0
    bpy.data.objects["Rim"].data.energy = 10.0
    posts = bpy.data.collections.new("Post")
    pole = bpy.data.objects.new("Pole", stage.cylinder("Pole", stage.diffuse("Pole"), radius=0.06, depth=1.2))
    glow = stage.emitter("Bulb", (1, 0.7, 0.4), 8.0)
    bulb = bpy.data.objects.new("Bulb", stage.sphere("Bulb", glow, radius=0.1, segments=16))
    spot = bpy.data.objects.new("Spot", bpy.data.lights.new("Spot", "SPOT"))
    spot.data.energy, spot.data.spot_size, spot.data.shadow_soft_size = 40.0, 1.0, 0.05
    area = bpy.data.objects.new("Area", bpy.data.lights.new("Area", "AREA"))
    area.data.energy, area.data.shape, area.data.size, area.data.size_y = 6.0, "RECTANGLE", 0.3, 0.1
    pole.location, bulb.location = (0, 0, 0.6), (0.2, 0, 1.2)
    spot.location, area.location = (-0.2, 0, 1.2), (0, 0.2, 1.1)
    spot.rotation_euler, area.rotation_euler = (0.0, -0.4, 0.0), (0.5, 0.2, 0.0)
    for ob in (pole, bulb, spot, area):
        posts.objects.link(ob)
    for k, scale in enumerate(((1, 1, 1), (-1, 1, 1), (0.7, 0.7, 0.7))):
        empty = stage.add(f"Post {k}", None, (-1.6 + 1.6 * k, 0.3, 0.0), (0, 0, 0.5 * k), scale)
        empty.instance_type, empty.instance_collection = "COLLECTION", posts
    stage.row([stage.diffuse("Chalk"), stage.principled("Plastic", (0.3, 0.4, 0.7))], y=-0.7, radius=0.35, z=0.35)

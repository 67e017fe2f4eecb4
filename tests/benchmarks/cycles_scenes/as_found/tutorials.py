"""Files of tutorials and old versions: node trees of 2.7, materials of many users, animation, cloth, wood."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


@case(
    "Materials of 2.7: Diffuse and Glossy mixed by Fresnel, ramps, RGB Curves, Layer Weight, bump of two textures",
    bounces=4,
    samples=64,
)
def trees_of_27() -> None:
    """What was usual before Principled."""
    stage.studio(width=5.5)

    def varnish(tree: Any) -> Any:
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 8.0, "Detail": 3.0})
        ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": noise})
        ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.5, 0.2, 0.05, 1), (0.1, 0.03, 0.01, 1)
        curves = stage.node(tree, "ShaderNodeRGBCurve", {"Color": ramp})
        curves.mapping.curves[3].points[1].location = (1.0, 0.8)
        curves.mapping.update()
        bump = stage.node(tree, "ShaderNodeBump", {"Height": noise, "Strength": 0.3})
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: stage.node(tree, "ShaderNodeFresnel", {"IOR": 1.5, "Normal": bump}),
                1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": curves, "Roughness": 0.3, "Normal": bump}),
                2: stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.2, "Normal": bump}),
            },
        )

    def plastic(tree: Any) -> Any:
        weight = stage.node(tree, "ShaderNodeLayerWeight", {"Blend": 0.3})
        color = stage.node(tree, "ShaderNodeHueSaturation", {"Hue": 0.6, "Saturation": 0.8, "Color": (0.7, 0.2, 0.2)})
        inner = stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: weight.outputs["Facing"],
                1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color}),
                2: stage.node(
                    tree,
                    "ShaderNodeBsdfSheen" if hasattr(bpy.types, "ShaderNodeBsdfSheen") else "ShaderNodeBsdfVelvet",
                    {"Color": (0.8, 0.7, 0.9)},
                ),
            },
        )
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {0: weight.outputs["Fresnel"], 1: inner, 2: stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.05})},
        )

    def wax(tree: Any) -> Any:
        return stage.node(
            tree,
            "ShaderNodeAddShader",
            {
                0: stage.node(
                    tree,
                    "ShaderNodeMixShader",
                    {
                        0: 0.3,
                        1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.5, 0.4, 0.2)}),
                        2: stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": (0.8, 0.5, 0.2)}),
                    },
                ),
                1: stage.node(tree, "ShaderNodeEmission", {"Color": (1.0, 0.4, 0.1), "Strength": 0.2}),
            },
        )

    def marble(tree: Any) -> Any:
        where = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
        wave = stage.node(tree, "ShaderNodeTexWave", {"Vector": where, "Scale": 2.0, "Distortion": 6.0, "Detail": 3.0})
        gamma = stage.node(tree, "ShaderNodeGamma", {"Color": wave, "Gamma": 2.2})
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: 0.1,
                1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": gamma}),
                2: stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.1}),
            },
        )

    stage.row([stage.material(one.__name__, one) for one in (varnish, plastic, wax, marble)], radius=0.6)


@case(
    "Materials of many users: slots of objects, Random and Color of objects, collections as instances",
    bounces=3,
    samples=64,
)
def many_users() -> None:
    """One mesh, six objects; a collection that is shown three times."""
    stage.studio(width=6.0)

    def tinted(tree: Any) -> Any:
        info = stage.node(tree, "ShaderNodeObjectInfo")
        hue = stage.node(tree, "ShaderNodeHueSaturation", {"Hue": info.outputs["Random"], "Color": (0.7, 0.2, 0.2)})
        mix = stage.node(tree, "ShaderNodeMixRGB", {0: 0.7, 1: hue, 2: info.outputs["Color"]}, blend_type="MULTIPLY")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": mix, "Roughness": 0.4})

    one, other = stage.material("Tinted", tinted), stage.principled("Gold", (1.0, 0.7, 0.3), Metallic=1.0)
    mesh = stage.monkey("Shared", one)
    for k in range(6):
        ob = stage.add(f"Head {k}", mesh, (-2.2 + 0.9 * k, -0.6, 0.5), (0, 0, 0.3 * k - 0.7), 0.4)
        ob.color = (1.0, 1.0 - 0.15 * k, 0.5, 1.0)
        if k % 3 == 2:
            ob.material_slots[0].link = "OBJECT"
            ob.material_slots[0].material = other
    group = bpy.data.collections.new("Kit")
    for k in range(2):
        part = bpy.data.objects.new(f"Part {k}", stage.cube(f"Part {k}", one if k else other, size=0.5))
        part.location = (0, 0, 0.25 + 0.5 * k)
        part.rotation_euler.z = 0.5 * k
        group.objects.link(part)
    for k in range(3):
        shown = stage.add(f"Kit {k}", None, (-1.5 + 1.5 * k, 1.2, 0.0), (0, 0, 0.4 * k), 1.0 + 0.2 * k)
        shown.instance_type, shown.instance_collection = "COLLECTION", group


@case("An animation at frame 15: NLA strips, a driver, shape keys, parents, constraints", bounces=3, samples=64)
def nla() -> None:
    """Where things are is decided by several parts of Blender."""
    stage.studio(width=5.5)
    scene = bpy.context.scene
    ball = stage.add("Ball", stage.sphere("Ball", stage.principled("Red", (0.7, 0.1, 0.1)), radius=0.5))
    for frame, x in ((1, -2.0), (20, 0.0)):
        ball.location = (x, -0.4, 0.5)
        ball.keyframe_insert("location", frame=frame)
    action = ball.animation_data.action
    strip = ball.animation_data.nla_tracks.new().strips.new("Move", 1, action)
    strip.scale = 1.5
    ball.animation_data.action = None
    shape = stage.add(
        "Shape", stage.monkey("Shape", stage.principled("Blue", (0.1, 0.2, 0.6))), (0.8, 0.2, 0.7), scale=0.6
    )
    shape.shape_key_add(name="Basis")
    key = shape.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 1.5
    made = shape.data.shape_keys.key_blocks["Wide"].driver_add("value")
    made.driver.expression = "frame / 20"
    child = stage.add("Child", stage.cube("Child", stage.principled("Green", (0.1, 0.5, 0.2)), size=0.4), (0, 0, 0.9))
    child.parent = ball
    tracker = stage.add(
        "Tracker",
        stage.cylinder("Tracker", stage.principled("Grey"), radius=0.2, top=0.05, depth=0.8),
        (2.0, -0.6, 0.5),
    )
    follow = tracker.constraints.new("TRACK_TO")
    follow.target, follow.track_axis, follow.up_axis = ball, "TRACK_Z", "UP_Y"
    scene.frame_set(15)


@case("Cloth: a curtain in front of the sun, velvet, a lampshade with a bulb within", bounces=5, samples=96)
def cloth() -> None:
    """Light that comes through."""
    stage.add("Floor", stage.plane("Floor", stage.principled("Floor", (0.4, 0.35, 0.3), Roughness=0.5), size=12.0))
    stage.world((0.15, 0.18, 0.25), 1.0)
    stage.lamp("SUN", "Sun", 5.0, (0, 0, 5), angle=0.02).rotation_euler = (-0.9, 0.2, 0)

    def curtain(tree: Any) -> Any:
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: 0.5,
                1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.75, 0.65)}),
                2: stage.node(
                    tree,
                    "ShaderNodeMixShader",
                    {
                        0: 0.3,
                        1: stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": (0.8, 0.7, 0.5)}),
                        2: stage.node(tree, "ShaderNodeBsdfTransparent"),
                    },
                ),
            },
        )

    hanging = stage.grid("Curtain", stage.material("Curtain", curtain), size=3.0, cells=48)
    for vertex in hanging.vertices:
        vertex.co.z = 0.12 * math.sin(9.0 * vertex.co.x)
    hanging.shade_smooth()
    stage.add("Curtain", hanging, (-0.9, 1.2, 1.5), (math.pi / 2, 0, 0))
    velvet = stage.principled(
        "Velvet", (0.25, 0.02, 0.08), Sheen_Weight=1.0, Sheen_Tint=(0.9, 0.3, 0.4, 1.0), Roughness=0.9
    )
    pillow = stage.add("Pillow", stage.cube("Pillow", velvet, size=0.9), (0.3, 0.0, 0.35), (0, 0, 0.4), (1, 1, 0.6))
    pillow.modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    shade = stage.material(
        "Shade",
        lambda tree: stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: 0.6,
                1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.9, 0.8, 0.6)}),
                2: stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": (0.9, 0.7, 0.4)}),
            },
        ),
    )
    cone = stage.cylinder("Shade", shade, radius=0.4, top=0.25, depth=0.5, segments=12, smooth=True)
    lamp = stage.add("Shade", cone, (1.7, 0.3, 1.2))
    lamp.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    stage.lamp("POINT", "Bulb", 15.0, (1.7, 0.3, 1.2), shadow_soft_size=0.06)
    stage.camera((0.2, -5.0, 1.6), (0.2, 0.5, 1.0), 38.0)


@case(
    "Colours of vertices: faces of one colour, float and byte layers, per point and per corner, named attributes",
    bounces=3,
    samples=64,
)
def vertex_colors() -> None:
    """An island without textures."""
    stage.studio(width=5.5)

    def shader(layer: str, kind: str) -> Any:
        def made(tree: Any) -> Any:
            if kind == "attribute":
                found = stage.node(tree, "ShaderNodeAttribute", attribute_name=layer).outputs["Color"]
            else:
                found = stage.node(tree, "ShaderNodeVertexColor", layer_name=layer).outputs[0]
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": found, "Roughness": 0.6})

        return stage.material(f"{layer} {kind}", made)

    kinds = (
        ("FLOAT_COLOR", "POINT", "Col", "node"),
        ("BYTE_COLOR", "CORNER", "Col", "attribute"),
        ("FLOAT_COLOR", "CORNER", "Paint", "node"),
        ("BYTE_COLOR", "POINT", "Paint", ""),
    )
    for k, (data, domain, layer, kind) in enumerate(kinds):
        # The last material names no layer: the active one is used.
        body = stage.sphere(
            f"Body {k}", shader(layer if kind else "", kind or "node"), radius=0.6, segments=12, smooth=False
        )
        made = body.color_attributes.new(layer, data, domain)
        values = np.random.default_rng(k).uniform(0.05, 0.95, (len(made.data), 4)).astype(np.float32)
        made.data.foreach_set("color", values.ravel())
        stage.add(f"Body {k}", body, (-2.0 + 1.33 * k, 0, 0.6))


@case(
    "Wood and rust by procedures: noise into noise, object coordinates, Map Range, Mix of shaders by masks",
    bounces=3,
    samples=64,
)
def procedures() -> None:
    """Tutorial materials on bevelled boxes."""
    stage.studio(width=5.0)

    def wood(tree: Any) -> Any:
        where = stage.node(tree, "ShaderNodeTexCoord").outputs["Object"]
        long = stage.node(
            tree, "ShaderNodeMapping", {"Vector": where, "Scale": (1.0, 1.0, 8.0), "Rotation": (0, 0.4, 0.2)}
        )
        first = stage.node(tree, "ShaderNodeTexNoise", {"Vector": long, "Scale": 2.0, "Detail": 6.0, "Distortion": 0.5})
        rings = stage.node(
            tree, "ShaderNodeTexWave", {"Vector": first.outputs["Color"], "Scale": 4.0, "Distortion": 2.0}
        )
        ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": rings})
        ramp.color_ramp.interpolation = "B_SPLINE"
        ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (
            (0.2, 0.08, 0.02, 1),
            (0.55, 0.3, 0.12, 1),
        )
        ramp.color_ramp.elements.new(0.6).color = (0.4, 0.18, 0.06, 1)
        rough = stage.node(tree, "ShaderNodeMapRange", {"Value": rings, 3: 0.35, 4: 0.6})
        bump = stage.node(tree, "ShaderNodeBump", {"Height": rings, "Strength": 0.15, "Distance": 0.1})
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": ramp, "Roughness": rough, "Normal": bump})

    def rust(tree: Any) -> Any:
        where = stage.node(tree, "ShaderNodeTexCoord").outputs["Object"]
        noise = stage.node(
            tree, "ShaderNodeTexNoise", {"Vector": where, "Scale": 2.5, "Detail": 10.0, "Roughness": 0.6}
        )
        mask = stage.node(
            tree, "ShaderNodeMapRange", {"Value": noise, 1: 0.45, 2: 0.55}, interpolation_type="SMOOTHSTEP"
        )
        cells = stage.node(tree, "ShaderNodeTexVoronoi", {"Vector": where, "Scale": 12.0}, feature="SMOOTH_F1")
        color = stage.node(tree, "ShaderNodeMix", {0: cells.outputs["Distance"]}, data_type="RGBA")
        color.inputs[6].default_value, color.inputs[7].default_value = (0.15, 0.04, 0.01, 1), (0.4, 0.15, 0.05, 1)
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: mask,
                1: stage.node(
                    tree,
                    "ShaderNodeBsdfPrincipled",
                    {"Metallic": 1.0, "Base Color": (0.6, 0.6, 0.62), "Roughness": 0.25},
                ),
                2: stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": color.outputs[2], "Roughness": 0.9}),
            },
        )

    def checks(tree: Any) -> Any:
        uv = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
        checker = stage.node(tree, "ShaderNodeTexChecker", {"Vector": uv, "Scale": 6.0})
        gradient = stage.node(tree, "ShaderNodeTexGradient", {"Vector": uv}, gradient_type="SPHERICAL")
        mix = stage.node(tree, "ShaderNodeMixRGB", {0: gradient, 1: checker, 2: (0.1, 0.5, 0.3)}, blend_type="OVERLAY")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": mix, "Specular IOR Level": 0.2})

    for k, one in enumerate((wood, rust, checks)):
        box = stage.add(
            one.__name__,
            stage.cube(one.__name__, stage.material(one.__name__, one), size=1.0),
            (-1.5 + 1.5 * k, 0, 0.5),
            (0, 0, 0.5),
        )
        edge = box.modifiers.new("Bevel", "BEVEL")
        edge.width, edge.segments = 0.08, 4
        box.data.shade_smooth()
        angle = box.modifiers.new("Weighted", "WEIGHTED_NORMAL")
        angle.keep_sharp = True

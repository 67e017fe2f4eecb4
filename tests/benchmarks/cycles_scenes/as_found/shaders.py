"""Set-ups of shader nodes from tutorials: glows, dirt, drinks, brushed metal, projected pictures."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


@case("Brushed metal: tangents around an axis and along UVs, in Glossy, Metallic and Principled", samples=64)
def brushed_metal() -> None:
    """The Tangent node."""
    stage.studio(width=6.0)

    def brushed(kind: str, axis: str) -> Any:
        def shader(tree: Any) -> Any:
            settings: dict[str, Any] = {"direction_type": "UV_MAP"} if axis == "UV" else {"axis": axis}
            tangent = stage.node(tree, "ShaderNodeTangent", **settings)
            inputs: dict[str, Any] = {"Tangent": tangent, "Roughness": 0.35}
            if kind == "Principled":
                return stage.node(
                    tree,
                    "ShaderNodeBsdfPrincipled",
                    inputs
                    | {"Base Color": (0.8, 0.6, 0.4), "Metallic": 1.0, "Anisotropic": 0.8, "Anisotropic Rotation": 0.1},
                )
            return stage.node(tree, f"ShaderNodeBsdf{kind}", inputs | {"Anisotropy": 0.8})

        return stage.material(f"{kind} {axis}", shader)

    made = [brushed("Principled", "Z"), brushed("Principled", "X"), brushed("Glossy", "Y"), brushed("Metallic", "UV")]
    stage.row(made, gap=1.25)
    pot = stage.cylinder("Pot", brushed("Principled", "UV"), radius=0.6, depth=0.8, segments=48, smooth=True)
    stage.add("Pot", pot, (0.0, 1.6, 0.4), (0, 0, 0.3), (1.0, 0.7, 1.0))


@case(
    "Cards that glow: emission mixed with transparency by a gradient, added to it, and on front faces only", bounces=4
)
def glowing_cards() -> None:
    """Flames, holograms and screens."""
    stage.studio(width=6.0)

    def flame(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
        fade = stage.node(tree, "ShaderNodeTexGradient", {"Vector": place}, gradient_type="QUADRATIC")
        ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": fade})
        ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0.2, 0.0, 1), (1, 0.9, 0.4, 1)
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: fade,
                1: stage.node(tree, "ShaderNodeBsdfTransparent"),
                2: stage.node(tree, "ShaderNodeEmission", {"Color": ramp, "Strength": 3.0}),
            },
        )

    def hologram(tree: Any) -> Any:
        rim = stage.node(tree, "ShaderNodeLayerWeight", {"Blend": 0.4}).outputs["Facing"]
        glow = stage.node(tree, "ShaderNodeMath", {0: rim, 1: 2.0}, operation="MULTIPLY")
        return stage.node(
            tree,
            "ShaderNodeAddShader",
            {
                0: stage.node(tree, "ShaderNodeBsdfTransparent", {"Color": (0.7, 0.9, 1.0)}),
                1: stage.node(tree, "ShaderNodeEmission", {"Color": (0.1, 0.5, 1.0), "Strength": glow}),
            },
        )

    def screen(tree: Any) -> Any:
        back = stage.node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
        lines = stage.node(tree, "ShaderNodeTexChecker", {"Scale": 6.0})
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {
                0: back,
                1: stage.node(tree, "ShaderNodeEmission", {"Color": lines, "Strength": 2.0}),
                2: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.05, 0.05, 0.05)}),
            },
        )

    for k, shader in enumerate((flame, screen, screen)):
        card = stage.plane(f"Card {k}", stage.material(f"{shader.__name__} {k}", shader), size=1.3)
        stage.add(f"Card {k}", card, (-1.8 + 1.5 * k, 0.2, 0.8), (math.pi / 2, 0, 0.3 + (2.6 if k == 2 else 0.0)))
    stage.add("Head", stage.monkey("Head", stage.material("Hologram", hologram)), (2.2, -0.2, 0.8), (0, 0, 0.3), 0.7)


@case("Light Path: ray length, depths of diffuse, glossy and transparent bounces", bounces=5, samples=96)
def ray_depths() -> None:
    """Tricks that make reflections darker, fog by ray length, and x-ray views."""
    stage.studio(width=5.5)

    def by(output: str, factor: float) -> Any:
        def shader(tree: Any) -> Any:
            path = stage.node(tree, "ShaderNodeLightPath").outputs[output]
            amount = stage.node(tree, "ShaderNodeMath", {0: path, 1: factor}, operation="MULTIPLY", use_clamp=True)
            return stage.node(
                tree,
                "ShaderNodeMixShader",
                {
                    0: amount,
                    1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.5, 0.3)}),
                    2: stage.node(tree, "ShaderNodeEmission", {"Color": (0.1, 0.3, 0.8), "Strength": 0.6}),
                },
            )

        return stage.material(output, shader)

    mirror = stage.principled("Mirror", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.0)
    veil = stage.simple("Veil", "ShaderNodeBsdfTransparent", {"Color": (0.9, 0.7, 0.7)})
    stage.row(
        [by("Ray Length", 0.12), by("Ray Depth", 0.5), by("Glossy Depth", 0.6), by("Transparent Depth", 0.5)],
        y=-0.2,
        gap=1.25,
    )
    stage.add("Mirror", stage.plane("Mirror", mirror, size=6.0), (0, 1.6, 1.0), (math.pi / 2 - 0.2, 0, 0))
    stage.add("Veil", stage.plane("Veil", veil, size=0.9), (1.8, -1.0, 0.7), (math.pi / 2, 0, 0))


@case("A drink: water that overlaps its glass, an ice cube, a straw; no volumes", bounces=12, samples=128)
def drink() -> None:
    """Nested dielectrics as tutorials model them."""
    stage.studio(width=4.0)
    glass = stage.principled("Glass", (1, 1, 1), Transmission_Weight=1.0, Roughness=0.0, IOR=1.45)
    water = stage.principled("Water", (0.8, 0.95, 0.9), Transmission_Weight=1.0, Roughness=0.0, IOR=1.33)
    tumbler = stage.add(
        "Tumbler", stage.cylinder("Tumbler", glass, radius=0.6, depth=1.4, segments=64, smooth=True), (-0.4, 0, 0.71)
    )
    tumbler.data.shade_smooth() if hasattr(tumbler.data, "shade_smooth") else None
    stage.add(
        "Hollow", stage.cylinder("Water", water, radius=0.52, depth=1.0, segments=64, smooth=True), (-0.4, 0, 0.62)
    )
    ice = stage.add("Ice", stage.cube("Ice", glass, size=0.4), (-0.3, 0.05, 1.05), (0.4, 0.3, 0.2))
    bevel = ice.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.04, 2
    straw = stage.cylinder("Straw", stage.diffuse("Straw", (0.8, 0.1, 0.1)), radius=0.05, depth=2.0)
    stage.add("Straw", straw, (-0.2, 0.1, 1.1), (0.0, 0.3, 0.0))
    stage.add(
        "Lemon",
        stage.sphere("Lemon", stage.principled("Lemon", (0.8, 0.7, 0.1), Subsurface_Weight=0.0), radius=0.35),
        (1.0, -0.2, 0.35),
    )


@case("A gobo: a spot and a point that project textures by the Normal coordinate", samples=96)
def gobo() -> None:
    """A window's shadow from a picture in the nodes of a lamp."""
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.6, 0.6, 0.6)), size=12.0))
    stage.add(
        "Wall", stage.plane("Wall", stage.diffuse("Wall", (0.6, 0.55, 0.5)), size=12.0), (0, 3, 0), (1.5708, 0, 0)
    )
    stage.add("Ball", stage.sphere("Ball", stage.principled("Ball", (0.3, 0.5, 0.6)), radius=0.6), (0.3, 0.5, 0.6))
    stage.world((0.2, 0.25, 0.3), 0.15)
    y, x = np.mgrid[0:32, 0:32]
    panes = stage.image("Panes", np.repeat((((x // 8) % 4 != 1) & ((y // 8) % 4 != 2))[..., None] * 1.0, 3, axis=2))
    for kind, energy, place in (("SPOT", 900.0, (-2.5, -3.0, 3.0)), ("POINT", 150.0, (2.5, 0.5, 2.0))):
        lamp = stage.lamp(kind, kind.title(), energy, place, (0.5, 2.0, 0.8), shadow_soft_size=0.03)
        if lamp.data.node_tree is None:
            lamp.data.use_nodes = True
        tree = lamp.data.node_tree
        where = stage.node(tree, "ShaderNodeTexCoord").outputs["Normal"]
        if kind == "SPOT":
            parts = stage.node(tree, "ShaderNodeSeparateXYZ", {0: where})
            flat = stage.node(
                tree,
                "ShaderNodeVectorMath",
                {0: where, 1: stage.node(tree, "ShaderNodeCombineXYZ", dict.fromkeys(range(3), parts.outputs[2]))},
                operation="DIVIDE",
            )
            where = stage.node(tree, "ShaderNodeMapping", {0: flat, "Location": (0.5, 0.5, 0.0)})
            color = stage.node(tree, "ShaderNodeTexImage", {"Vector": where}, image=panes)
        else:
            color = stage.node(tree, "ShaderNodeTexChecker", {"Vector": where, "Scale": 3.0})
        emission = next(node for node in tree.nodes if node.type == "EMISSION")
        tree.links.new(color.outputs[0], emission.inputs["Color"])
    stage.camera((0.0, -6.5, 2.2), (0.0, 1.5, 1.2), 35.0)


@case("Worn edges: Bevel, Pointiness, and Ambient Occlusion within the object and inverted", samples=64)
def worn_edges() -> None:
    """Masks of dirt and scratches."""
    stage.studio(width=5.0)

    def mask(kind: str) -> Any:
        def shader(tree: Any) -> Any:
            if kind == "Bevel":
                round_ = stage.node(tree, "ShaderNodeBevel", {"Radius": 0.1})
                return stage.node(
                    tree,
                    "ShaderNodeBsdfPrincipled",
                    {"Base Color": (0.6, 0.5, 0.4), "Roughness": 0.3, "Normal": round_},
                )
            if kind == "Pointiness":
                value = stage.node(tree, "ShaderNodeNewGeometry").outputs["Pointiness"]
                value = stage.node(tree, "ShaderNodeMapRange", {0: value, 1: 0.45, 2: 0.55}).outputs[0]
            else:
                value = stage.node(
                    tree, "ShaderNodeAmbientOcclusion", {"Distance": 0.4}, only_local=True, inside=kind == "Inside"
                ).outputs["AO"]
            mix = stage.node(tree, "ShaderNodeMixRGB", {0: value, 1: (0.1, 0.05, 0.02), 2: (0.7, 0.6, 0.5)})
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": mix})

        return stage.material(kind, shader)

    stage.add("Box", stage.cube("Box", mask("Bevel"), size=1.0), (-1.7, 0.0, 0.5), (0, 0, 0.5))
    stage.add("Head", stage.monkey("Head", mask("Pointiness")), (-0.4, 0.0, 0.7), scale=0.6)
    stage.add("Other", stage.monkey("Other", mask("Local")), (0.9, 0.0, 0.7), scale=0.6)
    stage.add("Block", stage.cube("Block", mask("Inside"), size=0.8), (2.1, 0.2, 0.4), (0, 0, 0.3))


@case(
    "Everything in one Principled: coat, sheen, transmission, alpha, emission, tints, anisotropy",
    bounces=6,
    samples=128,
)
def everything_principled() -> None:
    """Materials that use every panel of the shader."""
    stage.studio(width=6.0)
    common: dict[str, Any] = {
        "Coat_Weight": 0.5,
        "Coat_Tint": (1.0, 0.7, 0.5, 1.0),
        "Coat_Roughness": 0.1,
        "Sheen_Weight": 0.4,
        "Sheen_Tint": (0.5, 0.7, 1.0, 1.0),
        "Specular_Tint": (1, 0.8, 0.9, 1),
        "Diffuse_Roughness": 0.4,
    }
    stage.row(
        [
            stage.principled(
                "Layers", (0.6, 0.2, 0.2), Alpha=0.7, Emission_Color=(0.2, 0.5, 1, 1), Emission_Strength=0.3, **common
            ),
            stage.principled(
                "Half glass", (0.7, 0.8, 0.6), Transmission_Weight=0.5, Roughness=0.2, Metallic=0.3, **common
            ),
            stage.principled("Metal", (0.8, 0.6, 0.3), Metallic=0.8, Anisotropic=0.5, Roughness=0.4, **common),
            stage.principled("Bright", (1.0, 1.0, 1.0), Roughness=0.0, IOR=2.0, Specular_IOR_Level=1.0, **common),
        ],
        gap=1.3,
    )


@case("Thin films: soap and oil on dielectric, glass and metal", bounces=6, samples=96)
def thin_films() -> None:
    """Bubbles and tempered steel."""
    stage.studio(width=6.0)
    film = {"Thin_Film_Thickness": 400.0, "Thin_Film_IOR": 1.4}
    stage.row(
        [
            stage.principled("Oil", (0.05, 0.05, 0.05), Roughness=0.1, **film),
            stage.principled("Bubble", (1, 1, 1), Transmission_Weight=1.0, Roughness=0.0, IOR=1.1, **film),
            stage.principled("Steel", (0.6, 0.6, 0.6), Metallic=1.0, Roughness=0.2, **film),
            stage.simple("Glass", "ShaderNodeBsdfGlass", {"Roughness": 0.0, "Thin Film Thickness": 300.0}),
        ],
        gap=1.3,
    )


@case("Skin and marble: subsurface scattering of the default radius on small bodies", samples=64, differs=(
    "subsurface scattering does not spread light, which the export says",))  # fmt: skip
def skin() -> None:
    """Principled with a full weight, as skin tutorials use it."""
    stage.studio(width=4.5)
    made = [
        stage.principled("Skin", (0.8, 0.5, 0.4), Subsurface_Weight=1.0, Subsurface_Scale=0.1),
        stage.principled(
            "Milk", (0.9, 0.9, 0.85), Subsurface_Weight=0.5, Subsurface_Radius=(0.3, 0.3, 0.3), Subsurface_Scale=0.3
        ),
    ]
    for k, one in enumerate(made):
        stage.add(one.name, stage.monkey(one.name, one), (-0.9 + 1.8 * k, 0.0, 0.7), (0, 0, 0.2), 0.7)


@case("Fog: a world with a thin volume, and a lamp in a box of haze", bounces=4, samples=96, differs=(
    "in fog that absorbs or scatters, the light of area lamps that rough metal throws on the floor is darker in Cycles",
))  # fmt: skip
def fog() -> None:
    """God rays of tutorials."""
    stage.studio(width=5.0)
    tree = bpy.context.scene.world.node_tree
    haze = stage.node(tree, "ShaderNodeVolumeScatter", {"Density": 0.03})
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(haze.outputs[0], output.inputs["Volume"])
    stage.row([stage.principled("Red", (0.7, 0.1, 0.1)), stage.principled("Chrome", Metallic=1.0, Roughness=0.1)])

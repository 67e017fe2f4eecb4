"""Materials as they are found in old files: former nodes, mappings of textures, wrong links, rare shaders."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case


def _small(width: float = 6.0) -> None:
    stage.studio(width=width)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96


def _picture(name: str) -> Any:
    return stage.image(name, np.random.default_rng(3).uniform(0.1, 0.9, (6, 8, 3)))


@case("Former nodes: MixRGB in its blend modes, a texture's own mapping of 2.7, Separate and Combine")
def old_mix_nodes() -> None:
    """Such nodes remain in files that are opened by newer versions."""
    _small()

    def mixed(blend: str) -> Any:
        def shader(tree: Any) -> Any:
            checks = stage.node(tree, "ShaderNodeTexChecker", {
                "Scale": 9.0, "Color1": (0.7, 0.2, 0.1), "Color2": (0.3, 0.6, 0.8)})  # fmt: skip
            color = stage.node(tree, "ShaderNodeMixRGB", {0: 0.7, 1: checks, 2: (0.4, 0.7, 0.3)}, blend_type=blend)
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color})

        return stage.material(f"Mix {blend}", shader)

    stage.row([mixed(blend) for blend in ("MULTIPLY", "OVERLAY", "SOFT_LIGHT", "DIFFERENCE")], y=-0.7)

    def mapped(tree: Any) -> Any:
        image = stage.node(tree, "ShaderNodeTexImage", image=_picture("Mapped"), interpolation="Closest")
        image.texture_mapping.scale = (3.0, 2.0, 1.0)
        image.texture_mapping.rotation = (0.0, 0.0, 0.3)
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": image})

    def swapped(tree: Any) -> Any:
        parts = stage.node(tree, "ShaderNodeSeparateColor", {0: stage.node(
            tree, "ShaderNodeTexNoise", {"Scale": 3.0}).outputs["Color"]}, mode="HSV")  # fmt: skip
        color = stage.node(tree, "ShaderNodeCombineColor", {0: parts.outputs[2], 1: 0.8, 2: parts.outputs[0]},
                           mode="HSL")  # fmt: skip
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": color})

    stage.row([stage.material("Mapped", mapped), stage.material("Swapped", swapped)], y=0.7)


@case("Wrong links: colours, numbers and images linked to the surface, shaders to colours", bounces=2)
def wrong_links() -> None:
    """All of these can be made in the editor, and Cycles renders something for each."""
    _small()

    def direct(kind: str, output: Any = 0, **settings: Any) -> Any:
        return stage.material(f"{kind} direct", lambda tree: stage.node(tree, kind, **settings).outputs[output])

    def value(tree: Any) -> Any:
        made = stage.node(tree, "ShaderNodeValue")
        made.outputs[0].default_value = 0.6
        return made.outputs[0]

    def shader_as_color(tree: Any) -> Any:
        toon = stage.node(tree, "ShaderNodeBsdfToon")
        made = stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.1, 0.6, 0.2)})
        tree.links.new(toon.outputs[0], made.inputs["Base Color"])
        return made

    def half(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeMixShader", {1: stage.node(tree, "ShaderNodeBsdfDiffuse")})

    def color_in_mix(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeMixShader", {
            1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.2, 0.1)}),
            2: stage.node(tree, "ShaderNodeTexChecker", {"Scale": 7.0}).outputs[0]})  # fmt: skip

    stage.row([direct("ShaderNodeTexImage", image=_picture("Direct")), stage.material("Value direct", value),
               direct("ShaderNodeTexNoise", "Color"), direct("ShaderNodeVolumePrincipled")], y=-0.7)  # fmt: skip
    stage.row([stage.material("Shader as colour", shader_as_color), stage.material("Half a mix", half),
               stage.material("Colour in a mix", color_in_mix)], y=0.7)  # fmt: skip


@case("Leaves: translucent, transparent and glossy parts mixed by images and alpha", bounces=4)
def leaves() -> None:
    """Leaf cards as in vegetation kits."""
    _small()
    pixels = np.ones((16, 16, 4))
    x, y = np.meshgrid(*[np.linspace(-1, 1, 16)] * 2)
    pixels[..., :3] = (0.2, 0.5, 0.1)
    pixels[..., 3] = (x**2 + 2.0 * y**2 < 0.7).astype(float)
    leaf = stage.image("Leaf", pixels)

    def card(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=leaf)
        front = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs["Color"]})
        back = stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": texture.outputs["Color"]})
        body = stage.node(tree, "ShaderNodeMixShader", {"Fac": 0.4, 1: front, 2: back})
        shiny = stage.node(tree, "ShaderNodeMixShader", {
            "Fac": stage.node(tree, "ShaderNodeFresnel", {"IOR": 1.4}), 1: body,
            2: stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.3}, distribution="GGX")})  # fmt: skip
        clear = stage.node(tree, "ShaderNodeBsdfTransparent")
        return stage.node(tree, "ShaderNodeMixShader", {"Fac": texture.outputs["Alpha"], 1: clear, 2: shiny})

    made = stage.material("Leaf", card)
    for k in range(9):
        stage.add(f"Leaf {k}", stage.plane(f"Leaf {k}", made, size=1.3),
                  (1.1 * (k % 3 - 1), 0.6 * (k // 3 - 1), 0.5 + 0.3 * (k // 3)),
                  (1.1 + 0.1 * k, 0.1 * k, 0.4 * k))  # fmt: skip


@case("Subsurface scattering of small radius: Principled and the node, three methods", samples=64)
def small_subsurface() -> None:
    """Wax and skin whose light does not spread visibly."""
    _small()

    def node(name: str, color: Any, method: str) -> Any:
        return stage.simple(name, "ShaderNodeSubsurfaceScattering", {"Color": color, "Scale": 0.01},
                            falloff=method)  # fmt: skip

    stage.row([stage.principled("Skin", (0.8, 0.45, 0.3), Subsurface_Weight=1.0, Subsurface_Scale=0.01),
               stage.principled("Half", (0.4, 0.6, 0.2), Subsurface_Weight=0.5, Subsurface_Scale=0.01),
               stage.principled("Matt", (0.7, 0.2, 0.1), Subsurface_Weight=1.0, Subsurface_Scale=0.01,
                                Specular_IOR_Level=0.0)], y=-0.7)  # fmt: skip
    stage.row([node("Walk", (0.8, 0.4, 0.2), "RANDOM_WALK"), node("Fixed", (0.8, 0.4, 0.2), "RANDOM_WALK_SKIN"),
               node("Burley", (0.8, 0.4, 0.2), "BURLEY")], y=0.7)  # fmt: skip


@case("Shaders without a counterpart: Toon, Hair, Principled Hair, Ray Portal, beside a thin film", bounces=2,
      differs=("Each is replaced by the shader that the export names.",))  # fmt: skip
def rare_shaders() -> None:
    """Each is named by the export, with what is rendered instead."""
    _small()
    color = {"Color": (0.8, 0.4, 0.2)}
    stage.row([stage.simple("Toon", "ShaderNodeBsdfToon", color), stage.simple("Strand", "ShaderNodeBsdfHair", color),
               stage.simple("Hair", "ShaderNodeBsdfHairPrincipled"),
               stage.principled("Soap", (0.5, 0.5, 0.5), Thin_Film_Thickness=400.0)], y=-0.7)  # fmt: skip
    stage.row([stage.simple("Glossy toon", "ShaderNodeBsdfToon", color, component="GLOSSY")], y=0.7)


@case("Holdout, Background and Metallic as surfaces, colours above 1", bounces=2)
def simple_rare_shaders() -> None:
    """Shaders that have an exact counterpart."""
    _small()
    stage.row([stage.simple("Holdout", "ShaderNodeHoldout"),
               stage.simple("Background", "ShaderNodeBackground", {"Color": (0.2, 0.5, 0.7), "Strength": 0.6}),
               stage.simple("Metallic", "ShaderNodeBsdfMetallic", {"Base Color": (0.8, 0.5, 0.2), "Roughness": 0.4}),
               stage.simple("Bright", "ShaderNodeBsdfDiffuse", {"Color": (1.3, 0.6, 0.2)})], y=-0.7)  # fmt: skip

    def lamp(tree: Any) -> Any:
        warm = stage.node(tree, "ShaderNodeBlackbody", {0: 2600.0})
        return stage.node(tree, "ShaderNodeEmission", {"Color": warm, "Strength": 0.8})

    def hot(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeSeparateXYZ", {0: stage.node(tree, "ShaderNodeTexCoord").outputs[0]})
        kelvin = stage.node(tree, "ShaderNodeMath", {0: place.outputs[2], 1: 5000.0, 2: 1200.0},
                            operation="MULTIPLY_ADD")  # fmt: skip
        return stage.node(tree, "ShaderNodeEmission", {"Color": stage.node(tree, "ShaderNodeBlackbody", {0: kelvin}),
                                                       "Strength": 0.5})  # fmt: skip

    stage.row([stage.material("Bulb", lamp), stage.material("Hot", hot)], y=0.7)


@case("Lamps coloured by a Blackbody node, the way before lamps had a temperature", bounces=2)
def blackbody_lamps() -> None:
    """A warm and a cold lamp."""
    _small()
    for name, kelvin in (("Key", 2700.0), ("Rim", 9000.0)):
        data = bpy.data.objects[name].data
        data.use_nodes = True
        emission = next(node for node in data.node_tree.nodes if node.type == "EMISSION")
        warm = stage.node(data.node_tree, "ShaderNodeBlackbody", {0: kelvin})
        data.node_tree.links.new(warm.outputs[0], emission.inputs["Color"])
    stage.row([stage.diffuse("Chalk"), stage.principled("Plastic", (0.3, 0.5, 0.7))])

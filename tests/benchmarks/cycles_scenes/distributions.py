"""Distributions of microfacets other than GGX, velvet, bent normals, and emission that depends on the kind of ray."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import stage
from .case import case

COPPER = (0.95, 0.6, 0.45)
BRUSHED = {"Color": (0.8, 0.8, 0.8), "Roughness": 0.4}


def _small() -> None:
    """A quarter of the usual picture."""
    import bpy

    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 96, 72


@case("Glossy with Beckmann's distribution: roughness, anisotropy; the Metallic node", samples=64)
def beckmann_metal() -> None:
    """Front row: roughness; back row: brushed, and the Metallic node."""
    stage.studio()
    _small()
    glossy = [stage.simple(f"Copper {r}", "ShaderNodeBsdfGlossy", {"Color": COPPER, "Roughness": r},
                           distribution="BECKMANN") for r in (0.1, 0.3, 0.6, 1.0)]  # fmt: skip
    stage.row(glossy, y=-0.8)
    stage.row([
        stage.simple("Along", "ShaderNodeBsdfGlossy", {**BRUSHED, "Anisotropy": 0.8}, distribution="BECKMANN"),
        stage.simple("Across", "ShaderNodeBsdfGlossy", {**BRUSHED, "Anisotropy": -0.8, "Rotation": 0.1},
                     distribution="BECKMANN"),
        stage.simple("Metallic", "ShaderNodeBsdfMetallic", {"Base Color": COPPER, "Roughness": 0.5},
                     distribution="BECKMANN"),
    ], y=0.8)  # fmt: skip


@case("Frosted glass with Beckmann's distribution", bounces=6, samples=96)
def beckmann_glass() -> None:
    """Spheres from clear to frosted before a striped floor."""
    stage.studio()
    _small()
    stage.row([stage.simple(f"Frosted {r}", "ShaderNodeBsdfGlass", {"Roughness": r, "IOR": 1.45},
                            distribution="BECKMANN") for r in (0.0, 0.2, 0.5, 0.9)], y=-0.8)  # fmt: skip
    stage.row([stage.diffuse("Red", (0.8, 0.1, 0.1)), stage.diffuse("Green", (0.1, 0.6, 0.1)),
               stage.diffuse("Blue", (0.1, 0.2, 0.8))], y=0.8)  # fmt: skip


@case("The Refraction node with Beckmann's distribution, its default", bounces=4, samples=96)
def beckmann_refraction() -> None:
    """Panes that blur the spheres behind them, with and without a Glossy node mixed in by Fresnel."""
    stage.studio()
    _small()

    def pane(tree: object) -> object:
        bent = stage.node(tree, "ShaderNodeBsdfRefraction", {"Roughness": 0.3, "IOR": 1.45})
        gloss = stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.3}, distribution="BECKMANN")
        fresnel = stage.node(tree, "ShaderNodeFresnel", {"IOR": 1.45})
        return stage.node(tree, "ShaderNodeMixShader", {0: fresnel, 1: bent, 2: gloss})

    alone = stage.simple("Bent", "ShaderNodeBsdfRefraction", {"Color": (0.8, 0.9, 1.0), "Roughness": 0.5, "IOR": 1.3})
    stage.row([alone, stage.material("Pane", pane)], y=-0.8, gap=1.6)
    stage.row([stage.diffuse("Red", (0.8, 0.1, 0.1)), stage.diffuse("Green", (0.1, 0.6, 0.1)),
               stage.diffuse("Blue", (0.1, 0.2, 0.8))], y=0.8)  # fmt: skip


@case("Glossy with the distribution Ashikhmin-Shirley", samples=64)
def ashikhmin_shirley() -> None:
    """Front row: roughness, with a mirror at its lower limit; back row: brushed."""
    stage.studio()
    _small()
    kind = {"distribution": "ASHIKHMIN_SHIRLEY"}
    stage.row([stage.simple(f"Plate {r}", "ShaderNodeBsdfGlossy", {"Color": COPPER, "Roughness": r}, **kind)
               for r in (0.0, 0.15, 0.4, 1.0)], y=-0.8)  # fmt: skip
    stage.row([
        stage.simple("Along", "ShaderNodeBsdfGlossy", {**BRUSHED, "Anisotropy": 0.8}, **kind),
        stage.simple("Across", "ShaderNodeBsdfGlossy", {**BRUSHED, "Anisotropy": -0.6, "Rotation": 0.2}, **kind),
    ], y=0.8)  # fmt: skip


@case("Velvet: the Sheen node with the distribution Ashikhmin", samples=64)
def velvet() -> None:
    """Front row: sheen alone; back row: added to a diffuse cloth, as cloth shaders of old files are made."""
    stage.studio()
    _small()
    stage.row([stage.simple(f"Velvet {r}", "ShaderNodeBsdfSheen", {"Color": (0.8, 0.3, 0.5), "Roughness": r},
                            distribution="ASHIKHMIN") for r in (0.1, 0.4, 0.8, 1.0)], y=-0.8)  # fmt: skip

    def cloth(tree: object) -> object:
        base = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.3, 0.05, 0.1)})
        fibres = stage.node(tree, "ShaderNodeBsdfSheen", {"Color": (1.0, 0.6, 0.7), "Roughness": 0.6},
                            distribution="ASHIKHMIN")
        return stage.node(tree, "ShaderNodeMixShader", {0: 0.5, 1: base, 2: fibres})

    stage.row([stage.material("Cloth", cloth), stage.diffuse("Chalk")], y=0.8, gap=1.6)


def _tiles(*materials: tuple[str, dict[str, float]]) -> None:
    """Principled tiles with pyramids by a normal map."""
    stage.studio()
    _small()
    bump = np.zeros((8, 8, 3), np.float32)
    bump[:4, :4], bump[:4, 4:], bump[4:, :4], bump[4:, 4:] = (
        (0.9, 0.5, 0.75), (0.5, 0.9, 0.75), (0.15, 0.5, 0.75), (0.5, 0.15, 0.75))  # fmt: skip
    made = stage.image("Pyramids", bump, "Non-Color")

    def tile(name: str, inputs: dict[str, float]) -> Any:
        def shader(tree: object) -> object:
            texture = stage.node(tree, "ShaderNodeTexImage", image=made, interpolation="Closest")
            normal = stage.node(tree, "ShaderNodeNormalMap", {"Color": texture.outputs["Color"], "Strength": 1.0})
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {
                "Base Color": (0.6, 0.3, 0.2), "Normal": normal, **inputs,
            })  # fmt: skip

        return stage.material(name, shader)

    for k, (name, inputs) in enumerate(materials):
        made_of = stage.plane(name, tile(name, inputs), size=1.2)
        stage.add(name, made_of, (1.4 * (k - 0.5 * (len(materials) - 1)), 0.2, 0.7), (0.9, 0, 0.2 * k - 0.3))


@case("Strongly tilted normal maps on Principled: plastic, metal, cloth", samples=96)
def tilted_normals() -> None:
    """The terminator of diffuse light is softened, that of gloss is not."""
    _tiles(("Plastic", {"Roughness": 0.5}), ("Sharp", {"Roughness": 0.2, "Specular IOR Level": 1.0}),
           ("Metal", {"Roughness": 0.4, "Metallic": 1.0}),
           ("Cloth", {"Roughness": 0.9, "Sheen Weight": 1.0}))  # fmt: skip


@case("A coat over a strongly tilted normal map", samples=96)
def coat_over_tilted_normals() -> None:
    """Lacquer over embossed tiles."""
    _tiles(("Lacquer", {"Roughness": 0.7, "Coat Weight": 1.0}), ("Half", {"Roughness": 0.7, "Coat Weight": 0.4}))


def _by_ray(name: str, output: str, strength: float, inverse: bool = False) -> object:
    """Emission for one kind of ray, or for all but one."""

    def shader(tree: object) -> object:
        path = stage.node(tree, "ShaderNodeLightPath")
        factor = path.outputs[output]
        if inverse:
            factor = stage.node(tree, "ShaderNodeMath", {0: 1.0, 1: factor}, operation="SUBTRACT")
        scaled = stage.node(tree, "ShaderNodeMath", {0: factor, 1: strength}, operation="MULTIPLY")
        return stage.node(tree, "ShaderNodeEmission", {"Color": (1.0, 0.9, 0.7), "Strength": scaled})

    return stage.material(name, shader)


def _shop(*signs: object) -> None:
    """Signs above a floor, with balls below them."""
    stage.studio()
    _small()
    for k, one in enumerate(signs):
        x = 2.0 * (k - 0.5 * (len(signs) - 1))
        stage.add(f"Sign {k}", stage.plane(f"Sign {k}", one, size=1.2), (x, 1.2, 1.6), (1.3, 0, 0))
    stage.row([stage.diffuse("Chalk"), stage.simple("Mirror", "ShaderNodeBsdfGlossy", {"Roughness": 0.0}),
               stage.principled("Plastic", (0.2, 0.4, 0.7), Roughness=0.3)], y=-0.6)  # fmt: skip


@case("Emission that only the camera sees, and emission that it does not see", samples=96)
def emission_by_camera_ray() -> None:
    """The usual trick for bright signs that light nothing, and for hidden lamps."""
    _shop(_by_ray("Sign", "Is Camera Ray", 6.0), _by_ray("Lamp", "Is Camera Ray", 6.0, inverse=True))


@case("Emission by diffuse, glossy and shadow rays", samples=96, differs=(
    "light sampling sees emission of no kind of ray; what rays that meet the surface add depends on their weights",))
def emission_by_ray_kinds() -> None:
    """Light sampling sees none of these kinds; rays that meet the surface do."""
    _shop(_by_ray("Diffuse", "Is Diffuse Ray", 6.0), _by_ray("Glossy", "Is Glossy Ray", 6.0),
          _by_ray("No shadow", "Is Shadow Ray", 6.0, inverse=True))  # fmt: skip

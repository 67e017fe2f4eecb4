"""Shaders mixed and added, with factors from textures."""

from __future__ import annotations

from typing import Any

from . import stage
from .case import case


def _nested(tree: Any) -> Any:
    """A Mix of a Mix and an Add, whose factors vary over the surface."""
    uv = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
    parts = stage.node(tree, "ShaderNodeSeparateXYZ", {0: uv})
    stripes = stage.node(tree, "ShaderNodeMath", {0: stage.node(
        tree, "ShaderNodeMath", {0: parts.outputs["X"], 1: 60.0}, operation="MULTIPLY")}, operation="SINE")  # fmt: skip
    factor = stage.node(tree, "ShaderNodeMath", {0: stripes, 1: 0.0}, operation="GREATER_THAN")
    red = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.1, 0.1)})
    gloss = stage.node(tree, "ShaderNodeBsdfGlossy", {"Color": (0.8, 0.8, 0.8), "Roughness": 0.3}, distribution="GGX")
    glow = stage.node(tree, "ShaderNodeEmission", {"Color": (0.2, 0.5, 1.0), "Strength": 0.4})
    mixed = stage.node(tree, "ShaderNodeMixShader", {"Fac": 0.25, 1: red, 2: gloss})
    added = stage.node(tree, "ShaderNodeAddShader", {0: red, 1: glow})
    graded = stage.node(tree, "ShaderNodeMixShader", {"Fac": parts.outputs["Y"], 1: mixed, 2: added})
    return stage.node(tree, "ShaderNodeMixShader", {"Fac": factor, 1: graded, 2: gloss})


def _fresnel(tree: Any) -> Any:
    factor = stage.node(tree, "ShaderNodeFresnel", {"IOR": 1.6})
    base = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.1, 0.4, 0.15)})
    gloss = stage.node(tree, "ShaderNodeBsdfGlossy", {"Color": (1, 1, 1), "Roughness": 0.15}, distribution="GGX")
    return stage.node(tree, "ShaderNodeMixShader", {"Fac": factor, 1: base, 2: gloss})


def _facing(tree: Any) -> Any:
    factor = stage.node(tree, "ShaderNodeLayerWeight", {"Blend": 0.4}).outputs["Facing"]
    inner = stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.05, 0.1, 0.5), "Roughness": 0.4})
    rim = stage.node(tree, "ShaderNodeBsdfTransparent", {"Color": (1.0, 0.9, 0.8)})
    return stage.node(tree, "ShaderNodeMixShader", {"Fac": factor, 1: inner, 2: rim})


def _cut_out(tree: Any) -> Any:
    checks = stage.node(tree, "ShaderNodeTexChecker", {
        "Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["UV"], "Scale": 12.0})  # fmt: skip
    solid = stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.8, 0.5, 0.1), "Roughness": 0.3})
    hole = stage.node(tree, "ShaderNodeBsdfTransparent")
    return stage.node(tree, "ShaderNodeMixShader", {"Fac": checks.outputs["Factor" if "Factor" in checks.outputs else
                                                                          "Fac"], 1: solid, 2: hole})  # fmt: skip


def _two_principled(tree: Any) -> Any:
    metal = stage.node(
        tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.9, 0.8, 0.5), "Metallic": 1.0, "Roughness": 0.2}
    )
    paint = stage.node(
        tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.1, 0.3, 0.6), "Roughness": 0.5, "Coat Weight": 1.0}
    )
    gradient = stage.node(tree, "ShaderNodeSeparateXYZ", {0: stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]})
    return stage.node(tree, "ShaderNodeMixShader", {"Fac": gradient.outputs["Y"], 1: metal, 2: paint})


@case("Limits of diffuse, glossy and transmission bounces that differ", bounces=6, diffuse_bounces=1, glossy_bounces=2,
      transmission_bounces=3)  # fmt: skip
def bounce_limits() -> None:
    """Balls between two mirrors in a bright box."""
    stage.studio()
    mirror = stage.simple("Mirror", "ShaderNodeBsdfGlossy", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.0})
    stage.add("Mirror", stage.plane("Mirror", mirror, size=6.0), (0, 1.5, 0.8), (1.45, 0, 0))
    stage.add("Second mirror", stage.plane("Second mirror", mirror, size=2.0), (-3.0, 0.0, 0.8), (1.5, 0, 1.3))
    stage.row([stage.diffuse("Chalk"), stage.principled("Metal", Metallic=1.0, Roughness=0.2),
               stage.simple("Glass", "ShaderNodeBsdfGlass", {"IOR": 1.4, "Roughness": 0.0}),
               stage.principled("Plastic", (0.7, 0.2, 0.1), Roughness=0.2)])  # fmt: skip


@case("Mix and Add Shader trees: textured factors, Fresnel, Layer Weight, holes", bounces=4)
def shader_trees() -> None:
    """One ball per tree."""
    stage.studio()
    stage.row([stage.material("Nested", _nested), stage.material("Fresnel", _fresnel),
               stage.material("Facing", _facing), stage.material("Cut out", _cut_out),
               stage.material("Two Principled", _two_principled)], y=0.0, radius=0.6)  # fmt: skip

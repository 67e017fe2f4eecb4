"""Chains of colour nodes, as tutorials build them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import stage
from ..case import case


def _picture() -> Any:
    pixels = np.random.default_rng(11).uniform(0.02, 0.98, (12, 12, 3)).repeat(4, 0).repeat(4, 1)
    return stage.image("Picture", pixels)


def _rows(chains: list[Callable[[Any, Any], Any]]) -> None:
    stage.studio(width=5.0)
    image = _picture()

    def made(k: int, chain: Callable[[Any, Any], Any]) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=image)
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": chain(tree, texture)})

        return stage.material(f"Chain {k}", shader)

    half = (len(chains) + 1) // 2
    done = [made(k, chain) for k, chain in enumerate(chains)]
    stage.row(done[:half], y=-0.6, radius=0.5, gap=1.12)
    stage.row(done[half:], y=0.7, radius=0.5, gap=1.12)


def _ramp(tree: Any, value: Any, interpolation: str, mode: str = "RGB", hue: str = "NEAR") -> Any:
    made = stage.node(tree, "ShaderNodeValToRGB", {"Fac": value})
    ramp = made.color_ramp
    ramp.elements.new(0.35)
    ramp.elements.new(0.6)
    for one, color in zip(
        ramp.elements, ((0.1, 0.1, 0.3), (0.8, 0.2, 0.1), (0.2, 0.7, 0.3), (0.9, 0.9, 0.7)), strict=True
    ):
        one.color = (*color, 1.0)
    ramp.color_mode = mode
    if mode == "RGB":
        ramp.interpolation = interpolation
    else:
        ramp.hue_interpolation = hue
    return made


@case("Colour ramps: all interpolations, HSV and HSL with their ways round")
def color_ramps() -> None:
    """Each on the values of a noise texture."""
    stage.studio(width=5.0)

    def made(interpolation: str, mode: str = "RGB", hue: str = "NEAR") -> Any:
        return stage.material(f"{interpolation} {mode} {hue}", lambda tree: stage.node(
            tree, "ShaderNodeBsdfDiffuse", {"Color": _ramp(tree, stage.node(
                tree, "ShaderNodeTexNoise", {"Scale": 3.0}), interpolation, mode, hue)}))  # fmt: skip

    stage.row(
        [made(one) for one in ("LINEAR", "CONSTANT", "EASE", "CARDINAL", "B_SPLINE")], y=-0.6, radius=0.5, gap=1.1
    )
    stage.row([made("LINEAR", *one) for one in (("HSV", "NEAR"), ("HSV", "FAR"), ("HSV", "CW"), ("HSL", "CCW"))],
              y=0.7, radius=0.5, gap=1.1)  # fmt: skip


@case("Curves of colours, vectors and numbers; hue and saturation, invert, brightness, gamma in chains")
def color_curves() -> None:
    """Curves with handles, extended and not, and clamped values."""

    def curves(tree: Any, texture: Any) -> Any:
        made = stage.node(tree, "ShaderNodeRGBCurve", {"Fac": 0.8, "Color": texture})
        for k, (x, y) in enumerate(((0.3, 0.6), (0.7, 0.4), (0.4, 0.2), (0.5, 0.7))):
            made.mapping.curves[k].points.new(x, y)
        made.mapping.curves[0].points[0].handle_type = "VECTOR"
        made.mapping.update()
        return stage.node(tree, "ShaderNodeInvert", {"Fac": 0.4, "Color": made})

    def hue(tree: Any, texture: Any) -> Any:
        first = stage.node(tree, "ShaderNodeHueSaturation", {"Hue": 0.7, "Saturation": 1.6, "Value": 1.3, "Fac": 0.9,
                                                             "Color": texture})  # fmt: skip
        return stage.node(tree, "ShaderNodeBrightContrast", {"Color": first, "Bright": -0.1, "Contrast": 0.4})

    def gamma(tree: Any, texture: Any) -> Any:
        first = stage.node(tree, "ShaderNodeGamma", {"Color": texture, "Gamma": 2.2})
        return stage.node(tree, "ShaderNodeHueSaturation", {"Saturation": 0.0, "Value": 2.0, "Color": first})

    def vector(tree: Any, texture: Any) -> Any:
        made = stage.node(tree, "ShaderNodeVectorCurve", {"Fac": 1.0, "Vector": texture})
        made.mapping.curves[0].points.new(0.3, 0.7)
        made.mapping.update()
        return made

    def floats(tree: Any, texture: Any) -> Any:
        gray = stage.node(tree, "ShaderNodeRGBToBW", {0: texture})
        made = stage.node(tree, "ShaderNodeFloatCurve", {"Factor": 0.9, "Value": gray})
        made.mapping.curves[0].points.new(0.4, 0.9)
        made.mapping.update()
        return made

    def bright(tree: Any, texture: Any) -> Any:
        more = stage.node(tree, "ShaderNodeMixRGB", {0: 1.0, 1: texture, 2: (1.5, 1.2, 1.1)}, blend_type="ADD")
        made = stage.node(tree, "ShaderNodeRGBCurve", {"Color": more})
        made.mapping.extend = "HORIZONTAL"
        made.mapping.curves[3].points.new(0.5, 0.3)
        made.mapping.update()
        return made

    _rows([curves, hue, gamma, vector, floats, bright])


@case("All blend modes of Mix, clamped and not")
def blend_modes() -> None:
    """The mixes of paint programs."""

    def blended(mode: str) -> Callable[[Any, Any], Any]:
        def chain(tree: Any, texture: Any) -> Any:
            other = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 4.0}).outputs["Color"]
            return stage.node(tree, "ShaderNodeMixRGB", {0: 0.7, 1: texture, 2: other}, blend_type=mode,
                              use_clamp=mode in ("ADD", "DODGE"))  # fmt: skip

        return chain

    _rows([blended(mode) for mode in ("DARKEN", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD", "LINEAR_LIGHT",
                                      "EXCLUSION", "SUBTRACT", "DIVIDE")])  # fmt: skip


@case("More blend modes of Mix: hue, saturation, colour, value; Math and Map Range")
def blend_modes_of_hue() -> None:
    """Rarer nodes."""

    def blended(mode: str) -> Callable[[Any, Any], Any]:
        return lambda tree, texture: stage.node(tree, "ShaderNodeMixRGB", {
            0: 0.8, 1: texture, 2: (0.2, 0.6, 0.9)}, blend_type=mode)  # fmt: skip

    def steps(tree: Any, texture: Any) -> Any:
        gray = stage.node(tree, "ShaderNodeRGBToBW", {0: texture})
        return stage.node(tree, "ShaderNodeMapRange", {"Value": gray, 1: 0.1, 2: 0.9, 3: 0.8, 4: 0.1, 5: 5.0},
                          interpolation_type="STEPPED")  # fmt: skip

    def hsl(tree: Any, texture: Any) -> Any:
        parts = stage.node(tree, "ShaderNodeSeparateColor", {0: texture}, mode="HSL")
        turned = stage.node(tree, "ShaderNodeMath", {0: parts.outputs[0], 1: 0.3}, operation="ADD")
        wrapped = stage.node(tree, "ShaderNodeMath", {0: turned, 1: 0.0, 2: 1.0}, operation="WRAP")
        return stage.node(tree, "ShaderNodeCombineColor", {0: wrapped, 1: parts.outputs[1], 2: parts.outputs[2]},
                          mode="HSL")  # fmt: skip

    def soft(tree: Any, texture: Any) -> Any:
        gray = stage.node(tree, "ShaderNodeRGBToBW", {0: texture})
        low = stage.node(tree, "ShaderNodeMath", {0: gray, 1: 0.5, 2: 0.4}, operation="SMOOTH_MIN")
        return stage.node(tree, "ShaderNodeMath", {0: low, 1: 0.1}, operation="SNAP")

    _rows([*[blended(mode) for mode in ("HUE", "SATURATION", "COLOR", "VALUE")], steps, hsl, soft])

"""Values computed by nodes: mathematics, ramps, colour attributes, normal maps, procedural textures."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import stage
from .case import case


def _ramp(tree: Any, factor: Any, stops: list[tuple[float, tuple[float, float, float]]], mode: str = "LINEAR") -> Any:
    made = stage.node(tree, "ShaderNodeValToRGB", {0: factor})
    ramp = made.color_ramp
    ramp.interpolation = mode
    while len(ramp.elements) < len(stops):
        ramp.elements.new(0.5)
    for element, (position, color) in zip(ramp.elements, stops, strict=True):
        element.position, element.color = position, (*color, 1.0)
    return made.outputs["Color"]


def _uv(tree: Any) -> Any:
    return stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]


def _colored(name: str, color: Any) -> Any:
    return stage.material(name, lambda tree: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color(tree)}))


STOPS = [(0.1, (0.1, 0.2, 0.8)), (0.5, (0.9, 0.9, 0.2)), (0.8, (0.7, 0.1, 0.1))]


def _waves(tree: Any) -> Any:
    parts = stage.node(tree, "ShaderNodeSeparateXYZ", {0: _uv(tree)})
    x = stage.node(tree, "ShaderNodeMath", {0: parts.outputs["X"], 1: 25.0}, operation="MULTIPLY")
    y = stage.node(tree, "ShaderNodeMath", {0: parts.outputs["Y"], 1: 0.3}, operation="POWER")
    wave = stage.node(tree, "ShaderNodeMath", {0: stage.node(tree, "ShaderNodeMath", {0: x}, operation="SINE"), 1: 0.5,
                                               2: 0.5}, operation="MULTIPLY_ADD")  # fmt: skip
    return stage.node(tree, "ShaderNodeCombineColor", {0: wave, 1: y, 2: stage.node(
        tree, "ShaderNodeMath", {0: wave, 1: y}, operation="MINIMUM", use_clamp=True)})  # fmt: skip


def _blends(tree: Any) -> Any:
    parts = stage.node(tree, "ShaderNodeSeparateXYZ", {0: _uv(tree)})
    out = stage.node(tree, "ShaderNodeRGB").outputs[0]
    out.default_value = (0.8, 0.4, 0.3, 1.0)
    for mode, color in (("MULTIPLY", (0.9, 0.8, 0.5)), ("SCREEN", (0.1, 0.2, 0.4)), ("OVERLAY", (0.4, 0.7, 0.5))):
        mixed = stage.node(tree, "ShaderNodeMix", data_type="RGBA", blend_type=mode)
        tree.links.new(parts.outputs["X"], mixed.inputs[0])
        tree.links.new(out, mixed.inputs[6])
        mixed.inputs[7].default_value = (*color, 1.0)
        out = mixed.outputs[2]
    return stage.node(tree, "ShaderNodeHueSaturation", {"Hue": 0.55, "Saturation": 1.2, "Color": out})


def _adjusted(tree: Any) -> Any:
    ramp = _ramp(tree, stage.node(tree, "ShaderNodeSeparateXYZ", {0: _uv(tree)}).outputs["X"], STOPS)
    bright = stage.node(tree, "ShaderNodeBrightContrast", {"Color": ramp, "Bright": 0.05, "Contrast": 0.2})
    return stage.node(tree, "ShaderNodeGamma", {"Color": bright, "Gamma": 1.4})


def _mapped(tree: Any) -> Any:
    x = stage.node(tree, "ShaderNodeSeparateXYZ", {0: _uv(tree)}).outputs["X"]
    value = stage.node(tree, "ShaderNodeMapRange", {"Value": x, "From Min": 0.2, "From Max": 0.8, "To Min": 1.0,
                                                    "To Max": 0.0}, interpolation_type="SMOOTHSTEP")  # fmt: skip
    return _ramp(tree, value, STOPS, "EASE")


@case("Math, Mix, ramp, Map Range, Hue/Saturation, Gamma, gradient and checker nodes")
def node_math() -> None:
    """Balls coloured by expressions of UV."""
    stage.studio()
    x = lambda tree: stage.node(tree, "ShaderNodeSeparateXYZ", {0: _uv(tree)}).outputs["X"]  # noqa: E731
    stage.row([_colored("Waves", _waves), _colored("Blends", _blends), _colored("Adjusted", _adjusted),
               _colored("Mapped", _mapped), _colored("Constant ramp", lambda t: _ramp(t, x(t), STOPS, "CONSTANT"))],
              y=-0.8)  # fmt: skip
    stage.row([
        _colored("Linear ramp", lambda t: _ramp(t, x(t), STOPS)),
        _colored("Gradient", lambda t: _ramp(t, stage.node(t, "ShaderNodeTexGradient", {0: _uv(t)}).outputs[1], STOPS)),
        _colored("Checker", lambda t: stage.node(t, "ShaderNodeTexChecker", {
            "Vector": _uv(t), "Scale": 10.0, "Color1": (0.8, 0.2, 0.1), "Color2": (0.1, 0.3, 0.6)})),
        _colored("Mix before 3.4", lambda t: stage.node(t, "ShaderNodeMixRGB", {
            0: x(t), 1: (0.05, 0.05, 0.05), 2: (0.8, 0.7, 0.6)})),
    ], y=0.8)  # fmt: skip


@case("Noise, Voronoi, Wave, Magic and Brick textures")
def procedural_textures() -> None:
    """Balls with Blender's procedural textures."""
    stage.studio()

    def texture(name: str, kind: str, output: str = "Color", **inputs: Any) -> Any:
        return _colored(name, lambda t: stage.node(t, kind, {"Vector": _uv(t), **inputs}).outputs[output])

    stage.row([texture("Noise", "ShaderNodeTexNoise", Scale=8.0), texture("Voronoi", "ShaderNodeTexVoronoi", Scale=8.0),
               texture("Wave", "ShaderNodeTexWave", Scale=3.0), texture("Magic", "ShaderNodeTexMagic", Scale=4.0),
               texture("Brick", "ShaderNodeTexBrick", Scale=4.0)], y=0.0)  # fmt: skip


def _normal_map() -> Any:
    """Round bumps in a square grid, as a tangent-space normal map."""
    size, cells = 128, 8
    y, x = ((np.mgrid[0:size, 0:size] + 0.5) / size * cells) % 1.0 * 2.0 - 1.0
    inside = np.hypot(x, y) < 0.7
    n = np.stack([np.where(inside, 0.7 * x, 0.0), np.where(inside, -0.7 * y, 0.0), np.zeros_like(x)], axis=-1)
    n[..., 2] = np.sqrt(1.0 - n[..., 0] ** 2 - n[..., 1] ** 2)
    return stage.image("Bumps", 0.5 * n + 0.5, "Non-Color", is_float=True)


@case("Normal maps on diffuse, dielectric and metal; strength")
def normal_maps() -> None:
    """Balls and a tilted tile."""
    stage.studio()
    bumps = _normal_map()

    def bumpy(name: str, strength: float, **inputs: Any) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=bumps)
            normal = stage.node(tree, "ShaderNodeNormalMap", {"Strength": strength, "Color": texture.outputs["Color"]},
                                uv_map="UVMap")  # fmt: skip
            values = {key.replace("_", " "): value for key, value in inputs.items()}
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {**values, "Normal": normal})

        return stage.material(name, shader)

    stage.row(
        [
            bumpy("Diffuse", 1.0, Specular_IOR_Level=0.0),
            bumpy("Weak", 0.3, Specular_IOR_Level=0.0),
            bumpy("Plastic", 1.0, Roughness=0.3),
            bumpy("Metal", 0.5, Metallic=1.0, Roughness=0.3),
        ],
        y=-0.8,
    )
    tile = bumpy("Tile", 1.0, Roughness=0.4)
    stage.add("Tile", stage.plane("Tile", tile, size=2.0), (-1.2, 1.2, 0.9), (1.1, 0, 0.2))
    turned = stage.plane("Turned tile", tile, size=1.8)
    for corner in turned.uv_layers[0].uv:
        corner.vector = (1.0 - corner.vector[1], corner.vector[0])
    stage.add("Turned tile", turned, (1.2, 1.2, 0.9), (1.1, 0, -0.2))


@case("Colour attributes per corner and per vertex, float and byte, and other attributes")
def color_attributes() -> None:
    """Balls and a grid coloured by their meshes."""
    stage.studio()
    rng = np.random.default_rng(7)

    def painted(name: str, layer: str) -> Any:
        return _colored(name, lambda t: stage.node(t, "ShaderNodeVertexColor", layer_name=layer).outputs["Color"])

    for k, (kind, domain) in enumerate((("FLOAT_COLOR", "POINT"), ("FLOAT_COLOR", "CORNER"), ("BYTE_COLOR", "POINT"),
                                        ("BYTE_COLOR", "CORNER"))):  # fmt: skip
        name = f"{kind} {domain}"
        ball = stage.sphere(name, painted(name, "Paint"), radius=0.6, segments=16)
        layer = ball.color_attributes.new("Paint", kind, domain)
        layer.data.foreach_set("color", rng.uniform(0.0, 1.0, (len(layer.data), 4)).ravel())
        stage.add(name, ball, (1.5 * (k - 1.5), -0.5, 0.6))
    values = _colored(
        "Per face",
        lambda t: _ramp(t, stage.node(t, "ShaderNodeAttribute", attribute_name="Value").outputs["Fac"], STOPS),
    )
    board = stage.grid("Per face", values, size=2.0)
    layer = board.attributes.new("Value", "FLOAT", "FACE")
    layer.data.foreach_set("value", rng.uniform(0.0, 1.0, len(layer.data)))
    stage.add("Per face", board, (0.0, 1.3, 0.9), (1.0, 0, 0))

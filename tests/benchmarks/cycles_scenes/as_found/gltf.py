"""Materials as importers of glTF files make them."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case

WHITE = (1.0, 1.0, 1.0)


def _picture(name: str, low: float = 0.05, high: float = 0.95, **settings: Any) -> Any:
    pixels = np.random.default_rng(len(name)).uniform(low, high, (16, 16, 3)).repeat(4, 0).repeat(4, 1)
    return stage.image(name, pixels, **settings)


def _texture(tree: Any, image: Any, **settings: Any) -> Any:
    uv = stage.node(tree, "ShaderNodeUVMap", uv_map="UVMap")
    mapping = stage.node(tree, "ShaderNodeMapping", {"Vector": uv, "Scale": (2.0, 1.0, 1.0)}, vector_type="POINT")
    return stage.node(tree, "ShaderNodeTexImage", {"Vector": mapping}, image=image, **settings)


def _bumps() -> Any:
    x, y = np.meshgrid(*[np.linspace(0.0, 4.0 * np.pi, 64)] * 2)
    tilt = np.stack([0.5 + 0.2 * np.sin(x), 0.5 + 0.2 * np.sin(y), np.full_like(x, 0.93)], axis=-1)
    return stage.image("Normals", tilt, "Non-Color")


def _occlusion(tree: Any, image: Any) -> None:
    """The node group that keeps a file's ambient occlusion, which no shader uses."""
    group = bpy.data.node_groups.new("glTF Material Output", "ShaderNodeTree")
    group.interface.new_socket("Occlusion", in_out="INPUT", socket_type="NodeSocketFloat")
    made = tree.nodes.new("ShaderNodeGroup")
    made.node_tree = group
    parts = stage.node(tree, "ShaderNodeSeparateColor", {0: _texture(tree, image)})
    tree.links.new(parts.outputs[0], made.inputs["Occlusion"])


@case("glTF: metal-rough textures, occlusion, vertex colours, emission, normal maps")
def gltf_metal_rough() -> None:
    """One texture has occlusion, roughness and metallic; the base colour is a texture times a factor."""
    stage.studio(width=5.0)
    packed, base = _picture("ORM", colorspace="Non-Color"), _picture("Base colour")

    def shader(tree: Any) -> Any:
        parts = stage.node(tree, "ShaderNodeSeparateColor", {0: _texture(tree, packed)})
        color = stage.node(tree, "ShaderNodeMix", data_type="RGBA", blend_type="MULTIPLY")
        color.inputs["Factor"].default_value = 1.0
        tree.links.new(_texture(tree, base).outputs[0], color.inputs[6])
        color.inputs[7].default_value = (0.9, 0.7, 0.5, 1.0)
        normal = stage.node(tree, "ShaderNodeNormalMap", {"Color": _texture(tree, _bumps())}, uv_map="UVMap")
        _occlusion(tree, packed)
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {
            "Base Color": color.outputs[2], "Roughness": parts.outputs[1], "Metallic": parts.outputs[2],
            "Normal": normal, "Emission Color": _texture(tree, base), "Emission Strength": 0.3})  # fmt: skip

    def painted(tree: Any) -> Any:
        attribute = stage.node(tree, "ShaderNodeVertexColor", layer_name="Color")
        color = stage.node(tree, "ShaderNodeMixRGB", {0: 1.0, 1: _texture(tree, base), 2: attribute},
                           blend_type="MULTIPLY")  # fmt: skip
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": color, "Alpha": attribute.outputs["Alpha"]})

    balls = stage.row([stage.material("Metal rough", shader), stage.material("Painted", painted)], radius=0.7, gap=1.6)
    for ball in balls:
        layer = ball.data.color_attributes.new("Color", "BYTE_COLOR", "CORNER")
        values = np.random.default_rng(5).uniform(0.3, 1.0, (len(layer.data), 4)).astype(np.float32)
        layer.data.foreach_set("color", values.ravel())


@case("glTF: clearcoat over a normal map, with a normal map of its own or none", samples=96)
def gltf_clearcoat() -> None:
    """Coats of lacquer: carbon fibre, car paint, wood."""
    stage.studio(width=5.0)
    bumps = _bumps()

    def coated(own: bool, metallic: float) -> Any:
        def shader(tree: Any) -> Any:
            normal = stage.node(tree, "ShaderNodeNormalMap", {"Color": _texture(tree, bumps)}, uv_map="UVMap")
            made = stage.node(tree, "ShaderNodeBsdfPrincipled", {
                "Base Color": (0.6, 0.1, 0.05), "Roughness": 0.45, "Metallic": metallic, "Normal": normal,
                "Coat Weight": 1.0, "Coat Roughness": 0.1})  # fmt: skip
            if own:
                other = stage.node(tree, "ShaderNodeNormalMap", {"Strength": 0.3, "Color": _texture(tree, bumps)},
                                   uv_map="UVMap")  # fmt: skip
                tree.links.new(other.outputs[0], made.inputs["Coat Normal"])
            return made

        return stage.material(f"Coat {own} {metallic}", shader)

    stage.row([coated(own, metallic) for own in (False, True) for metallic in (0.0, 1.0)], radius=0.6, gap=1.3)


@case("glTF: alpha as cut-out, blended and unlit materials", bounces=4)
def gltf_alpha() -> None:
    """MASK is arithmetic, BLEND is alpha, unlit is a mix with Light Path."""
    stage.studio(width=5.0)
    pixels = np.random.default_rng(2).uniform(0.1, 0.9, (16, 16, 4)).repeat(4, 0).repeat(4, 1)
    image = stage.image("With alpha", pixels)

    def masked(tree: Any) -> Any:
        found = _texture(tree, image)
        below = stage.node(tree, "ShaderNodeMath", {0: found.outputs["Alpha"], 1: 0.5}, operation="LESS_THAN")
        alpha = stage.node(tree, "ShaderNodeMath", {0: 1.0, 1: below}, operation="SUBTRACT")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": found.outputs[0], "Alpha": alpha})

    def rounded(tree: Any) -> Any:
        found = _texture(tree, image)
        alpha = stage.node(tree, "ShaderNodeMath", {0: found.outputs["Alpha"]}, operation="ROUND")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": found.outputs[0], "Alpha": alpha})

    def blended(tree: Any) -> Any:
        found = _texture(tree, image)
        factor = stage.node(tree, "ShaderNodeMath", {0: found.outputs["Alpha"], 1: 0.7}, operation="MULTIPLY")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": found.outputs[0], "Alpha": factor})

    def unlit(tree: Any) -> Any:
        path = stage.node(tree, "ShaderNodeLightPath")
        seen = stage.node(tree, "ShaderNodeMixShader", {
            "Fac": path.outputs["Is Camera Ray"], 1: stage.node(tree, "ShaderNodeBsdfTransparent"),
            2: stage.node(tree, "ShaderNodeEmission", {"Color": _texture(tree, image)})})  # fmt: skip
        return stage.node(
            tree,
            "ShaderNodeMixShader",
            {"Fac": _texture(tree, image).outputs["Alpha"], 1: stage.node(tree, "ShaderNodeBsdfTransparent"), 2: seen},
        )

    def background(tree: Any) -> Any:
        path = stage.node(tree, "ShaderNodeLightPath")
        return stage.node(tree, "ShaderNodeMixShader", {
            "Fac": path.outputs["Is Camera Ray"], 1: stage.node(tree, "ShaderNodeBsdfTransparent"),
            2: stage.node(tree, "ShaderNodeBackground", {"Color": _texture(tree, image)})})  # fmt: skip

    made = [stage.material(one.__name__, one) for one in (masked, rounded, blended, unlit, background)]
    stage.row(made, radius=0.5, gap=1.15)


@case("glTF: transmission with an absorbing volume, specular and sheen extensions", bounces=8, samples=96)
def gltf_extensions() -> None:
    """KHR_materials_transmission and _volume, _specular, _sheen, _ior."""
    stage.studio(width=5.0)

    def glass(density: float) -> Any:
        def shader(tree: Any) -> Any:
            made = stage.node(tree, "ShaderNodeBsdfPrincipled", {
                "Base Color": WHITE, "Transmission Weight": 1.0, "Roughness": 0.05, "IOR": 1.45})  # fmt: skip
            volume = stage.node(tree, "ShaderNodeVolumeAbsorption", {"Color": (0.9, 0.5, 0.3), "Density": density})
            output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL") if any(
                node.type == "OUTPUT_MATERIAL" for node in tree.nodes) else None  # fmt: skip
            made_output = output or stage.node(tree, "ShaderNodeOutputMaterial")
            tree.links.new(volume.outputs[0], made_output.inputs["Volume"])
            tree.links.new(made.outputs[0], made_output.inputs["Surface"])
            return made

        made = bpy.data.materials.new(f"Glass {density}")
        made.use_nodes = True
        made.node_tree.nodes.clear()
        shader(made.node_tree)
        return made

    stage.row(
        [
            glass(0.0),
            glass(1.0),
            stage.principled("Specular", (0.2, 0.3, 0.6), Specular_Tint=(1, 0.4, 0.2, 1.0)),
            stage.principled("Sheen", (0.3, 0.05, 0.1), Sheen_Weight=1.0, Sheen_Roughness=0.3),
        ],
        radius=0.6,
    )

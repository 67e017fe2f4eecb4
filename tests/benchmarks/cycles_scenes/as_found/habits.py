"""What files of beginners have: images, layers, worlds and nodes of old versions."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def small(width: float = 5.5) -> Any:
    """A small picture of the studio; returns Blender's scene."""
    stage.studio(width=width)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    return scene


def checks(name: str, space: str = "sRGB", size: int = 16, alpha: bool = False) -> Any:
    """An image of coloured squares, half transparent in stripes."""
    y, x = np.mgrid[0:size, 0:size]
    pixels = np.stack([0.2 + 0.6 * ((x // 4 + y // 4) % 2), x / size, y / size], axis=-1)
    if alpha:
        pixels = np.concatenate([pixels, 0.25 + 0.5 * ((x // 2) % 2)[..., None]], axis=-1)
    return stage.image(name, pixels, space)


def textured(name: str, image: Any, socket: str = "Color", **settings: Any) -> Any:
    def shader(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=image, **settings)
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[socket]})

    return stage.material(name, shader)


@case("Alpha modes of images: straight, premultiplied, packed channels, none; colour and alpha", bounces=2)
def alpha_modes() -> None:
    """Stickers and masks."""
    small()
    for k, mode in enumerate(("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")):
        for j, socket in enumerate(("Color", "Alpha")):
            image = checks(f"{mode} {socket}", alpha=True)
            image.alpha_mode = mode
            card = stage.plane(f"{mode} {socket}", textured(f"{mode} {socket}", image, socket), size=0.9)
            stage.add(f"{mode} {socket}", card, (-1.6 + 1.05 * k, 1.1 * j - 0.5, 0.05), (0.3, 0, 0))


@case("Colour spaces of images: Raw, Filmic, AgX, ACEScg, Rec.2020, Display P3, XYZ, of bytes and floats", bounces=2)
def color_spaces() -> None:
    """Images as other programs wrote them."""
    small()
    known = {
        one.identifier for one in bpy.types.ColorManagedInputColorspaceSettings.bl_rna.properties["name"].enum_items
    }
    wanted = (
        "Raw",
        "Non-Color",
        "Filmic sRGB",
        "AgX Base sRGB",
        "AgX Log",
        "ACEScg",
        "Linear Rec.2020",
        "Display P3",
        "Linear CIE-XYZ D65",
        "Rec.1886",
    )
    for k, space in enumerate(name for name in wanted if name in known):
        y, x = np.mgrid[0:8, 0:8] / 8.0
        pixels = np.stack([0.1 + 0.7 * x, 0.1 + 0.5 * y, 0.4 - 0.3 * x * y], axis=-1).astype(np.float32)
        image = stage.image(space, pixels, space, is_float=k % 2 == 1)
        card = stage.plane(space, textured(space, image), size=0.75)
        stage.add(space, card, (-1.7 + 0.85 * (k % 5), 0.9 * (k // 5) - 0.4, 0.05), (0.3, 0, 0))


@case("Several UV maps and colour layers: active, for rendering, named, missing, after a Join", bounces=2)
def several_layers() -> None:
    """The second map is for rendering; the first is active."""
    small()

    def by(name: str, layer: str | None) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=checks(name), interpolation="Closest")
            if layer is not None:
                where = stage.node(tree, "ShaderNodeUVMap", uv_map=layer)
                tree.links.new(where.outputs[0], texture.inputs[0])
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[0]})

        return stage.material(name, shader)

    def colored(name: str, layer: str, kind: str) -> Any:
        def shader(tree: Any) -> Any:
            if kind == "VERTEX":
                read = stage.node(tree, "ShaderNodeVertexColor", layer_name=layer)
            else:
                read = stage.node(tree, "ShaderNodeAttribute", attribute_name=layer)
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": read.outputs[0]})

        return stage.material(name, shader)

    made = [
        by("Default", None),
        by("First", "UVMap"),
        by("Second", "Second"),
        by("Missing", "gone"),
        colored("Empty name", "", "VERTEX"),
        colored("Byte", "Byte", "VERTEX"),
        colored("Float", "Float", "ATTRIBUTE"),
        colored("No layer", "gone", "ATTRIBUTE"),
    ]
    for k, one in enumerate(made):
        mesh = stage.grid(one.name, one, size=0.9, cells=2)
        second = mesh.uv_layers.new(name="Second")
        for j, uv in enumerate(second.data):
            uv.uv = (0.3 + 0.4 * mesh.uv_layers[0].data[j].uv[1], 2.0 * mesh.uv_layers[0].data[j].uv[0])
        second.active_render, mesh.uv_layers.active_index = True, 0
        byte = mesh.color_attributes.new("Byte", "BYTE_COLOR", "CORNER")
        floats = mesh.color_attributes.new("Float", "FLOAT_COLOR", "POINT")
        for j, value in enumerate(byte.data):
            value.color = (0.2 + 0.1 * (j % 7), 0.6, 0.1 * (j % 5), 1.0)
        for j, value in enumerate(floats.data):
            value.color = (0.9 - 0.1 * j, 0.2, 0.1 * j, 0.5)
        mesh.color_attributes.active_color_index, mesh.color_attributes.render_color_index = 0, 1
        stage.add(one.name, mesh, (-1.6 + 1.05 * (k % 4), 1.1 * (k // 4) - 0.5, 0.05), (0.3, 0, 0))


@case("Skies and panoramas within materials; profiles and gradients in emission", bounces=3, samples=64)
def skies_in_materials() -> None:
    """Fake reflections."""
    small()

    def shader_of(kind: str, where: str, **settings: Any) -> Any:
        def shader(tree: Any) -> Any:
            place = stage.node(tree, "ShaderNodeTexCoord").outputs[where]
            texture = stage.node(tree, kind, **settings)
            tree.links.new(place, texture.inputs[0])
            return stage.node(tree, "ShaderNodeEmission", {"Color": texture.outputs[0], "Strength": 0.4})

        return stage.material(f"{kind} {where}", shader)

    panorama = stage.image(
        "Around",
        np.random.default_rng(3).uniform(0.1, 0.9, (8, 16, 3)).astype(np.float32),
        "Linear Rec.709",
        is_float=True,
    )
    stage.row(
        [
            shader_of("ShaderNodeTexEnvironment", "Normal", image=panorama),
            shader_of("ShaderNodeTexEnvironment", "Reflection", image=panorama),
            shader_of("ShaderNodeTexEnvironment", "Generated", image=panorama, projection="MIRROR_BALL"),
            shader_of("ShaderNodeTexGradient", "Reflection", gradient_type="SPHERICAL"),
        ],
        segments=32,
    )


@case("Worlds: two Backgrounds mixed by the direction, one added, an Emission and a Transparent shader", bounces=2)
def world_mixes() -> None:
    """Horizon lines of tutorials."""
    small()
    tree = bpy.context.scene.world.node_tree
    where = stage.node(
        tree, "ShaderNodeSeparateXYZ", {0: stage.node(tree, "ShaderNodeNewGeometry").outputs["Incoming"]}
    )
    up = stage.node(tree, "ShaderNodeMath", {0: where.outputs[2], 1: -0.1}, operation="LESS_THAN")
    low = stage.node(tree, "ShaderNodeBackground", {"Color": (0.3, 0.2, 0.1), "Strength": 0.5})
    high = stage.node(tree, "ShaderNodeEmission", {"Color": (0.2, 0.4, 0.8), "Strength": 0.7})
    mixed = stage.node(tree, "ShaderNodeMixShader", {0: up, 1: low, 2: high})
    faint = stage.node(
        tree, "ShaderNodeMixShader", {0: 0.3, 1: mixed, 2: stage.node(tree, "ShaderNodeBsdfTransparent")}
    )
    whole = stage.node(
        tree, "ShaderNodeAddShader", {0: faint, 1: stage.node(tree, "ShaderNodeBackground", {0: (0.1, 0.0, 0.1)})}
    )
    tree.links.new(whole.outputs[0], tree.nodes["World Output"].inputs[0])
    stage.row(
        [stage.diffuse("Chalk"), stage.principled("Metal", Metallic=1.0, Roughness=0.15), stage.principled("Plastic")]
    )


@case(
    "Normal maps in object, world and Blender's spaces, of a missing map, beside Normal and Vector Transform nodes",
    samples=64,
)
def normal_spaces() -> None:
    """Baked by other programs."""
    small()
    generator = np.random.default_rng(2)
    tilted = np.concatenate([0.15 * generator.uniform(-1, 1, (16, 16, 2)), np.full((16, 16, 1), 0.9)], axis=-1)
    v, u = ((np.mgrid[0:128, 0:256] + 0.5).T / (128, 256)).T
    turn, height = 2.0 * np.pi * (u - 0.5), np.pi * (0.5 - v)
    around = np.stack([np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)], axis=-1)
    around += 0.3 * np.sin(24.0 * np.pi * u)[..., None] * np.stack([-np.sin(turn), np.cos(turn), 0.0 * turn], axis=-1)
    around /= np.linalg.norm(around, axis=-1, keepdims=True)
    maps = {"TANGENT": tilted, "OBJECT": around, "BLENDER_OBJECT": around * (1, -1, -1)}
    images = {space: stage.image(space, 0.5 + 0.5 * vectors, "Non-Color") for space, vectors in maps.items()}

    def mapped(space: str, uv: str = "", strength: float = 1.0) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=images[space.replace("WORLD", "OBJECT")])
            normal = stage.node(
                tree, "ShaderNodeNormalMap", {"Color": texture.outputs[0], "Strength": strength}, space=space, uv_map=uv
            )
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.5, 0.5, 0.6), "Normal": normal})

        return stage.material(f"{space} {uv} {strength}", shader)

    def turned(tree: Any) -> Any:
        normal = stage.node(tree, "ShaderNodeNewGeometry").outputs["Normal"]
        moved = stage.node(
            tree,
            "ShaderNodeVectorTransform",
            {0: normal},
            vector_type="NORMAL",
            convert_from="WORLD",
            convert_to="CAMERA",
        )
        dot = stage.node(tree, "ShaderNodeNormal", {0: moved})
        return stage.node(
            tree,
            "ShaderNodeBsdfDiffuse",
            {
                "Color": stage.node(
                    tree, "ShaderNodeMixRGB", {0: dot.outputs["Dot"], 1: (0.1, 0.2, 0.6), 2: (0.8, 0.5, 0.2)}
                )
            },
        )

    stage.row(
        [mapped("OBJECT"), mapped("WORLD"), mapped("BLENDER_OBJECT"), mapped("BLENDER_WORLD")], y=-0.6, radius=0.5
    )
    stage.row(
        [mapped("TANGENT", "gone"), mapped("TANGENT", "", 2.5), stage.material("Turned", turned)], y=0.8, radius=0.5
    )


@case("Old mappings: a texture's own mapping and colours, all types of Mapping, nested groups", bounces=2)
def old_mappings() -> None:
    """Values that the interface no longer shows."""
    small()
    image = checks("Checks")

    def own(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=image)
        mapping, colors = texture.texture_mapping, texture.color_mapping
        mapping.scale, mapping.translation, mapping.rotation = (2.0, 0.5, 1.0), (0.2, 0.1, 0.0), (0.0, 0.0, 0.4)
        mapping.vector_type = "POINT"
        colors.brightness, colors.contrast, colors.saturation = 1.3, 0.8, 0.5
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[0]})

    def mapped(kind: str) -> Any:
        def shader(tree: Any) -> Any:
            where = stage.node(
                tree,
                "ShaderNodeMapping",
                {
                    "Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"],
                    "Rotation": (0.3, 0.2, 0.5),
                    "Scale": (3.0, 0.5, -1.5),
                },
                vector_type=kind,
            )
            return stage.node(
                tree,
                "ShaderNodeBsdfDiffuse",
                {"Color": stage.node(tree, "ShaderNodeTexChecker", {"Vector": where, "Scale": 2.0})},
            )

        return stage.material(kind, shader)

    def nested(tree: Any) -> Any:
        inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
        outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
        for group in (inner, outer):
            group.interface.new_socket("Tone", in_out="INPUT", socket_type="NodeSocketColor")
            group.interface.new_socket("Power", in_out="INPUT", socket_type="NodeSocketFloat")
            group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
        start, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
        gamma = stage.node(inner, "ShaderNodeGamma", {0: start.outputs[0], 1: start.outputs[1]})
        inner.links.new(gamma.outputs[0], end.inputs[0])
        start, end = outer.nodes.new("NodeGroupInput"), outer.nodes.new("NodeGroupOutput")
        twice = [stage.node(outer, "ShaderNodeGroup", node_tree=inner) for _ in range(2)]
        outer.links.new(start.outputs[0], twice[0].inputs[0])
        outer.links.new(start.outputs[1], twice[0].inputs[1])
        outer.links.new(twice[0].outputs[0], twice[1].inputs[0])
        twice[1].inputs[1].default_value = 0.5
        outer.links.new(twice[1].outputs[0], end.inputs[0])
        used = stage.node(tree, "ShaderNodeGroup", node_tree=outer)
        used.inputs[0].default_value, used.inputs[1].default_value = (0.7, 0.3, 0.2, 1.0), 2.2
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": used.outputs[0]})

    stage.add("Own", stage.plane("Own", stage.material("Own", own), size=1.2), (-1.4, 0.9, 0.1), (0.4, 0, 0))
    stage.add("Nested", stage.sphere("Nested", stage.material("Nested", nested), radius=0.5), (0.4, 0.9, 0.5))
    stage.row([mapped(kind) for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL")], y=-0.6, radius=0.5)

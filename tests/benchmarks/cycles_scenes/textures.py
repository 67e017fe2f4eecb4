"""Image textures: colour spaces, interpolation, extension, mapping, UV maps, roles other than colour."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import stage
from .case import case


def picture(size: int = 32, alpha: bool = False) -> NDArray[np.float32]:
    """A colourful picture with hard and soft parts, without symmetry; alpha is a disk."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    out = np.stack([x, y, 0.5 + 0.5 * np.sin(12.0 * x * y)], axis=-1)
    out[(np.floor(4 * x) + np.floor(4 * y)) % 2 == 0] *= 0.45
    out[: size // 4, : size // 4] = (1.0, 0.9, 0.1)
    if alpha:
        disk = np.hypot(x - 0.5, y - 0.5) < 0.42
        out = np.concatenate([out, disk[..., None]], axis=-1)
    return out.astype(np.float32)


def _textured(name: str, settings: dict[str, Any], mapping: dict[str, Any] | None = None, uv: str = "UVMap",
              kind: str = "POINT") -> Any:  # fmt: skip
    def shader(tree: Any) -> Any:
        where = stage.node(tree, "ShaderNodeUVMap", uv_map=uv)
        if mapping:
            where = stage.node(tree, "ShaderNodeMapping", {"Vector": where, **mapping}, vector_type=kind)
        texture = stage.node(tree, "ShaderNodeTexImage", {"Vector": where}, **settings)
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs["Color"]})

    return stage.material(name, shader)


def _tiles(materials: list[Any], y: float, z: float) -> None:
    for k, one in enumerate(materials):
        tile = stage.plane(one.name, one, size=1.15)
        second = tile.uv_layers.new(name="Second", do_init=True)
        for corner in second.uv:
            corner.vector = (corner.vector[1] * 0.5, 1.0 - corner.vector[0])
        stage.add(one.name, tile, (1.25 * (k - 2), y, z), (1.1, 0, 0))


def _lights() -> None:
    stage.studio()
    bpy.context.scene.camera.location = (0.0, -5.2, 2.6)
    bpy.context.scene.camera.rotation_euler = stage.aim((0.0, -5.2, 2.6), (0, 0.4, 0.95))


@case("Image textures: colour space, interpolation, extension, mapping, second UV map")
def image_textures() -> None:
    """Tiles: one setting each."""
    _lights()
    srgb = stage.image("Picture", picture())
    data = stage.image("Data", picture(), "Non-Color")
    deep = stage.image("Deep", picture() ** 2, "Linear Rec.709", is_float=True)
    tiled = {"Location": (-0.3, -0.35, 0.0), "Scale": (1.6, 1.6, 1.0)}
    _tiles([
        _textured("sRGB", {"image": srgb}),
        _textured("Non-colour, closest", {"image": data, "interpolation": "Closest"}),
        _textured("Float, cubic", {"image": deep, "interpolation": "Cubic"}),
        _textured("Second UV map", {"image": srgb}, uv="Second"),
        _textured("Turned", {"image": srgb}, {"Rotation": (0, 0, 0.4), "Scale": (2.0, 1.0, 1.0)}),
    ], -0.1, 0.5)  # fmt: skip
    _tiles([
        _textured("Repeat", {"image": srgb, "extension": "REPEAT"}, tiled),
        _textured("Extend", {"image": srgb, "extension": "EXTEND"}, tiled),
        _textured("Clip", {"image": srgb, "extension": "CLIP"}, tiled),
        _textured("Mirror", {"image": srgb, "extension": "MIRROR", "interpolation": "Closest"}, tiled),
        _textured("As a texture", {"image": srgb}, {"Location": (0.2, 0.1, 0), "Scale": (0.5, 0.5, 1)}, kind="TEXTURE"),
    ], 0.5, 1.6)  # fmt: skip


@case("Image textures as roughness, metallic, alpha, emission, and by object and generated coordinates")
def image_roles() -> None:
    """Balls and boxes, one role each."""
    _lights()
    color = stage.image("Picture", picture())
    grey = stage.image("Grey", np.repeat(picture()[..., :1], 3, axis=2), "Non-Color")
    holes = stage.image("Holes", picture(alpha=True))

    def role(name: str, picture: Any, target: str, output: str = "Color", **inputs: Any) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=picture)
            values = {key.replace("_", " "): value for key, value in inputs.items()}
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {**values, target: texture.outputs[output]})

        return stage.material(name, shader)

    def placed(name: str, output: str, **inputs: Any) -> Any:
        def shader(tree: Any) -> Any:
            where = stage.node(tree, "ShaderNodeTexCoord").outputs[output]
            where = stage.node(tree, "ShaderNodeMapping", {"Vector": where, **inputs})
            texture = stage.node(tree, "ShaderNodeTexImage", {"Vector": where}, image=color)
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs["Color"]})

        return stage.material(name, shader)

    stage.row([
        role("Roughness", grey, "Roughness", Base_Color=(0.8, 0.5, 0.3), Metallic=1.0),
        role("Metallic", grey, "Metallic", Base_Color=(0.8, 0.5, 0.3), Roughness=0.3),
        role("Base colour", color, "Base Color", Roughness=0.4),
        role("Alpha", holes, "Alpha", "Alpha", Base_Color=(0.3, 0.5, 0.8)),
        role("Emission", color, "Emission Color", Emission_Strength=0.7, Base_Color=(0.1, 0.1, 0.1)),
    ], y=-0.5)  # fmt: skip
    for k, one in enumerate([placed("Generated", "Generated"), placed("Object", "Object", Scale=(0.7, 0.7, 0.7)),
                             placed("UV", "UV", Scale=(2, 2, 1))]):  # fmt: skip
        stage.add(one.name, stage.cube(one.name, one, size=1.0), (1.5 * (k - 1), 1.0, 0.7), (0.3, 0.2, 0.5 * k))

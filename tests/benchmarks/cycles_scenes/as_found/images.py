"""Image files: UDIM tiles, sequences, movies, missing alpha, 16 bits, packed and generated images."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _saved(name: str, pixels: Any, file_format: str = "PNG", depth: str = "8") -> str:
    """Path of a file with these pixels."""
    height, width = pixels.shape[:2]
    made = bpy.data.images.new(name, width, height, alpha=pixels.shape[2] == 4, float_buffer=depth != "8")
    full = np.ones((height, width, 4), np.float32)
    full[..., : pixels.shape[2]] = pixels[::-1]
    made.pixels.foreach_set(full.ravel())
    path = Path(tempfile.mkdtemp()) / name
    made.filepath_raw, made.file_format = str(path), file_format
    made.save()
    bpy.data.images.remove(made)
    return str(path)


def _noise(seed: int, color: Any) -> Any:
    return np.random.default_rng(seed).uniform(0.2, 1.0, (8, 8, 1)).repeat(4, 0).repeat(4, 1) * np.array(color)


def _shown(image: Any, name: str, scale: float = 1.0, color: str = "Color", **user: int) -> Any:
    def shader(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeMapping", {
            "Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["UV"], "Scale": (scale,) * 3})  # fmt: skip
        texture = stage.node(tree, "ShaderNodeTexImage", {"Vector": place}, image=image)
        for key, value in user.items():
            setattr(texture.image_user, key, value)
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": texture.outputs[color]})

    return stage.material(name, shader)


@case("UDIM tiles: UVs that reach over three tiles, one of which is missing")
def udim_tiles() -> None:
    """As texture painters deliver them."""
    stage.studio(width=5.0)
    folder = Path(tempfile.mkdtemp())
    image = bpy.data.images.new("Tiles", 32, 32, tiled=True)
    for k, color in ((1001, (0.9, 0.2, 0.1)), (1002, (0.1, 0.7, 0.3)), (1011, (0.2, 0.3, 0.9))):
        path = _saved(f"tile.{k}.png", _noise(k, color))
        Path(path).rename(folder / f"tile.{k}.png")
        if k != 1001:
            image.tiles.new(k)
    image.source = "TILED"
    image.filepath = str(folder / "tile.<UDIM>.png")
    image.reload()
    image.pack()
    made = _shown(image, "Tiles", 1.9)
    stage.row([made], radius=0.8)
    stage.add("Sheet", stage.plane("Sheet", made, size=1.6), (1.9, 0.0, 0.8), (1.1, 0, -0.3))


@case("Image sequences and movies as textures")
def sequences() -> None:
    """The frame of the scene decides which picture is shown."""
    stage.studio(width=5.0)
    folder = Path(tempfile.mkdtemp())
    for k, color in ((1, (0.9, 0.2, 0.1)), (2, (0.1, 0.7, 0.3)), (3, (0.2, 0.3, 0.9))):
        Path(_saved(f"frame_{k:04}.png", _noise(k, color))).rename(folder / f"frame_{k:04}.png")
    image = bpy.data.images.load(str(folder / "frame_0001.png"))
    image.source = "SEQUENCE"
    settings: dict[str, Any] = {"frame_duration": 3, "use_auto_refresh": True}
    stage.row([_shown(image, "Second frame", frame_start=1, **settings), _shown(
        image, "Shifted", frame_start=1, frame_offset=1, **settings), _shown(
        image, "Cyclic", frame_start=-1, use_cyclic=True, **settings)])  # fmt: skip
    bpy.context.scene.frame_set(2)


@case("Images of 16 bits, of floats, with straight alpha, generated, and of other colour spaces")
def image_formats() -> None:
    """EXR and PNG of 16 bits; UV grids; raw data shown as colour."""
    stage.studio(width=5.0)
    deep = bpy.data.images.load(_saved("deep.exr", 2.0 * _noise(4, (0.9, 0.6, 0.3)), "OPEN_EXR", "32"))
    sixteen = bpy.data.images.load(_saved("sixteen.png", _noise(5, (0.3, 0.6, 0.9))))
    sixteen.colorspace_settings.name = "Linear Rec.709"
    generated = bpy.data.images.new("Generated", 64, 64)
    generated.generated_type = "COLOR_GRID"
    filmic = bpy.data.images.load(_saved("raw.png", _noise(6, (0.9, 0.8, 0.3))))
    filmic.colorspace_settings.name = "Non-Color"
    alpha = np.concatenate([_noise(7, (0.8, 0.3, 0.8)), np.random.default_rng(8).uniform(0, 1, (32, 32, 1))], axis=-1)
    straight = bpy.data.images.load(_saved("straight.png", alpha))
    packed = bpy.data.images.load(_saved("channels.png", alpha))
    packed.alpha_mode = "CHANNEL_PACKED"
    unused = bpy.data.images.load(_saved("none.png", alpha))
    unused.alpha_mode = "NONE"
    for one in (deep, sixteen, filmic, straight, packed, unused):
        one.pack()
    stage.row([_shown(one, one.name) for one in (deep, sixteen, generated, filmic)], y=-0.6, radius=0.5, gap=1.15)
    stage.row([*[_shown(one, one.name) for one in (straight, packed, unused)],
               _shown(unused, "Its alpha", color="Alpha")], y=0.7, radius=0.5, gap=1.15)  # fmt: skip

"""Pictures that are frames of movies and sequences, or image datablocks."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad.images.coded import read_coded

from ..evaluation import kept_result
from ..problem import Problem
from .film_files import frame_of_sequence


@dataclass
class Stored:
    """Where the values of a picture are: in a file, or here.

    Attributes
    ----------
    file
        A picture file; None: `values`.
    values
        (H, W, 3 or 4), row 0 on top, straight alpha: code values, or linear light.
    linear
        Whether `values` are linear light.
    """

    file: Path | None = None
    values: NDArray[Any] | None = None
    linear: bool = False


def is_movie(path: Path) -> bool:
    """Whether the name is that of a movie that Blender reads."""
    return path.suffix.lower() in bpy.path.extensions_movie


def stored_file(path: Path, frame: int) -> Stored:
    """Return where the values of a file are: in itself, or in a frame of it if it is a movie."""
    return Stored(values=_movie_frame(path, frame)) if is_movie(path) else Stored(path)


def stored_datablock(name: str, frame: int) -> Stored:
    """Return where the values of an image datablock are.

    Raises
    ------
    Problem
        If there is no such image, or its values can't be read.
    """
    image = bpy.data.images.get(name)
    if image is None:
        raise Problem(f"image '{name}': there is no such image in the .blend; choose one, or a file")
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    if image.source == "MOVIE":
        return Stored(values=_movie_frame(path, frame))
    if image.source == "SEQUENCE":
        return Stored(_numbered(name, path, frame))
    if image.source == "TILED":
        raise Problem(f"image '{name}': has tiles (UDIM), which no camera renders; choose a picture")
    if image.source == "FILE" and image.packed_file is None and not image.is_dirty and path.is_file():
        return Stored(path)
    width, height = image.size
    if image.type == "RENDER_RESULT" or not width * height or not len(image.pixels):
        raise Problem(f"image '{name}': its pixels can't be read; save it as a file and choose the file")
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, image.channels)[::-1]
    if image.channels < 3:
        values = np.repeat(values[..., :1], 3, axis=2)
    if not image.is_float:
        return Stored(values=values.astype(np.float64))
    if values.shape[2] == 4:  # floats are stored with premultiplied colours
        values = np.concatenate([values[..., :3] / np.where(values[..., 3:] > 0.0, values[..., 3:], 1.0),
                                 np.clip(values[..., 3:], 0.0, 1.0)], axis=2)  # fmt: skip
    return Stored(values=np.ascontiguousarray(values), linear=True)


def _numbered(name: str, path: Path, frame: int) -> Path:
    """Return the file of a sequence whose number is that of the frame."""
    found = frame_of_sequence(path, lambda _: frame)
    if found is None:
        raise Problem(f"image '{name}': is a sequence, but the name of its file '{path.name}' has no number; "
                      "choose one that has")  # fmt: skip
    if not found.is_file():
        raise Problem(f"image '{name}': its sequence has no file '{found.name}'; set Frame to one that is there")
    return found


def _movie_frame(path: Path, frame: int) -> NDArray[np.float64]:
    """Return the code values of a frame; Blender's sequencer decodes it, as its images have only their first frame."""
    if not path.is_file():
        raise Problem(f"movie '{path}': there is no such file")
    scene = bpy.data.scenes.new("Edgegrad")
    try:
        editor = scene.sequence_editor_create()
        strips = editor.strips if hasattr(editor, "strips") else editor.sequences
        try:
            strip = strips.new_movie("Movie", str(path), 1, 1)
        except RuntimeError as error:
            raise Problem(f"movie '{path}': can't be read ({str(error).strip()})") from None
        if not strip.elements or not strip.elements[0].orig_width:
            raise Problem(f"movie '{path}': can't be read; it is damaged, or has no pictures")
        count = strip.frame_final_duration
        if not 1 <= frame <= count:
            raise Problem(f"movie '{path}': has {count} frames, but frame {frame} is wanted; set Frame between 1 and "
                          f"{count}")  # fmt: skip
        # Blender renders each scene at the frame of the active one.
        now = bpy.context.scene.frame_current
        strip.frame_start = now + 1 - frame
        strip.colorspace_settings.name = "sRGB"
        render = scene.render
        render.resolution_x, render.resolution_y = strip.elements[0].orig_width, strip.elements[0].orig_height
        render.resolution_percentage, render.dither_intensity = 100, 0.0
        scene.display_settings.display_device, scene.view_settings.view_transform = "sRGB", "Standard"
        render.image_settings.file_format, render.image_settings.color_mode = "PNG", "RGB"
        scene.frame_set(now)
        with tempfile.TemporaryDirectory() as folder, kept_result():
            render.filepath = str(Path(folder) / "frame.png")
            bpy.ops.render.render(write_still=True, scene=scene.name)
            return read_coded(Path(render.filepath)).values
    finally:
        bpy.data.scenes.remove(scene)

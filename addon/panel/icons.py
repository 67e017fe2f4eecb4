"""Icons and pictures in the panel: thumbnails of targets, and the curve of the loss."""

from __future__ import annotations

import functools
from typing import Any

import bpy
import bpy.utils.previews

from ..running.curve import curve
from ..targets.rows import file_of

CURVE_SIZE = 256


class _Held:
    """The pictures; None while the add-on is disabled."""

    pictures: Any = None
    drawn: tuple[int, int] = (0, 0)


def register() -> None:
    """Make the collection of pictures."""
    _Held.pictures = bpy.utils.previews.new()


def unregister() -> None:
    """Give the pictures back."""
    if _Held.pictures is not None:
        bpy.utils.previews.remove(_Held.pictures)
    _Held.pictures = None


@functools.cache
def number(name: str) -> int:
    """Return the number of one of Blender's icons.

    For a button, Blender searches a name among all icons, which takes longer than the rest of a label.
    """
    known = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
    return int(known[name].value)


ADD, REMOVE, MORE, PLAY = map(number, ("ADD", "REMOVE", "DOWNARROW_HLT", "PLAY"))


def thumbnail(path: str) -> int:
    """Return the number of the icon of a picture file; 0: there is none."""
    file = file_of(path)
    if file is None or _Held.pictures is None:
        return 0
    name = f"{file} {file.stat().st_mtime}"
    found = _Held.pictures.get(name) or _Held.pictures.load(name, str(file), "IMAGE")
    return int(found.icon_id)


def loss_curve(losses: list[float]) -> int:
    """Return the number of the icon that shows the curve of the losses."""
    if _Held.pictures is None:
        return 0
    picture = _Held.pictures.get("loss") or _Held.pictures.new("loss")
    state = id(losses), len(losses)
    if state != _Held.drawn:
        _Held.drawn = state
        for size in ("image_size", "icon_size"):
            setattr(picture, size, (CURVE_SIZE, CURVE_SIZE))
        pixels = curve(losses, CURVE_SIZE, CURVE_SIZE).ravel()
        picture.image_pixels_float.foreach_set(pixels)
        picture.icon_pixels_float.foreach_set(pixels)
    return int(picture.icon_id)

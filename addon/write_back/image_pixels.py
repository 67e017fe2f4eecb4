"""Fitted pixels of an image: whether they can be fitted, and their way back into Blender's image."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad.images import linear_to_srgb

from ..animated.refusals import check_own
from ..export.nodes.images import holds_codes, name_of_codes
from ..problem import Problem
from . import image_undo

F64 = NDArray[np.float64]


def exported_image(name: str, images: Any) -> str:
    """Return the name, in the exported scene, of the image whose pixels are fitted; `images` are all that it has.

    Raises
    ------
    Problem
        If there is no such image, or if its pixels are not those that are rendered; names it.
    """
    where, image = f"image '{name}'", find_image(name)
    found = [key for key in (name, name_of_codes(name)) if key in images]
    if image is None or not found:
        known = ", ".join(f"'{one.name_full}'" for one in bpy.data.images
                          if {one.name_full, name_of_codes(one.name_full)} & set(images)) or "none"  # fmt: skip
        raise Problem(f"{where}: no image of this name is rendered (known: {known})")
    if len(found) > 1:
        raise Problem(f"{where}: is read both as a color and as data, so it has two kinds of pixels; use a copy of it "
                      "for one of the two")  # fmt: skip
    height, width, channels = images[found[0]].pixels.shape
    if (width, height) != tuple(image.size):
        raise Problem(f"{where}: is rendered with {width} x {height} of its {image.size[0]} x {image.size[1]} pixels; "
                      "switch the texture limit of Simplify off, or scale the image")  # fmt: skip
    if channels != 3:
        raise Problem(f"{where}: has transparent pixels, so its colors can't be fitted; remove its alpha channel")
    check_image(image, name)
    return found[0]


def find_image(name: str) -> Any:
    """Return the image of this full name, which has its library; None: there is none."""
    return next((image for image in bpy.data.images if image.name_full == name), None)


def check_image(image: Any, name: str) -> None:
    """Raise `Problem` unless the pixels of an image can be written."""
    where = f"image '{name}'"
    if image is None:
        raise Problem(f"{where}: there is no such image")
    check_own(where, image)
    if image.channels < 3:
        raise Problem(f"{where}: is gray, so it has no place for the colors that a fit finds; convert it to RGB")


def write_pixels(image: Any, pixels: F64, codes: bool) -> None:
    """Write pixels (h, w, 3), row 0 on top, as code values or linear light; the image is packed into the .blend.

    The file of the image stays as it is.
    """
    height, width = pixels.shape[:2]
    if tuple(image.size) != (width, height):
        raise Problem(f"image '{image.name_full}': has another size than when the fit began; undo that change")
    stored = np.ones((height, width, image.channels), np.float32)
    stored[..., :3] = linear_to_srgb(pixels) if not codes and holds_codes(image) else pixels
    image_undo.remember(image)
    image.pixels.foreach_set(np.ascontiguousarray(stored[::-1]).ravel())
    image.update()
    image.pack()
    image_undo.remember(image)

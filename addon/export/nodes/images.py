"""Export of Blender's images to linear arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.images import srgb_to_linear

from ..bakes.image_cache import is_float, keep, kept, key_of, was_readable

DATA_SPACES = ("Non-Color", "Raw", "Generic Data")
# Linear Rec.709 is Blender's working space unless the file says otherwise.
LINEAR_SPACES = ("Linear Rec.709", "Linear")
# Linear light of the 8-bit sRGB codes.
FROM_SRGB = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)


# Colour of images that are missing, in Cycles.
MISSING = (1.0, 0.0, 1.0, 1.0)


class UnreadableImage(Exception):
    """Raised for an image whose pixels cannot be read; its text is the reason."""


@dataclass
class Images:
    """The images of an export by their names in the scene. Each image is read once.

    Attributes
    ----------
    coded
        Whether 8-bit sRGB images may be read as code values, since Cycles interpolates code values and converts the
        result to linear light.
    limit
        Most pixels along a side: "Texture Limit" of Simplify. 0: no limit.
    """

    found: dict[str, edgegrad.Image] = field(default_factory=dict)
    coded: bool = True
    limit: int = 0
    _scratch: list[NDArray[np.float32]] = field(default_factory=list, repr=False)

    def interpolates_codes(self, image: Any) -> bool:
        """Whether Cycles interpolates the code values of an image instead of its linear colours."""
        return self.coded and holds_codes(image)

    def read(self, image: Any, codes: bool = False) -> str:
        """Read Blender's image, as linear light or as code values, and return its name in the scene.

        Raises
        ------
        UnreadableImage
            For sequences, movies, tiles, missing files and colour spaces that only Blender can convert.
        """
        # An image may be used both as linear light and as code values; these are two images in the scene.
        name = name_of_codes(image.name_full) if codes else image.name_full
        if name not in self.found:
            self.found[name] = edgegrad.Image(_pixels(image, codes, self.limit, self._scratch))
        return name

    def missing(self) -> str:
        """Return the name of the single pixel that Cycles has for a missing image."""
        name = "(missing image)"
        if name not in self.found:
            self.found[name] = edgegrad.Image(np.array([[MISSING[:3]]], np.float32))
        return name


def name_of_codes(name: str) -> str:
    """Name, in the scene, of an image that is read as code values."""
    return f"{name} (sRGB codes)"


def holds_codes(image: Any) -> bool:
    """Whether Blender stores the 8-bit sRGB code values of an image."""
    return not is_float(image) and bool(image.colorspace_settings.name == "sRGB")


def is_missing(image: Any) -> bool:
    """Whether a node has no image, or the image's file is gone."""
    if image is None:
        return True
    if image.source == "FILE":
        return not was_readable(image) and (image.size[0] * image.size[1] == 0 or not len(image.pixels))
    if image.source not in ("SEQUENCE", "MOVIE") or image.packed_file is not None:
        return False
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    # The files of a sequence differ in their numbers.
    beginning = path.stem.rstrip("0123456789") if image.source == "SEQUENCE" else path.name
    return not path.parent.is_dir() or not any(file.name.startswith(beginning) for file in path.parent.iterdir())


def alpha_mode(image: Any, alpha_is_used: bool) -> str:
    """Return the mode of `edgegrad.expression.ImageTexture` that matches the use of an image's alpha in Cycles."""
    if image.alpha_mode == "NONE":
        return "NONE"
    if image.alpha_mode == "CHANNEL_PACKED" or image.colorspace_settings.name in DATA_SPACES:
        return "CHANNEL_PACKED"
    return "STRAIGHT" if alpha_is_used else "PREMULTIPLIED"


def texture_limit(scene: Any) -> int:
    """Most pixels that Simplify leaves to a side of an image in renders; 0: no limit."""
    limit = getattr(getattr(scene, "cycles", None), "texture_limit_render", "OFF")
    return int(limit) if scene.render.use_simplify and limit.isdigit() else 0


def _pixels(image: Any, codes: bool, limit: int, scratch: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """(H, W, c) linear light or code values, with straight alpha and row 0 on top."""
    if image.source not in ("FILE", "GENERATED"):
        raise UnreadableImage(f"is a {image.source.lower()}")
    key = key_of(image, codes, *((limit,) if limit else ()))
    known = kept(key)
    if known is not None:
        return known
    if image.size[0] * image.size[1] == 0 or not len(image.pixels):
        raise UnreadableImage("has no pixels")
    space = image.colorspace_settings.name
    if not (image.is_float or codes or space == "sRGB" or space in (*DATA_SPACES, *LINEAR_SPACES)):
        raise UnreadableImage(f"is in the color space {space}")
    pixels = _decoded(image, codes, limit, space, scratch)
    keep(key, pixels)
    return pixels


def _decoded(
    image: Any, codes: bool, limit: int, space: str, scratch: list[NDArray[np.float32]]
) -> NDArray[np.float32]:  # fmt: skip
    width, height = image.size
    count = height * width * image.channels
    # Large memory that has just been allocated is slow, so that one array is used for all images.
    if not scratch or len(scratch[0]) < count:
        scratch[:] = [np.empty(count, np.float32)]
    flat = scratch[0][:count]
    image.pixels.foreach_get(flat)
    stored = flat.reshape(height, width, image.channels)[::-1]
    if image.channels == 2:  # grey with alpha
        stored = stored[..., [0, 0, 0, 1]]
    stored = _reduced(stored, limit)
    opaque = stored.shape[2] == 4 and bool(np.all(stored[..., 3] == 1.0))
    pixels = np.array(stored[..., :3] if opaque else stored, order="C")
    if image.is_float:
        # Blender stores float images in its working space, with premultiplied alpha.
        if pixels.shape[2] == 4 and space not in DATA_SPACES and image.alpha_mode not in ("CHANNEL_PACKED", "NONE"):
            alpha = pixels[..., 3:]
            pixels[..., :3] /= np.where(alpha > 0.0, alpha, 1.0)
        if not np.isfinite(pixels).all():
            pixels = np.nan_to_num(pixels, posinf=0.0, neginf=0.0)
    elif not codes and space == "sRGB":
        color = pixels[..., :3]
        pixels[..., :3] = FROM_SRGB[np.clip(np.rint(color * 255.0), 0, 255).astype(np.uint8)]
    return pixels


def _reduced(stored: NDArray[np.float32], limit: int) -> NDArray[np.float32]:
    """Halve an image until its sides have at most `limit` pixels, by the means of its stored values, as Cycles does."""
    step = 1
    while limit and max(stored.shape[:2]) > limit * step:
        step *= 2
    height, width = (max(size // step, 1) for size in stored.shape[:2])
    # Images with fewer rows or columns than a step have one, the mean of all.
    rows, columns = (min(step, size) for size in stored.shape[:2])
    if step == 1:
        return stored
    # Row 0 is on top, but the steps begin at the bottom.
    used = stored[::-1][: height * rows, : width * columns]
    means = used.reshape(height, rows, width, columns, -1).mean(axis=(1, 3), dtype=np.float32)
    return np.ascontiguousarray(means[::-1])

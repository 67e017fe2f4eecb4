"""Blender's images as linear arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.images import srgb_to_linear

DATA_SPACES = ("Non-Color", "Raw", "Generic Data")
# Linear Rec.709 is Blender's working space unless the file says otherwise.
LINEAR_SPACES = ("Linear Rec.709", "Linear")
# The conversion of 8 bit sRGB codes.
FROM_SRGB = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)


class UnreadableImage(Exception):
    """An image whose pixels can't be had as they are; its text says why."""


@dataclass
class Images:
    """The images of an export by their name in the scene, each read once.

    Attributes
    ----------
    coded
        Whether 8 bit sRGB images may be read as codes: Cycles interpolates those, and makes them linear afterwards.
    """

    found: dict[str, edgegrad.Image] = field(default_factory=dict)
    coded: bool = True

    def interpolates_codes(self, image: Any) -> bool:
        """Whether Cycles interpolates an image's codes instead of its linear colours."""
        return self.coded and not image.is_float and image.colorspace_settings.name == "sRGB"

    def read(self, image: Any, codes: bool = False) -> str:
        """Read Blender's image, linear or as the codes that it holds; returns its name in the scene.

        Raises
        ------
        UnreadableImage
            For sequences, movies, tiles, missing files and colour spaces that only Blender can convert.
        """
        # The same file may be used in two colour spaces: those are two images in Blender, too.
        name = f"{image.name_full} (sRGB codes)" if codes else image.name_full
        if name not in self.found:
            self.found[name] = edgegrad.Image(_pixels(image, codes))
        return name


def alpha_mode(image: Any, alpha_is_used: bool) -> str:
    """The word of `edgegrad.expression.ImageTexture` for what Cycles does with an image's alpha."""
    if image.alpha_mode == "NONE":
        return "NONE"
    if image.alpha_mode == "CHANNEL_PACKED" or image.colorspace_settings.name in DATA_SPACES:
        return "CHANNEL_PACKED"
    return "STRAIGHT" if alpha_is_used else "PREMULTIPLIED"


def _pixels(image: Any, codes: bool) -> NDArray[np.float32]:
    """(H, W, c) linear (or codes), alpha straight, row 0 on top."""
    if image.source not in ("FILE", "GENERATED"):
        raise UnreadableImage(f"is a {image.source.lower()}")
    width, height = image.size
    if width * height == 0 or not len(image.pixels):
        raise UnreadableImage("has no pixels")
    channels = image.channels
    flat = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(flat)
    pixels = flat.reshape(height, width, channels)[::-1]
    space = image.colorspace_settings.name
    if channels == 2:  # grey with alpha
        pixels = pixels[..., [0, 0, 0, 1]]
    pixels = pixels.copy()
    if image.is_float:
        # Blender holds float images in its working space, colours multiplied by alpha.
        if pixels.shape[2] == 4 and space not in DATA_SPACES and image.alpha_mode not in ("CHANNEL_PACKED", "NONE"):
            alpha = pixels[..., 3:]
            pixels[..., :3] /= np.where(alpha > 0.0, alpha, 1.0)
    elif codes:
        pass
    elif space == "sRGB":
        color = pixels[..., :3]
        pixels[..., :3] = FROM_SRGB[np.clip(np.rint(color * 255.0), 0, 255).astype(np.uint8)]
    elif space not in (*DATA_SPACES, *LINEAR_SPACES):
        raise UnreadableImage(f"is in the colour space {space}")
    if pixels.shape[2] == 4 and bool(np.all(pixels[..., 3] == 1.0)):
        pixels = pixels[..., :3]
    if not np.isfinite(pixels).all():
        pixels = np.nan_to_num(pixels, posinf=0.0, neginf=0.0)
    return np.ascontiguousarray(pixels)

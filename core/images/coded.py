"""Reading of pictures that hold code values for a screen: PNG, JPEG and TIFF."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms, ImageOps

from .code_values import read_deep

# Tag of EXIF that says how a picture is turned.
ORIENTATION = 0x0112
LYING = (5, 6, 7, 8)  # orientations that exchange rows and columns
CODED = (".png", ".jpg", ".jpeg", ".tif", ".tiff")


@dataclass
class Coded:
    """A picture of code values.

    Attributes
    ----------
    values
        (H, W, 3 or 4) code values in [0, 1], row 0 on top; straight alpha.
    levels
        Largest whole number of the file's channels: 255 or 65535.
    blender
        Whether Blender rendered it, by the metadata that Blender writes.
    """

    values: NDArray[np.float64]
    levels: int
    blender: bool


def read_coded(path: Path) -> Coded:
    """Read a PNG, JPEG or TIFF without a conversion to linear light; a picture with a colour profile becomes sRGB.

    Raises
    ------
    ValueError
        If the file can't be decoded; names the path.
    """
    try:
        deep = read_deep(path)
        with Image.open(path) as opened:
            opened.load()
            if deep is not None:
                deep = _turned(deep, opened.getexif().get(ORIENTATION, 1))
            picture = ImageOps.exif_transpose(opened)
    except MemoryError:
        raise
    except Exception as error:  # decoders raise many types for broken files
        raise ValueError(f"image '{path}': can't be read ({error})") from None
    profile = _profile(path, picture.info)
    blender = _made_by_blender(picture.info)
    if deep is not None and (profile is None or _is_srgb(profile)):
        return Coded(deep, 65535, blender)
    if picture.mode == "F":
        raise ValueError(f"image '{path}': holds floating-point numbers, which are no code values; save it as EXR")
    if picture.mode.startswith("I"):  # 16-bit grey
        grey = np.asarray(picture, np.float64) / 65535.0
        if not (grey.min() >= 0.0 and grey.max() <= 1.0):
            raise ValueError(f"image '{path}': holds grey values of more than 16 bits; save it as EXR, or with 16 bits")
        return Coded(np.repeat(grey[..., None], 3, axis=2), 65535, blender)
    has_alpha = "A" in picture.getbands() or "transparency" in picture.info
    picture = picture.convert("RGBA" if has_alpha else "RGB")
    # Pixels whose profile has another colour space than RGB were converted to sRGB by `convert` above.
    if profile is not None and profile.profile.xcolor_space.strip() == "RGB":
        try:
            picture = ImageCms.profileToProfile(picture, profile, ImageCms.createProfile("sRGB")) or picture
        except ImageCms.PyCMSError as error:
            raise ValueError(f"image '{path}': {_BAD_PROFILE} ({error})") from None
    return Coded(np.asarray(picture, np.float64) / 255.0, 255, blender)


def coded_size(path: Path) -> tuple[int, int]:
    """Return height and width of the picture that `read_coded` reads, from the head of the file alone."""
    try:
        with Image.open(path) as opened:
            width, height = opened.size
            # Pillow's own getexif of a PNG decodes all pixels; the size of a TIFF is that after its turn.
            if opened.format != "TIFF" and Image.Image.getexif(opened).get(ORIENTATION, 1) in LYING:
                width, height = height, width
    except Exception as error:  # decoders raise many types for broken files
        raise ValueError(f"image '{path}': can't be read ({error})") from None
    return height, width


_BAD_PROFILE = "its colour profile is broken; remove it, or save the picture as sRGB"


def _profile(path: Path, info: dict[Any, Any]) -> ImageCms.ImageCmsProfile | None:
    """Return the colour profile of the picture, None if it has none."""
    if "icc_profile" not in info:
        return None
    if not info["icc_profile"]:  # Pillow returns an empty profile if it can't decompress it
        raise ValueError(f"image '{path}': {_BAD_PROFILE}")
    try:
        return ImageCms.ImageCmsProfile(io.BytesIO(info["icc_profile"]))
    except (ImageCms.PyCMSError, OSError) as error:
        raise ValueError(f"image '{path}': {_BAD_PROFILE} ({error})") from None


def _turned(values: NDArray[np.float64], orientation: int) -> NDArray[np.float64]:
    """Turn or mirror a picture as its orientation in EXIF says."""
    if orientation in LYING:
        values = values.transpose(1, 0, 2)
    rows, columns = -1 if orientation in (3, 4, 7, 8) else 1, -1 if orientation in (2, 3, 6, 7) else 1
    return np.ascontiguousarray(values[::rows, ::columns])


def _is_srgb(profile: ImageCms.ImageCmsProfile) -> bool:
    """Whether the profile is one of the usual ones of sRGB, so that code values are as they should be."""
    return "srgb" in str(ImageCms.getProfileDescription(profile)).lower()


def _made_by_blender(info: Mapping[Any, Any]) -> bool:
    """Whether the metadata are those of a render by Blender: PNG texts, or the comment of a JPEG."""
    comment = info.get("comment", b"")
    if isinstance(comment, str):
        comment = comment.encode()
    return "RenderTime" in info or comment.startswith(b"Blender:")

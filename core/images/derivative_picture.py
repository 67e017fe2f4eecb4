"""Derivative images as false-colour pictures: red is brighter, blue is darker, white is no change."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from .._check import file_path, number, numeric
from .code_values import write_codes

# Luminance of linear Rec.709; its derivative defines "brighter".
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Fraction of the changing pixels that the automatic scale shows without saturation.
SHOWN = 0.99
STRIP = 14  # pixels; height of the text line with the scale


def picture_scale(dimage: ArrayLike) -> float:
    """Default change of luminance that is drawn as full red: the 99 % quantile over the pixels that change."""
    size = np.abs(_luminance(dimage))
    size = size[np.isfinite(size) & (size > 0.0)]
    return float(np.quantile(size, SHOWN)) if size.size else 1.0


def derivative_image(dimage: ArrayLike, scale: float | None = None) -> NDArray[np.uint8]:
    """Draw a derivative image in false colours.

    Parameters
    ----------
    dimage
        (H, W, 3) derivative of linear Rec.709 radiance, as returned by `edgegrad.render_forward`. The picture
        shows its luminance.
    scale
        Derivative that is drawn as full red; its negative is full blue. None: `picture_scale`.

    Returns
    -------
    (H, W, 3) uint8 sRGB code values: white for 0, red for brighter, blue for darker, black for non-finite
    values.
    """
    limit = picture_scale(dimage) if scale is None else number("derivative_image", "scale", scale, above=0.0)
    value = _luminance(dimage)
    finite = np.isfinite(value)
    with np.errstate(over="ignore"):  # an overflow saturates like any large value
        ratio = np.where(finite, value, 0.0) / limit
    return _colours(np.clip(ratio, -1.0, 1.0), finite)


def write_derivative(path: str | Path, dimage: ArrayLike, scale: float | None = None) -> float:
    """Write `derivative_image` as a PNG, with the scale in a line below the picture; return the scale."""
    file = file_path("image", "path", path)
    if file.suffix.lower() != ".png":
        raise ValueError(f"image '{path}': a derivative picture must be a .png file")
    codes, limit = labelled_derivative(dimage, scale)
    write_codes(file, codes)
    return limit


def labelled_derivative(dimage: ArrayLike, scale: float | None = None) -> tuple[NDArray[np.uint8], float]:
    """Draw `derivative_image` with a bar of the colours and their scale below it; return it and the scale."""
    limit = picture_scale(dimage) if scale is None else number("labelled_derivative", "scale", scale, above=0.0)
    picture = derivative_image(dimage, limit)
    width = picture.shape[1]
    text = f"{-limit:.3g} ... +{limit:.3g}"
    font_width = ImageDraw.Draw(Image.new("L", (1, 1))).textlength(text)
    out = Image.new("RGB", (max(width, int(font_width) + 4), picture.shape[0] + STRIP + 4), "white")
    out.paste(Image.fromarray(picture), (0, 0))
    bar = _colours(np.tile(np.linspace(-1.0, 1.0, out.width), (4, 1)), np.ones((4, out.width), bool))
    out.paste(Image.fromarray(bar), (0, picture.shape[0]))
    ImageDraw.Draw(out).text((0.5 * (out.width - font_width), picture.shape[0] + 4), text, fill="black")
    return np.asarray(out), limit


def _luminance(dimage: ArrayLike) -> NDArray[np.float64]:
    pixels = np.asarray(numeric("derivative_image", "dimage", dimage), np.float64)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
        raise ValueError(f"derivative_image: dimage must have the shape (H, W, 3), not {pixels.shape}")
    with np.errstate(invalid="ignore"):
        return pixels @ LUMINANCE


def _colours(value: NDArray[np.float64], finite: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Map 1, 0, -1 to red, white, blue, with linear ramps between them; black if not finite."""
    fade = 1.0 - np.abs(value)
    red, blue = np.where(value >= 0.0, 1.0, fade), np.where(value <= 0.0, 1.0, fade)
    return np.where(finite[..., None], np.round(255.0 * np.stack([red, fade, blue], axis=-1)), 0.0).astype(np.uint8)

"""Reading of pictures as targets of a fit: linear light, and how far each pixel is to be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array
from .coded import read_coded
from .dither import without_dither
from .files import read_image, readable
from .view_transform import ViewTransform

# Noise of the light by rounding, as a fraction of the picture's mean light, at which a pixel has half the weight. A
# smaller value averages the rounding better, but loses the noise of the render itself, which is least where all pixels
# count alike: neighbours' errors cancel.
HALF_WEIGHT = 0.05


@dataclass
class TargetPicture:
    """A picture file as a target.

    Attributes
    ----------
    image
        (H, W, 3), or (H, W, 4) with straight alpha; linear Rec.709.
    weight
        (H, W) weight of each pixel in [0, 1]: 0 for clipped pixels, less than 1 where rounding is coarse; None: all 1.
    """

    image: NDArray[np.float32]
    weight: NDArray[np.float64] | None = None


def read_target(path: str | Path, view: ViewTransform | None = None) -> TargetPicture:
    """Read a picture file, undo its view transform, and weight its pixels by how well they determine the light.

    Blender's dither is taken away from pictures of 8 bits that contain it (`dither`).

    Parameters
    ----------
    path
        The file, as for `read_image`.
    view
        View transform of the picture; None: sRGB. An EXR holds linear light and has none.

    Raises
    ------
    ValueError
        If the file can't be read, or the view transform can't be undone; names the path.
    """
    file = readable(path)
    if file.suffix.lower() == ".exr":
        if view is not None:
            raise ValueError(f"image '{path}': is an EXR, which holds linear light, so it has no view transform "
                             f"'{view.view}'; leave the view out")
        return TargetPicture(read_image(path))
    coded = read_coded(file)
    return target_of_codes(f"image '{path}'", coded.values, view, coded.levels)


def target_of_codes(where: str, codes: ArrayLike, view: ViewTransform | None = None,
                    levels: int = 255) -> TargetPicture:  # fmt: skip
    """Undo the view transform of code values in memory, as `read_target` does for those of a file.

    Parameters
    ----------
    where
        What the picture is, for error messages.
    codes
        (H, W, 3), or (H, W, 4) with straight alpha; in [0, 1].
    levels
        Largest whole number of the channels: 255 or 65535.
    """
    values = array(where, "codes", codes, (None, None, None), np.float64, least=0.0)
    if values.shape[2] not in (3, 4) or values.max(initial=0.0) > 1.0:
        raise ValueError(f"{where}: codes must have the shape (H, W, 3) or (H, W, 4) and values in [0, 1], but have "
                         f"the shape {values.shape} and reach {values.max(initial=0.0):g}")
    transform = view or ViewTransform()
    try:
        light, noise = transform.decode(without_dither(values, levels)[..., :3], levels)
    except (ValueError, ImportError) as error:
        raise type(error)(f"{where}: {error}") from None
    known = np.isfinite(noise)
    if not known.any():
        raise ValueError(f"{where}: all of its pixels are clipped, or of colors that the view transform "
                         f"'{transform.view}' does not yield; choose another view transform or a darker picture")
    half = HALF_WEIGHT * max(float(light[known].mean()), 1e-6)
    weight = np.where(known, 1.0 / (1.0 + (np.where(known, noise, 0.0) / half) ** 2), 0.0)
    if values.shape[2] == 4:
        light = np.concatenate([light, values[..., 3:]], axis=2)
    return TargetPicture(np.ascontiguousarray(light, np.float32), weight)


def read_mask(path: str | Path) -> NDArray[np.float32]:
    """Read a picture file as the mask or silhouette that it shows: its alpha if it has one, else its brightness.

    Returns
    -------
    (H, W) float32: alpha, or the mean of R, G and B as they are stored, without a conversion to linear light.

    Raises
    ------
    ValueError
        If the file can't be read; names the path.
    """
    file = readable(path)
    values = read_image(file) if file.suffix.lower() == ".exr" else read_coded(file).values
    return mask_of(values)


def mask_of(values: NDArray[Any]) -> NDArray[np.float32]:
    """Return the (H, W) mask that stored values (H, W, 3 or 4) show, as `read_mask`."""
    if values.shape[2] == 4 and (values[..., 3] < 1.0).any():
        return np.ascontiguousarray(values[..., 3], np.float32)
    return np.asarray(values[..., :3].mean(axis=2), np.float32)


def made_by_blender(path: str | Path) -> bool:
    """Whether the metadata of a PNG or JPEG are those of a render by Blender, which applied its view transform."""
    file = readable(path)
    return file.suffix.lower() != ".exr" and read_coded(file).blender

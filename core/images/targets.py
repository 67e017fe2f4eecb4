"""Reading of pictures as targets of a fit: linear light, and how far each pixel is to be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .coded import read_coded
from .files import read_image, readable
from .view_transform import ViewTransform

# Noise of the light by rounding, as a fraction of the picture's mean light, at which a pixel has half the weight.
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
    transform = view or ViewTransform()
    try:
        light, noise = transform.decode(coded.values[..., :3], coded.levels)
    except (ValueError, ImportError) as error:
        raise type(error)(f"image '{path}': {error}") from None
    known = np.isfinite(noise)
    if not known.any():
        raise ValueError(f"image '{path}': all of its pixels are clipped, or of colors that the view transform "
                         f"'{transform.view}' does not yield; choose another view transform or a darker picture")
    half = HALF_WEIGHT * max(float(light[known].mean()), 1e-6)
    weight = np.where(known, 1.0 / (1.0 + (np.where(known, noise, 0.0) / half) ** 2), 0.0)
    if coded.values.shape[2] == 4:
        light = np.concatenate([light, coded.values[..., 3:]], axis=2)
    return TargetPicture(np.ascontiguousarray(light, np.float32), weight)


def made_by_blender(path: str | Path) -> bool:
    """Whether the metadata of a PNG or JPEG are those of a render by Blender, which applied its view transform."""
    file = readable(path)
    return file.suffix.lower() != ".exr" and read_coded(file).blender

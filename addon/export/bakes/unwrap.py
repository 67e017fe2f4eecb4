"""Islands of UV maps that are too thin to cover texels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from edgegrad.geometry.labels import merge, summed

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

# Width of an island, texels, from which it surely covers centres of texels; thinner ones get the second width.
THIN, WIDENED = 3.0, 4.0
_LARGEST_SCALE = 1e6


def islands(uv: F32, vertices: I32, sizes: I32) -> NDArray[np.int64]:
    """(c,) number of the island that each corner belongs to.

    Faces are in one island if they share a vertex with equal coordinates.

    Parameters
    ----------
    uv, vertices
        (c, 2) coordinates and (c,) vertex of each corner.
    sizes
        (p,) number of corners of each face.
    """
    face = np.repeat(np.arange(len(sizes)), sizes)
    key = np.empty((len(uv), 3), np.float32)
    key[:, 0], key[:, 1:] = vertices.astype(np.int32).view(np.float32), uv
    _, point = np.unique(key.view(np.dtype((np.void, 12))).reshape(-1), return_inverse=True)
    return merge(np.arange(len(sizes)), face, point.reshape(-1))[face]


def widened(uv: F32, chosen: NDArray[np.bool_], vertices: I32, sizes: I32, resolution: int) -> F32 | None:
    """Coordinates in which no island of the chosen corners is thinner than a few texels; None if none is.

    Thin islands are stretched across their main direction. Stretched islands overlap others; they must be packed.
    """
    number = islands(uv, vertices, sizes)
    _, number = np.unique(number, return_inverse=True)
    number = number.reshape(-1)
    count = np.bincount(number)
    points = uv.astype(np.float64)
    centre = summed(number, points) / count[:, None]
    apart = points - centre[number]
    xx, xy, yy = (np.bincount(number, apart[:, i] * apart[:, k]) for i, k in ((0, 0), (0, 1), (1, 1)))
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)  # of the direction of the largest spread
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    stretched, thin = np.zeros_like(points), np.zeros(len(count), bool)
    for axis in (along, across):
        place = np.einsum("ck,ck->c", apart, axis[number])
        low, high = np.full(len(count), np.inf), np.full(len(count), -np.inf)
        np.minimum.at(low, number, place)
        np.maximum.at(high, number, place)
        width = (high - low) * resolution
        narrow = (width < THIN) & (width > 0.0)
        thin |= narrow
        scale = np.where(narrow, np.minimum(WIDENED / np.where(narrow, width, 1.0), _LARGEST_SCALE), 1.0)
        stretched += (place * scale[number])[:, None] * axis[number]
    thin[np.unique(number[~chosen])] = False
    if not thin.any():
        return None
    return np.where(thin[number][:, None], centre[number] + stretched, points).astype(np.float32)

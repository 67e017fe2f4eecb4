"""Derivatives of the tables with respect to the pixels of images."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.scene import Scene
from ..tables.tables import Tables
from .linear_map import F64, Linear, Piece


def pieces(scene: Scene, tables: Tables, name: str, _field: str) -> list[Piece]:
    """Return the texels, of textures and of the environment, that hold the pixels of an image.

    The derivative by an alpha channel that no texture reads is 0. So is that by an alpha channel that is not stored
    because it is 1 everywhere; `table_derivatives.with_requested` makes tables in which it is stored.
    """
    pixels = scene.images[name].pixels
    out = []
    for stored in tables.textures.stored_images if tables.textures is not None else ():
        if stored.name == name:
            count = pixels.shape[0] * pixels.shape[1] * stored.channels
            both = _multiplied(pixels) if stored.multiplied else _kept(pixels.shape, stored.channels)
            out.append(Piece("texture_pixels", stored.offset, stored.offset + count, *both))
    if scene.world.image == name and tables.environment_pixels is not None:
        out.append(Piece("environment_pixels", 0, pixels.shape[0], *_colored(pixels.shape)))
    return out


def _kept(shape: tuple[int, ...], channels: int) -> tuple[Linear, Linear]:
    """Map to the first channels of each pixel."""
    if channels == shape[2]:
        return lambda v: v.reshape(-1), lambda g: g.reshape(shape)

    def pull(g: F64) -> F64:
        out = np.zeros(shape)
        out[..., :channels] = g.reshape(*shape[:2], channels)
        return out

    return lambda v: v[..., :channels].reshape(-1), pull


def _multiplied(pixels: NDArray[np.float32]) -> tuple[Linear, Linear]:
    """Map to colour times alpha, and alpha."""
    color, alpha = pixels[..., :3], pixels[..., 3:]

    def push(v: F64) -> F64:
        return np.concatenate([v[..., :3] * alpha + color * v[..., 3:], v[..., 3:]], axis=2).reshape(-1)

    def pull(g: F64) -> F64:
        g = g.reshape(pixels.shape)
        out = np.empty(pixels.shape)
        for row, of, p in zip(out, g, pixels, strict=True):  # row by row: copies of a large image are too large
            row[:, :3] = of[:, :3] * p[:, 3:]
            row[:, 3] = of[:, 3] + np.sum(of[:, :3] * p[:, :3], axis=1)
        return out

    return push, pull


def _colored(shape: tuple[int, ...]) -> tuple[Linear, Linear]:
    """Map to three channels without alpha; a single channel is repeated."""
    color = (*shape[:2], 3)
    if shape[2] == 1:
        return lambda v: np.broadcast_to(v, color), lambda g: g.sum(axis=2, keepdims=True)

    def pull(g: F64) -> F64:
        out = np.zeros(shape)
        out[..., :3] = g
        return out

    return lambda v: v[..., :3], pull

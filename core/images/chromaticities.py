"""Colours of an EXR file's primaries to linear Rec.709."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import numeric

# (x, y) of red, green, blue and white (D65).
REC709 = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]])
# Linear Rec.709 by the names of the Color Interop Forum, which Blender 5 writes.
REC709_NAMES = ("lin_rec709_scene", "lin_rec709_display", "unknown", "data", "")


def to_rec709(pixels: NDArray[np.float64], header: Mapping[str, Any], path: Path) -> NDArray[np.float64]:
    """(…, 3) colours of a file with this EXR header, in linear Rec.709.

    A header without a statement means Rec.709, as the OpenEXR specification says. White points are
    not adapted: a white other than D65 stays as coloured as it is.
    """
    stated = header.get("chromaticities")
    if stated is not None:
        primaries = np.asarray(numeric(f"image '{path}'", "its chromaticities", stated), np.float64).reshape(-1)
        primaries = primaries.reshape(-1, 2) if primaries.size == REC709.size else primaries
        if primaries.shape == REC709.shape and np.allclose(primaries, REC709, atol=2e-4):
            return pixels
        if primaries.shape != REC709.shape or not np.isfinite(primaries).all() or (primaries[:, 1] <= 0.0).any()\
                or abs(np.linalg.det(_columns(primaries)[:, :3])) < 1e-9:
            raise ValueError(f"image '{path}': its chromaticities {primaries.ravel().tolist()} are not usable")
        return pixels @ (np.linalg.inv(_to_xyz(REC709)) @ _to_xyz(primaries)).T
    name = str(header.get("colorInteropID", ""))
    if name not in REC709_NAMES:
        raise ValueError(f"image '{path}': is in the colour space '{name}'; save it in linear Rec.709")
    return pixels


def _to_xyz(primaries: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix from RGB to CIE XYZ such that (1, 1, 1) is the white of luminance 1."""
    columns = _columns(primaries)
    scale = np.linalg.solve(columns[:, :3], columns[:, 3])
    return columns[:, :3] * scale


def _columns(primaries: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 4) XYZ of red, green, blue and white at luminance 1."""
    x, y = primaries.T
    return np.stack([x / y, np.ones(4), (1.0 - x - y) / y])

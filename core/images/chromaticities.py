"""Conversion of the colours of an EXR file, with any primaries, to linear Rec.709."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import numeric

# (x, y) of red, green, blue and white (D65).
REC709 = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]])
# Names of the Color Interop Forum, written by Blender 5, that mean linear Rec.709 or state no colour space.
REC709_NAMES = ("lin_rec709_scene", "lin_rec709_display", "unknown", "data", "")


def to_rec709(pixels: NDArray[np.float64], header: Mapping[str, Any], path: Path) -> NDArray[np.float64]:
    """Convert (…, 3) colours of a file with this EXR header to linear Rec.709.

    A header that states no colour space means Rec.709, by the OpenEXR specification. There is no chromatic
    adaptation: a white point other than D65 keeps its tint.
    """
    stated = header.get("chromaticities")
    if stated is not None:
        primaries = np.asarray(numeric(f"image '{path}'", "its chromaticities", stated), np.float64).reshape(-1)
        primaries = primaries.reshape(-1, 2) if primaries.size == REC709.size else primaries
        if primaries.shape == REC709.shape and np.allclose(primaries, REC709, atol=2e-4):
            return pixels
        if primaries.shape != REC709.shape or not np.isfinite(primaries).all() or (primaries[:, 1] <= 0.0).any()\
                or abs(np.linalg.det(_columns(primaries)[:, :3])) < 1e-9:
            raise ValueError(f"image '{path}': its chromaticities {primaries.ravel().tolist()} are not four valid "
                             "(x, y) pairs; save it in linear Rec.709")
        return pixels @ (np.linalg.inv(_to_xyz(REC709)) @ _to_xyz(primaries)).T
    name = str(header.get("colorInteropID", ""))
    if name not in REC709_NAMES:
        raise ValueError(f"image '{path}': is in the colour space '{name}'; save it in linear Rec.709")
    return pixels


def _to_xyz(primaries: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) matrix from RGB to CIE XYZ that maps (1, 1, 1) to the white of luminance 1."""
    columns = _columns(primaries)
    scale = np.linalg.solve(columns[:, :3], columns[:, 3])
    return columns[:, :3] * scale


def _columns(primaries: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 4) XYZ of red, green, blue and white at luminance 1."""
    x, y = primaries.T
    return np.stack([x / y, np.ones(4), (1.0 - x - y) / y])

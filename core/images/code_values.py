"""Code values of PNGs: writing of 8 bits; and reading of 16 bits, also of TIFFs, which Pillow alone would truncate."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from .output_files import replacing


def write_codes(path: Path, codes: NDArray[np.uint8]) -> None:
    """Write (H, W, 3 or 4) code values without a colour conversion, atomically (`output_files.replacing`)."""
    with replacing(path) as temporary:
        Image.fromarray(codes).save(temporary, format="PNG")


def read_deep(path: Path) -> NDArray[np.float64] | None:
    """Read the (H, W, 3 or 4) code values in [0, 1] of a PNG or TIFF with 16 bits per channel; None for other files.

    Pillow has no such pixel type and keeps only one byte of each channel. With the opposite byte order it keeps the
    other byte, so two decodings yield both. Alpha is straight.
    """
    bytes_of: dict[str, NDArray[np.float64]] = {}
    deep = None
    for order in ("B", "L"):
        with Image.open(path) as file:
            if file.format not in ("PNG", "TIFF") or not file.tile:
                return None
            # PNG: the mode; TIFF: a tuple that begins with it.
            first = file.tile[0][3]
            stored = first[0] if isinstance(first, tuple) else first
            deep = re.fullmatch(r"(RGBA?|RGBa);16([BLN])", str(stored))
            if deep is None:
                return None
            kind = f"{deep[1].upper()};16{order}"
            file.tile = [one._replace(args=(kind, *one[3][1:]) if isinstance(one[3], tuple) else kind)
                         for one in file.tile]  # fmt: skip
            bytes_of[order] = np.asarray(file, np.float64)
    assert deep is not None
    own = {"big": "B", "little": "L"}[sys.byteorder] if deep[2] == "N" else deep[2]
    codes = (256.0 * bytes_of[own] + bytes_of["L" if own == "B" else "B"]) / 65535.0
    if deep[1] == "RGBa":  # colours are multiplied by alpha
        alpha = codes[..., 3:]
        codes[..., :3] = np.minimum(codes[..., :3] / np.where(alpha > 0.0, alpha, 1.0), 1.0)
    return codes

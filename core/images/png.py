"""PNG code values: writing of 8 bits, and reading of 16 bits, which Pillow alone would truncate to 8."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from .output_files import replacing


def write_codes(path: Path, codes: NDArray[np.uint8]) -> None:
    """Write (H, W, 3 or 4) code values without a colour conversion, atomically (`output_files.replacing`)."""
    with replacing(path) as temporary:
        Image.fromarray(codes).save(temporary, format="PNG")


def read_deep(path: Path) -> NDArray[Any] | None:
    """Read the (H, W, 3 or 4) uint16 code values of a PNG with 16 bits per channel; None for any other file.

    Pillow has no such pixel type and keeps only the first byte of each channel. With the opposite byte order it keeps
    the second byte, so two decodings yield both bytes.
    """
    halves = []
    for order in ("B", "L"):
        with Image.open(path) as file:
            kind = file.tile[0][3] if file.format == "PNG" and file.tile else None
            if kind not in ("RGB;16B", "RGBA;16B"):
                return None
            file.tile = [file.tile[0]._replace(args=str(kind)[:-1] + order)]
            halves.append(np.asarray(file, np.uint16))
    return halves[0] * np.uint16(256) + halves[1]

"""Two pictures and their difference in one PNG."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from edgegrad import images

AMPLIFIED = 10.0
_ZOOM, _GAP, _TITLE = 2, 6, 16


def write(path: Path, ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> None:
    """Write Cycles | Edgegrad | difference of two (H, W, 3) linear pictures.

    The difference is Edgegrad - Cycles, amplified, around middle grey: brighter where Edgegrad is. All share one
    exposure, at which Cycles' brightest hundredth is white.
    """
    white = max(float(np.percentile(theirs, 99.0)), 1e-6)
    panels = [images.linear_to_srgb(np.clip(x / white, 0.0, 1.0)) for x in (theirs, ours)]
    panels.append(np.clip(0.5 + 0.5 * AMPLIFIED * (ours - theirs) / white, 0.0, 1.0))
    titles = ("Cycles", "Edgegrad", f"(Edgegrad - Cycles) x {AMPLIFIED:g}")
    height, width = (_ZOOM * n for n in theirs.shape[:2])
    sheet = Image.new("RGB", (3 * width + 2 * _GAP, height + _TITLE), "white")
    draw = ImageDraw.Draw(sheet)
    for k, (panel, title) in enumerate(zip(panels, titles, strict=True)):
        codes = Image.fromarray(np.round(255.0 * panel).astype(np.uint8))
        left = k * (width + _GAP)
        sheet.paste(codes.resize((width, height), Image.Resampling.NEAREST), (left, _TITLE))
        draw.text((left + 2, 2), title, fill="black")
    sheet.save(path)

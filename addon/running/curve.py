"""The curve of the loss as a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

LINE, BACK = (0.45, 0.66, 0.95, 1.0), (0.11, 0.11, 0.11, 1.0)
THICKNESS = 2  # pixels above and below the line


def curve(losses: Sequence[float], width: int, height: int) -> NDArray[np.float32]:
    """Draw losses on a logarithmic axis; return (height, width, 4), the lowest row first as in Blender's images.

    Losses of zero, and those that are not finite, are left out.
    """
    out = np.empty((height, width, 4), np.float32)
    out[:] = BACK
    values = np.asarray(losses, np.float64)
    at = np.flatnonzero(np.isfinite(values) & (values > 0.0))
    if not len(at):
        return out
    logs = np.log(values[at])
    span = max(logs.max() - logs.min(), 1e-3)
    across = np.interp(np.linspace(0.0, max(len(values) - 1, 1), width), at, logs)
    margin = THICKNESS + 1
    rows = margin + (across - logs.min()) / span * (height - 1 - 2 * margin)
    # Each column is filled from the lower to the higher of its two neighbouring values, so that steep parts stay whole.
    after = np.append(rows[1:], rows[-1])
    low = np.floor(np.minimum(rows, after) - THICKNESS / 2)
    high = np.ceil(np.maximum(rows, after) + THICKNESS / 2)
    level = np.arange(height)[:, None]
    out[(level >= low) & (level <= high)] = LINE
    return out

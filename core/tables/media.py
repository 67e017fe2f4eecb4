"""Media as rows of numbers (native/scene/view.h, MediumFloat)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.medium import Medium
from ..scene.scene import Scene

MEDIUM_WIDTH = 8


def medium_row(medium: Medium | None) -> NDArray[np.float32]:
    """(8,) extinction, scattering, and the mean scattering times the mean cosine; zeros without a medium."""
    row = np.zeros(MEDIUM_WIDTH, np.float32)
    if medium is not None:
        scattering = np.array(medium.scattering)
        row[0:3], row[3:6] = scattering + medium.absorption, scattering
        row[6] = scattering.mean() * medium.anisotropy
    return row


def medium_table(scene: Scene, others: int) -> NDArray[np.float32]:
    """(M, 8) rows by material, and zeros for `others` behind them. A mixture has the medium of its first part."""
    rows = [medium_row(scene.closures(name)[0].medium) for name in scene.materials]
    return np.array([*rows, *[medium_row(None)] * others], np.float32).reshape(-1, MEDIUM_WIDTH)

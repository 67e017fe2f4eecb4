"""Media as rows of numbers (native/scene/view.h, MediumFloat)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.medium import Medium
from ..scene.scene import Scene

MEDIUM_WIDTH = 8


def coefficients(medium: Medium) -> NDArray[Any]:
    """(8,) extinction, scattering, the mean scattering times the mean cosine, and 0."""
    scattering = np.asarray(medium.scattering)
    extinction = scattering + np.asarray(medium.absorption)
    return np.concatenate([extinction, scattering, [scattering.mean() * medium.anisotropy, 0.0]])


def medium_row(medium: Medium | None) -> NDArray[np.float32]:
    """(8,) the coefficients; zeros without a medium."""
    return (np.zeros(MEDIUM_WIDTH) if medium is None else coefficients(medium)).astype(np.float32)


def medium_table(scene: Scene, others: int) -> NDArray[np.float32]:
    """(M, 8) rows by material, and zeros for `others` behind them. A mixture has the medium of its first part."""
    rows = [medium_row(scene.closures(name)[0].medium) for name in scene.materials]
    return np.array([*rows, *[medium_row(None)] * others], np.float32).reshape(-1, MEDIUM_WIDTH)

"""The filter of gradients by grids: a change at the surface spreads to its surroundings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


def filters(shape: tuple[int, ...], smoothness: float) -> list[F64]:
    """(1 + lambda L)^-2 along each axis, L the second difference with free ends: constants stay."""
    found = []
    for n in shape if smoothness else ():
        second = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
        second[0, 0] -= 1.0
        second[-1, -1] -= 1.0
        inverse = np.linalg.inv(np.eye(n) + smoothness * second)
        found.append(inverse @ inverse)
    return found

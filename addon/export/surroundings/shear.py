"""How far the axes of an object are from right angles, as the uneven scale of its parents leaves them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Radians by which axes may deviate from right angles, and by which without a warning.
RIGID, BARELY_SHEARED = 1e-5, 1e-3


def skew(axes: NDArray[np.float64]) -> float:
    """Largest cosine between two of the unit vectors in the columns of (3, 3) `axes`."""
    x, y, z = axes.T
    return float(np.abs([x @ y, y @ z, z @ x]).max())


def degrees(cosine: float) -> float:
    """Degrees by which two axes with this cosine (`skew`) deviate from a right angle."""
    return float(np.degrees(np.arcsin(min(cosine, 1.0))))

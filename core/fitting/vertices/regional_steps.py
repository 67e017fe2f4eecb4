"""Steps of vertices that are longer where all gradients are small."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..optimisers import CERTAIN, AdamUniform

F64 = NDArray[np.float64]

# Exponent of the size of gradients around a vertex in the divisor of its step; the largest size has the rest. 0: one
# step size for all vertices (`AdamUniform`). 1: regions with weak gradients, such as hollows whose shading alone tells
# their shape, advance as fast as outlines, but so does noise.
REGIONAL = 0.5


@dataclass
class AdamRegional(AdamUniform):
    """`AdamUniform` whose step size follows the size of the gradients in the neighbourhood of each vertex.

    The sizes are averages over neighbourhoods, so a smooth gradient remains smooth. Where the mean gradient around a
    vertex is not above what noise alone would give (as in `AdamMatrix`), the step is that of `AdamUniform`.

    Attributes
    ----------
    average
        Returns the means of (n,) values over the neighbourhoods of the vertices.
    """

    average: Callable[[F64], F64] = np.asarray

    def _direction(self, mean: F64, root: F64) -> F64:
        size = np.sqrt(np.maximum(self.average((root**2).sum(axis=1)), 0.0))
        largest = size.max(initial=0.0)
        if not largest > 0.0:
            return np.zeros_like(mean)
        positive = np.where(size > 0.0, size, largest)
        # Of pure noise, the squared mean gradient is this part of the mean square
        left = self.beta1**self.count
        noise = (1.0 - self.beta1) * (1.0 + left) / ((1.0 + self.beta1) * (1.0 - left))
        certain = np.maximum(self.average((mean**2).sum(axis=1)), 0.0) / positive**2
        power = REGIONAL * np.clip((certain / noise - 1.0) / (CERTAIN - 1.0), 0.0, 1.0)
        return mean / (positive**power * largest ** (1.0 - power))[:, None]

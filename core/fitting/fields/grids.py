"""Optimised variables for the attributes of distance fields."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...distance_fields.linear import axis_weights, mapped
from ...scene import parameters
from ...scene.scene import Scene
from ..bounds import first_step, limits
from ..checkpoints.resumable import Resumable, State
from ..optimisers import Adam
from ..rigid_variables import BETA2
from .filters import filters
from .schedule import MOST_COARSER, FieldSteps, refinements

F64 = NDArray[np.float64]

# A fit begins with coarser grids by itself if they have at least this number of cells along each axis, and the start
# within this part of its largest value.
HARMLESS_CELLS, HARMLESS = 8, 1e-3


class Attribute(Resumable):
    """Values of an attribute on its grid: Adam on filtered gradients, from coarse grids to the attribute's own.

    Only values beside the surface have a gradient. The filter and the coarse grids carry it on to values off the
    surface, which the surface may reach later. The values stay in their range.
    """

    changing = ("_values", "_level", "_turns", "_count", "_optimiser")

    def __init__(
        self, scene: Scene, path: str, step: float | None, iterations: int, options: FieldSteps | None
    ) -> None:
        self.path = path
        self.step = first_step(scene, path) if step is None else step
        self.limits = limits(scene, path)
        self.options = FieldSteps() if options is None else options
        own = np.array(parameters.get(scene, path), np.float64)
        self._size = own.shape[:3]
        coarser = self.options.coarser
        self._level = self._harmless_levels(own) if coarser is None else coarser
        self._turns = refinements(self._level, iterations)
        self._values = mapped(own, self._maps(self._level, self._size))
        self._count = 0
        self._restart()

    def take_step(self, gradient: F64, factor: float) -> Any:
        while self._turns and self._count >= self._turns[0]:
            self._turns.pop(0)
            self._values = mapped(self._values, self._maps(self._level - 1))
            self._level -= 1
            self._restart()
        up = self._maps(0)
        smooth = mapped(mapped(gradient, [one.T for one in up]), self._filters)
        self._values = np.clip(self._optimiser.update(self._values, smooth, factor), *self.limits)
        self._count += 1
        return mapped(self._values, up)

    def restore(self, state: State) -> None:
        super().restore(state)
        self._filters = filters(self._values.shape[:3], self.options.smoothness)

    def _restart(self) -> None:
        self._optimiser = Adam(self.step, beta2=BETA2)
        self._filters = filters(self._values.shape[:3], self.options.smoothness)

    def _harmless_levels(self, own: F64) -> int:
        """Number of coarser grids that have the start almost as it is."""
        for level in range(1, MOST_COARSER + 1):
            if min((n for n in self._size_at(level) if n > 1), default=0) <= HARMLESS_CELLS:
                return level - 1
            self._values = mapped(own, self._maps(level, self._size))
            if np.abs(mapped(self._values, self._maps(0)) - own).max() > HARMLESS * np.abs(own).max():
                return level - 1
        return MOST_COARSER

    def _size_at(self, level: int) -> tuple[int, ...]:
        """Numbers of values of a coarser grid: its cells are as large as 2^level cells, or a little smaller."""
        return tuple(1 - ((1 - n) >> level) for n in self._size)

    def _maps(self, level: int, size: tuple[int, ...] | None = None) -> list[F64]:
        """Interpolation along each axis from the present grid, or one of another size, to that of a level."""
        start = self._values.shape[:3] if size is None else size
        return [axis_weights(n, np.linspace(0.0, 1.0, to)) for n, to in zip(start, self._size_at(level), strict=True)]

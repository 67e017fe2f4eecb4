"""Draws of numbers: ordinary ones, and those at the ends of their ranges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from edgegrad._check import RAYS
from tests.support.rich_scene import pose, turn

F64 = NDArray[np.float64]
T = TypeVar("T")

# Shares near the ends of [0, 1], where formulas branch or divide by what remains.
EDGES = (0.0, 1.0, 1e-6, 1.0 - 1e-6, 1e-3, 0.02)


class Draw:
    """A stream of random choices, a pure function of its seed.

    Attributes
    ----------
    scale
        The size of the scene that is drawn, metres.
    """

    def __init__(self, seed: int | tuple[int, ...]) -> None:
        self.rng = np.random.default_rng(seed)
        self.scale = 1.0

    def chance(self, p: float) -> bool:
        return bool(self.rng.random() < p)

    def one(self, among: Sequence[T]) -> T:
        return among[int(self.rng.integers(len(among)))]

    def whole(self, least: int, most: int) -> int:
        return int(self.rng.integers(least, most + 1))

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        """Uniform in the logarithm."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def share(self) -> float:
        """In [0, 1]: between as often as at or near an end."""
        return self.one(EDGES) if self.chance(0.5) else self.uniform(0.0, 1.0)

    def color(self) -> F64:
        """In [0, 1]: black, white, one channel alone, or anything."""
        kind = self.whole(0, 5)
        if kind < 2:
            return np.full(3, float(kind))
        return np.eye(3)[self.whole(0, 2)] if kind == 2 else self.rng.random(3)

    def direction(self) -> F64:
        """Along an axis, or anywhere, of any length."""
        if self.chance(0.25):
            return float(self.one((-1.0, 1.0))) * np.eye(3)[self.whole(0, 2)]
        return np.asarray(self.rng.normal(size=3) * self.log(1e-3, 1e3))

    def rotation(self) -> F64:
        """None, by quarters, or any."""
        kind = self.whole(0, 3)
        if kind == 0:
            return np.eye(3)
        if kind == 1:
            return turn(*(0.5 * np.pi * np.eye(3)[self.whole(0, 2)]))
        return turn(*self.rng.normal(scale=1.5, size=3))

    def pose(self, at: Sequence[float] | F64) -> F64:
        """A rigid transform that puts the origin at a place."""
        return pose(self.rotation(), *at)

    def rays(self, p: float) -> frozenset[str]:
        """All kinds of rays; with the probability p, any of them."""
        return frozenset(r for r in RAYS if self.chance(0.5)) if self.chance(p) else frozenset(RAYS)

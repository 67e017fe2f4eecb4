"""Derivatives by properties beside finite differences of the picture."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import edgegrad

from ..preferences import threads
from ..problem import Problem
from .arrays import F64
from .driver import Driver

# Pictures of each side, and derivatives, whose differences give the noise.
SEEDS = 6
BLOCK = 8
# Part of the derivative by which both may differ, besides three times their noise: the difference quotient of the
# picture has a finite step.
TOLERANCE = 0.03


@dataclass(frozen=True)
class Comparison:
    """Derivative by one number beside the finite difference of the picture, over blocks of pixels.

    Attributes
    ----------
    name, step
        The number, and the step of the finite difference.
    size
        Root of the summed squares of the blocks' finite differences.
    error, noise
        That of the blocks' differences, and what the noise lets expect, both relative to `size`.
    """

    name: str
    step: float
    size: float
    error: float
    noise: float

    @property
    def agrees(self) -> bool:
        """Whether both are equal within the noise."""
        return self.error <= 3.0 * self.noise + TOLERANCE

    def __str__(self) -> str:
        verdict = "agrees" if self.agrees else "DIFFERS"
        return f"{self.name}: {verdict}, difference {self.error:.1%}, noise {self.noise:.1%}, step {self.step:.3g}"


def compare(driver: Driver, samples: int, seed: int = 0) -> Iterator[Comparison]:
    """Yield a comparison for each number of the driver's parameters, seen by its first camera."""
    start = {one.path: one.value for one in driver.variables}
    placement = driver.place(start)
    export = driver.export_at(start)
    limits: dict[str, Any] = {"max_depth": export.settings.max_depth, "bounces": export.settings.bounces}
    renderer = edgegrad.Renderer(export.scene, threads=threads())
    for one in driver.parameters:
        for k, place in enumerate(one.places):
            h = one.steps[k].size
            tangent = {name: value for (view, name), value in placement.columns[one.path][k].items()
                       if view <= 0 and name in placement.paths[0]}  # fmt: skip
            sides = []
            for side in (h, -h):
                values = start[one.path].copy()
                values[k] += side
                moved = edgegrad.Renderer(driver.export_at(start | {one.path: values}).scene, threads=threads())
                sides.append(_blocks([moved.render(spp=4 * samples, seed=seed + n, **limits) for n in range(SEEDS)]))
            taken = (sides[0] - sides[1]) / (2.0 * h)
            found = _blocks([renderer.render_forward(tangent, spp=samples, seed=seed + n, **limits)
                             for n in range(SEEDS)]) if tangent else np.zeros_like(taken)  # fmt: skip
            size = float(np.linalg.norm(taken.mean(axis=0)))
            if not size > 0.0:
                raise Problem(f"property '{place.name}': camera '{driver.cameras[0].name}' sees nothing of it")
            variance = (taken.var(axis=0, ddof=1) + found.var(axis=0, ddof=1)).sum() / SEEDS
            error = float(np.linalg.norm(taken.mean(axis=0) - found.mean(axis=0)))
            yield Comparison(place.name, h, size, error / size, float(np.sqrt(variance)) / size)


def _blocks(pictures: list[Any]) -> F64:
    """(n, ...) sums over blocks of pixels."""
    a = np.asarray(pictures, np.float64)
    rows, columns = np.arange(0, a.shape[1], BLOCK), np.arange(0, a.shape[2], BLOCK)
    return np.asarray(np.add.reduceat(np.add.reduceat(a, rows, axis=1), columns, axis=2))

"""Distance fields for tests: coefficients of known shapes, and the cubic B-spline in numpy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edgegrad import Field

Floats = NDArray[np.float64]
Distance = Callable[[Floats], Floats]


def points(size: tuple[int, int, int], lower: ArrayLike = (-1, -1, -1), upper: ArrayLike = (1, 1, 1)) -> Floats:
    """(nx, ny, nz, 3) places of a field's coefficients in its own space."""
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    axes = [a + (np.arange(n) - 1.0) * (b - a) / (n - 3) for n, a, b in zip(size, low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def sampled(distance: Distance, size: int | tuple[int, int, int] = 32, lower: ArrayLike = (-1, -1, -1),
            upper: ArrayLike = (1, 1, 1), material: str = "clay", **others: Any) -> Field:
    """A field whose coefficients are a function's values: the function, slightly smoothed."""
    shape = (size, size, size) if isinstance(size, int) else size
    values = distance(points(shape, lower, upper)).astype(np.float32)
    return Field(values, material, np.asarray(lower, float), np.asarray(upper, float), **others)


def exact_sphere(radius: float, size: int | tuple[int, int, int] = 16, **others: Any) -> Field:
    """A field whose spline is |x|^2 - radius^2 exactly: a cubic B-spline reproduces quadratic polynomials.

    The spline of the coefficients i^2 is t^2 + 1/3.
    """
    shape = (size, size, size) if isinstance(size, int) else size
    spacing = 2.0 / (np.asarray(shape) - 3)
    return sampled(lambda p: np.sum(p**2 - spacing**2 / 3.0, axis=-1) - radius**2, shape, **others)


def torus(p: Floats, major: float = 0.55, minor: float = 0.25) -> Floats:
    """Distance from a torus around the z axis."""
    return np.asarray(np.hypot(np.hypot(p[..., 0], p[..., 1]) - major, p[..., 2]) - minor)


def evaluate(field: Field, at: Floats) -> tuple[Floats, Floats]:
    """(n,) values and (n, 3) gradients in the world of a field at points (n, 3) of its box, in the world."""
    to_world = field.grid_to_world()
    inverse = np.linalg.inv(to_world[:, :3])
    grid = (at - to_world[:, 3]) @ inverse.T
    cell = np.clip(np.floor(grid).astype(int), 0, field.cells - 1)
    u = grid - cell
    weights = np.stack([(1 - u) ** 3, 4 - 6 * u**2 + 3 * u**3, 1 + 3 * u + 3 * u**2 - 3 * u**3, u**3], axis=-1) / 6
    slopes = np.stack([-((1 - u) ** 2), u * (3 * u - 4), 1 + 2 * u - 3 * u**2, u**2], axis=-1) / 2
    taps = [cell[:, a, None] + np.arange(4) for a in range(3)]
    c = field.values.astype(np.float64)[taps[0][:, :, None, None], taps[1][:, None, :, None], taps[2][:, None, None, :]]
    x, y, z = weights[:, 0], weights[:, 1], weights[:, 2]
    value = np.einsum("nijk,ni,nj,nk->n", c, x, y, z)
    gradient = np.stack([np.einsum("nijk,ni,nj,nk->n", c, slopes[:, 0], y, z),
                         np.einsum("nijk,ni,nj,nk->n", c, x, slopes[:, 1], z),
                         np.einsum("nijk,ni,nj,nk->n", c, x, y, slopes[:, 2])], axis=-1)
    return value, gradient @ inverse


def march(field: Field, origin: Floats, direction: Floats, step: float) -> float:
    """Distance of the first sign change along a ray within the box, by small steps (in cells); inf: there is none.

    Crossings nearer to each other than a step may be missed.
    """
    to_world = field.grid_to_world()
    inverse = np.linalg.inv(to_world[:, :3])
    o, d = inverse @ (origin - to_world[:, 3]), inverse @ direction
    with np.errstate(divide="ignore"):
        ends = np.sort(np.stack([-o / d, (field.cells - o) / d]), axis=0)
    first, last = max(float(ends[0].max()), 0.0), float(ends[1].min())
    if not first < last:
        return np.inf
    count = max(int((last - first) * np.linalg.norm(d) / step), 2)
    t = np.linspace(first, last, count)
    inside = evaluate(field, origin + t[:, None] * direction)[0] < 0.0
    changes = np.flatnonzero(inside[1:] != inside[:-1])
    if not len(changes):
        return np.inf
    low, high = t[changes[0]], t[changes[0] + 1]
    before = inside[changes[0]]
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = (evaluate(field, (origin + middle * direction)[None])[0][0] < 0.0) == before
        low, high = (middle, high) if same else (low, middle)
    return float(0.5 * (low + high))

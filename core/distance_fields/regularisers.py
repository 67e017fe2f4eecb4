"""Measures of how far a field is from smooth, and from a distance, with their gradients by the coefficients."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import instance
from ..scene.field import Field
from . import spline

F64 = NDArray[np.float64]

_SECOND = np.array([1.0, -2.0, 1.0])


def laplacian(field: Field) -> tuple[float, F64]:
    """Return the mean square of the Laplacian of the coefficients, and its gradient.

    The value is the mean over all coefficients but the outermost of (h L)^2: L is the discrete Laplacian, in the
    field's own space, and h the cube root of a cell's volume. It has no unit. A plane has 0; a sphere of the radius r
    has about (2 h / r)^2 near its surface.

    Returns
    -------
    The value, and (nx, ny, nz) its gradient by `field.values`.
    """
    instance("laplacian", "field", field, Field)
    return laplacian_of(field.values.astype(np.float64), field.spacing)


def laplacian_of(values: spline.Numbers, spacing: F64) -> tuple[Any, spline.Numbers]:
    """`laplacian` of coefficients, with cells of the size `spacing` (3,)."""
    size = float(np.prod(spacing)) ** (1.0 / 3.0)
    inner = tuple(slice(1, -1) for _ in range(3))
    total = np.zeros([n - 2 for n in values.shape], values.dtype)
    for axis in range(3):
        box = tuple(slice(None) if k == axis else inner[k] for k in range(3))
        total = total + spline.filtered(values[box], axis, _SECOND * size / spacing[axis] ** 2)
    gradient = np.zeros(values.shape, values.dtype)
    for axis in range(3):
        box = tuple(slice(None) if k == axis else inner[k] for k in range(3))
        gradient[box] += spline.spread(total, axis, _SECOND * size / spacing[axis] ** 2)
    return np.mean(total**2), gradient * (2.0 / total.size)


def eikonal(field: Field) -> tuple[float, F64]:
    """Return how far the field is from a distance, and the gradient of that number.

    The value is the mean over the nodes of (|g|^2 - 1)^2 / 4 with the gradient g of the field, in its own space. It has
    no unit; near |g| = 1 it is (|g| - 1)^2.

    Returns
    -------
    The value, and (nx, ny, nz) its gradient by `field.values`.
    """
    instance("eikonal", "field", field, Field)
    return eikonal_of(field.values.astype(np.float64), field.spacing)


def eikonal_of(values: spline.Numbers, spacing: F64) -> tuple[Any, spline.Numbers]:
    """`eikonal` of coefficients, with cells of the size `spacing` (3,)."""
    slopes = [part / h for part, h in zip(spline.node_slopes(values), spacing, strict=True)]
    excess = slopes[0] ** 2 + slopes[1] ** 2 + slopes[2] ** 2 - 1.0
    by_slopes = [excess * part / (h * excess.size) for part, h in zip(slopes, spacing, strict=True)]
    return 0.25 * np.mean(excess**2), np.asarray(spline.spread_slopes(by_slopes))

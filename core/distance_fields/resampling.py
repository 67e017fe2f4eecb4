"""Fields on other grids."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import LARGEST_LENGTH, array, instance, whole, wholes
from ..scene.field import LARGEST_SIZE, LEAST_SIZE, Field
from . import spline
from .linear import axis_weights, mapped

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


def refined(field: Field, times: int = 1) -> Field:
    """Halve the cells of a field `times` times (0 to 6). The field stays exactly the same function."""
    instance("refined", "field", field, Field)
    field.validate("refined")
    times = whole("refined", "times", times, 0, 6)
    most = int(field.cells.max()) << times
    if most > LARGEST_SIZE - LEAST_SIZE:
        raise ValueError(f"refined: the field would have {most:,} cells along an axis; the limit is "
                         f"{LARGEST_SIZE - LEAST_SIZE:,}; refine it fewer times")
    values = field.values.astype(np.float64)
    for _ in range(times):
        values = spline.refined(values)
    return replace(field, values=values.astype(np.float32))


def resampled(
    field: Field, cells: tuple[int, int, int], *, lower: ArrayLike | None = None, upper: ArrayLike | None = None
) -> Field:
    """Sample a field on another grid. At the nodes of the new grid both fields are equal.

    Attributes are sampled on grids of about the same spacing, if the box changes.

    Parameters
    ----------
    field
        The field; its transform stays.
    cells
        Numbers of cells of the new grid along the axes.
    lower, upper
        (3,) corners of the new box in the field's own space, within the old one; None: those of the old one.

    Raises
    ------
    ValueError
        If the new box is not within the old one.
    """
    instance("resampled", "field", field, Field)
    field.validate("resampled")
    count = wholes("resampled", "cells", cells, 3, 1, LARGEST_SIZE - LEAST_SIZE)
    low, high = (old if new is None else array("resampled", name, new, (3,), np.float64, most=LARGEST_LENGTH)
                 for name, new, old in (("lower", lower, field.lower), ("upper", upper, field.upper)))  # fmt: skip
    if not np.all((field.lower <= low) & (low < high) & (high <= field.upper)):
        raise ValueError("resampled: the new box must lie within the field's box, and lower below upper; nothing is "
                         "known of the field outside")
    spacing = field.spacing
    places = [np.clip((np.linspace(low[k], high[k], count[k] + 1) - field.lower[k]) / spacing[k], 0.0, field.cells[k])
              for k in range(3)]  # fmt: skip
    values = spline.coefficients(spline.at_nodes_of(field.values, places))
    size = field.upper - field.lower
    ends = (low - field.lower) / size, (high - field.lower) / size
    whole_box = np.array_equal(low, field.lower) and np.array_equal(high, field.upper)
    attributes = field.attributes if whole_box else {name: _within(grid, *ends)
                                                     for name, grid in field.attributes.items()}
    return replace(field, values=values.astype(np.float32), lower=low, upper=high, attributes=attributes)


def _within(grid: F32, low: F64, high: F64) -> F32:
    """A grid over a part of its box, from the fractions `low` to `high` of that, with cells no larger than before."""
    maps = []
    for n, a, b in zip(grid.shape[:3], low, high, strict=True):
        count = 1 + int(np.ceil((n - 1) * (b - a) - 1e-9))
        maps.append(axis_weights(n, np.linspace(a, b, count)))
    return mapped(grid.astype(np.float64), maps).astype(np.float32)

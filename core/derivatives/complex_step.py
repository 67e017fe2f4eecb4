"""Derivatives of small analytic functions by complex steps, exact up to rounding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

# The square of the step vanishes beside 1, so there is no truncation error. Nothing is subtracted, so no digits cancel.
_STEP = 1e-30

Held = TypeVar("Held")


def jacobian(row_of: Callable[[Held], NDArray[Any]], held: Held, field: str) -> NDArray[np.float64]:
    """Derivative of a row of numbers with respect to one field of a dataclass.

    d f/d x = Im f(x + i h) / h (Squire and Trapp 1998, "Using complex variables to estimate derivatives of real
    functions"), exact to a few roundings.

    Parameters
    ----------
    row_of
        Returns the row (n,). It must be an analytic function of the field: arithmetic, and numpy functions that accept
        complex numbers. Its branches must depend on real parts only.
    held
        The dataclass; it is not changed.
    field
        Name of a number or array of the dataclass.

    Returns
    -------
    (n, *shape of the field).
    """
    value = np.asarray(getattr(held, field), np.complex128)
    columns = []
    for k in range(value.size):
        moved = value.copy()
        moved.reshape(-1)[k] += 1j * _STEP
        columns.append(np.imag(row_of(replace(held, **{field: moved if value.ndim else moved[()]}))) / _STEP)  # type: ignore[type-var]
    return np.stack(columns, axis=1).reshape(-1, *value.shape)

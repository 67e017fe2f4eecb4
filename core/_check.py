"""Checks of user input: each failure is one sentence that names the object and the field."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

# Kinds of rays that an object can be hidden from (Blender's ray visibility).
RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")

# Engines compute in single precision: the largest number that it holds, and the largest length whose square it holds
# with room for sums.
LARGEST = float(np.finfo(np.float32).max)
LARGEST_LENGTH = 1e18


def array(
    where: str,
    name: str,
    value: Any,
    shape: tuple[int | None, ...],
    dtype: DTypeLike,
    *,
    least: float | None = None,
    most: float = LARGEST,
) -> NDArray[Any]:
    """`value` as a finite C-contiguous array of the shape (None: any size) and type asked for.

    An array that already fits is returned itself, so that editing it in place goes on working. Floats must not be
    larger than `most`, of either sign.
    """
    try:
        with np.errstate(over="ignore"):  # what becomes infinite is refused below
            out = np.ascontiguousarray(value, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{where}: {name} can't be read as an array of numbers ({error})") from None
    fits = out.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, out.shape, strict=True)
    )
    if not fits:
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise ValueError(f"{where}: {name} must have the shape ({wanted}), not {out.shape}")
    if out.dtype.kind == "f" and out.size and not (-most <= out.min() and out.max() <= most):  # NaN passes neither
        bad = ~np.isfinite(out)
        if bad.any():
            at = tuple(int(i) for i in np.argwhere(bad)[0])
            raise ValueError(f"{where}: {name} has {int(bad.sum())} non-finite values, the first at {at}")
        raise ValueError(_too_large(where, name, float(np.abs(out).max()), most))
    if least is not None and out.size and out.min() < least:
        raise ValueError(f"{where}: {name} must not be below {least:g}, but contains {out.min():g}")
    return out


def number(
    where: str,
    name: str,
    value: Any,
    *,
    above: float | None = None,
    below: float | None = None,
    least: float | None = None,
    most: float = LARGEST,
) -> float:
    """`value` as a finite float within the limits, not larger than `most`, of either sign."""
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{where}: {name} must be a number, not {value!r}") from None
    if not math.isfinite(out):
        raise ValueError(f"{where}: {name} is not finite")
    if abs(out) > most:
        raise ValueError(_too_large(where, name, abs(out), most))
    if above is not None and out <= above:
        raise ValueError(f"{where}: {name} must be above {above:g}, not {out:g}")
    if below is not None and out >= below:
        raise ValueError(f"{where}: {name} must be below {below:g}, not {out:g}")
    if least is not None and out < least:
        raise ValueError(f"{where}: {name} must not be below {least:g}, but is {out:g}")
    return out


def derived(where: str, what: str, value: Any) -> None:
    """Refuse what follows from several fields, each of which is within its own limits, and is too large."""
    size = float(np.max(np.abs(value), initial=0.0))
    if not size <= LARGEST:
        raise ValueError(_too_large(where, what, size, LARGEST))


def _too_large(where: str, name: str, size: float, most: float) -> str:
    return (f"{where}: {name} must not exceed {most:.3g} in size, since rendering is in single precision, but reaches "
            f"{size:.3g}; scale it down")


def whole(where: str, name: str, value: Any, least: int, most: int) -> int:
    """`value` as an int within [least, most]."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValueError(f"{where}: {name} must be a whole number, not {value!r}")
    if not least <= value <= most:
        raise ValueError(f"{where}: {name} must be between {least} and {most}, not {value}")
    return int(value)


def choice(where: str, name: str, value: Any, among: tuple[str, ...]) -> str:
    """`value` as one of some words."""
    if value not in among:
        raise ValueError(f"{where}: {name} must be one of {', '.join(among)}, not {value!r}")
    return str(value)


def rays(where: str, name: str, value: Any) -> frozenset[str]:
    """`value` as a set of kinds of rays (`RAYS`)."""
    wrong = [value] if isinstance(value, str) else [ray for ray in value if ray not in RAYS]
    if wrong:
        raise ValueError(f"{where}: {name} must be a set of {', '.join(RAYS)}, not {value!r}")
    return frozenset(value)

"""Checks of user input: each failure is one sentence that names the object and the field.

Every check takes the object in words ("mesh 'cube'"), the name of the field and its value. It returns the value in the
form that the package computes with, or the value itself if it already has that form. A failed check raises
``ValueError``.
"""

from __future__ import annotations

import math
import numbers
import os
import reprlib
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

# Kinds of rays for which an object can be invisible (Blender's ray visibility).
RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")
_RAYS = frozenset(RAYS)

# Largest number in single precision, in which the engines compute, and largest length: the sum of a few squared lengths
# must not overflow.
LARGEST = float(np.finfo(np.float32).max)
LARGEST_LENGTH = 1e18

# Tolerance of the scalar products of a rigid transform's axes: poses often come from single precision.
_ORTHONORMAL = 1e-4

# Largest number by size of a float in bytes.
_MOST = {np.dtype(kind).itemsize: float(np.finfo(kind).max) for kind in (np.float16, np.float32, np.float64)}
# Numbers that OpenBLAS sums in one thread (interface/dot.c).
_ONE_THREAD = 8192

# Longest file path, in characters, that operating systems accept.
_LONGEST_PATH = 4096
# Longest value, in characters, that an error message shows in full.
_SHOWN = 60


def shown(value: Any) -> str:
    """Describe `value` for an error message: numbers and text as they are, anything larger by its type and shape."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} of the shape {value.shape}" if value.ndim else shown(value.item())
    if value is None or isinstance(value, (str, bytes, numbers.Number, np.generic)):
        brief = reprlib.Repr()
        brief.maxstring = brief.maxother = brief.maxlong = _SHOWN
        try:
            return brief.repr(value)
        except ValueError:  # Python refuses to print an integer of thousands of digits
            return "a number of thousands of digits"
    if isinstance(value, type):
        return f"the class {value.__name__}"
    return f"a value of type {type(value).__name__}"


def array(
    where: str,
    name: str,
    value: Any,
    shape: tuple[int | None, ...],
    dtype: DTypeLike,
    *,
    least: float | None = None,
    most: float = LARGEST,
    booleans: bool = False,
) -> NDArray[Any]:
    """Return `value` as a finite C-contiguous array of the given shape (None: any size) and dtype.

    An array that already fits is returned itself, so that the caller can keep editing it in place. Numbers are
    converted if their values stay the same up to rounding. `booleans` accepts False and True as 0 and 1. Floats must
    lie within [-most, most], and numbers must not be below `least`.
    """
    out = shaped(where, name, value, shape, dtype, booleans=booleans)
    if least is None and _surely_within(out, most):
        return out
    if out.dtype.kind == "f" and out.size and not (-most <= out.min() and out.max() <= most):  # NaN passes neither
        _check_finite(where, name, out)
        raise ValueError(_too_large(where, name, float(np.abs(out).max()), most))
    if least is not None and out.size and out.min() < least:
        raise ValueError(f"{where}: {name} must not be below {least:g}, but contains {out.min():g}")
    return out


def _surely_within(numbers: NDArray[Any], most: float) -> bool:
    """Whether a sum of squares already shows that floats are within [-most, most]: scenes have very many arrays.

    Large arrays are left to the complete check: OpenBLAS would share the sum among its threads, which then keep the
    processor busy for a while to wait for more work.
    """
    if numbers.dtype.kind != "f":
        return True
    if numbers.size > _ONE_THREAD:
        return False
    flat = numbers.reshape(-1)
    return bool(np.dot(flat, flat) <= min(most * most, _MOST[numbers.dtype.itemsize]))  # False for NaN


def shaped(
    where: str, name: str, value: Any, shape: tuple[int | None, ...], dtype: DTypeLike, *, booleans: bool = False
) -> NDArray[Any]:
    """Convert `value` like `array`, without limits: floats may be of any size, infinite or NaN."""
    target = np.dtype(dtype)
    if type(value) is np.ndarray and value.dtype == target and value.ndim == len(shape) and value.flags.c_contiguous:
        _check_shape(where, name, value, shape)
        return value
    source = numeric(where, name, value, booleans=booleans)
    _check_shape(where, name, source, shape)
    if source.dtype == target:
        return source if source.flags.c_contiguous else np.asarray(source, order="C")
    if target.kind == "i":
        low, high = _whole_range(where, name, source)
        if low < np.iinfo(target).min or high > np.iinfo(target).max:
            raise ValueError(f"{where}: {name} contains {low if low < 0 else high}, which is too large for an index")
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(source, dtype=target, order="C")


def numeric(where: str, name: str, value: Any, *, booleans: bool = False) -> NDArray[Any]:
    """Convert `value` to an array of real numbers of any dtype and shape."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise ValueError(f"{where}: {name} is a masked array with missing numbers; call its filled() first")
    try:
        out = np.asarray(value)
    except MemoryError:
        raise
    except Exception as error:  # `__array__` of foreign types may raise anything
        raise ValueError(f"{where}: {name} cannot be read as an array of numbers ({error})") from None
    kind = out.dtype.kind
    if kind not in ("biuf" if booleans else "iuf"):
        what = {"c": "complex numbers", "b": "booleans"}.get(kind) if out.ndim else None
        raise ValueError(f"{where}: {name} must be an array of real numbers, not {what or _kind_words(value, out)}")
    return out


def _kind_words(value: Any, out: NDArray[Any]) -> str:
    if out.ndim == 0 or isinstance(value, np.ndarray):
        return shown(value)
    return f"a {type(value).__name__} of {'text' if out.dtype.kind in 'US' else 'other values'}"


def light_values(
    where: str, name: str, value: Any, shape: tuple[int | None, ...], dtype: DTypeLike = np.float32
) -> NDArray[Any]:
    """Return `value` as a picture of linear light; integers are refused, since they are code values of a file."""
    if getattr(value, "dtype", None) != dtype:
        source = numeric(where, name, value)
        if source.dtype.kind != "f" and source.size:
            raise ValueError(f"{where}: {name} holds whole numbers ({source.dtype}), but must be linear light; convert "
                             "8-bit code values by edgegrad.images.srgb_to_linear(codes / 255)")
    return array(where, name, value, shape, dtype)


def within(where: str, name: str, numbers: NDArray[Any], among: int, says: str, of: str) -> None:
    """Refuse indices outside [0, among); the error message uses `says` ("name vertex") and `of` ("vertices")."""
    # As unsigned numbers, negative ones are above all others.
    narrow = numbers.view(np.uint32) if numbers.dtype == np.int32 and numbers.size else None
    if narrow is not None and int(np.maximum.reduce(narrow, axis=None)) < among:
        return
    low, high = (int(numbers.min()), int(numbers.max())) if numbers.size else (0, -1)
    if low < 0 or high >= among:
        raise ValueError(f"{where}: {name} {says} {low if low < 0 else high}, but there are {among} {of}")


def _whole_range(where: str, name: str, source: NDArray[Any]) -> tuple[int, int]:
    """Return the smallest and largest number of an array of whole numbers; refuse fractions."""
    if not source.size:
        return 0, 0
    if source.dtype.kind == "f":
        _check_finite(where, name, source)
        broken = source != np.rint(source)
        if broken.any():
            raise ValueError(f"{where}: {name} must be whole numbers, but contains {source[broken][0]:g}")
    return int(source.min()), int(source.max())


def _check_shape(where: str, name: str, source: NDArray[Any], shape: tuple[int | None, ...]) -> None:
    got_shape = source.shape
    if got_shape == shape or (len(got_shape) == len(shape) == 2 and shape == (None, got_shape[1])):
        return
    fits = source.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, source.shape, strict=True)
    )
    if not fits:
        expected = ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "")
        got = str(source.shape) if source.ndim else f"the single number {source.item():g}"
        raise ValueError(f"{where}: {name} must have the shape ({expected}), not {got}")


def _check_finite(where: str, name: str, out: NDArray[Any]) -> None:
    finite = np.isfinite(out)
    if not finite.all():
        bad = ~finite
        at = tuple(int(i) for i in np.argwhere(bad)[0])
        raise ValueError(f"{where}: {name} has {int(bad.sum())} non-finite values, the first at {at}")


def number(
    where: str,
    name: str,
    value: Any,
    *,
    above: float | None = None,
    below: float | None = None,
    least: float | None = None,
    greatest: float | None = None,
    most: float = LARGEST,
) -> float:
    """Return `value` as a finite float within the limits and within [-most, most]."""
    out = value if type(value) is float else _real(where, name, value)
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
    if greatest is not None and out > greatest:
        raise ValueError(f"{where}: {name} must not be above {greatest:g}, but is {out:g}")
    return out


def _real(where: str, name: str, value: Any) -> float:
    if isinstance(value, (int, float, np.integer, np.floating, Fraction)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise ValueError(f"{where}: {name} is too large for a float") from None
    if hasattr(value, "__array__") and not isinstance(value, np.generic):  # a scalar of numpy, torch …
        out = numeric(where, name, value)
        if out.ndim == 0:
            return float(out)
    raise ValueError(f"{where}: {name} must be a number, not {shown(value)}")


def derived(where: str, what: str, value: Any) -> None:
    """Refuse a quantity that is too large although each of the fields it is computed from is within its limits."""
    size = float(np.max(np.abs(value), initial=0.0))
    if not size <= LARGEST:
        raise ValueError(_too_large(where, what, size, LARGEST))


def _too_large(where: str, name: str, size: float, most: float) -> str:
    return (f"{where}: {name} must not exceed {most:.3g} in size, since rendering is in single precision, but reaches "
            f"{size:.3g}; scale it down")


def whole(where: str, name: str, value: Any, least: int, most: int) -> int:
    """Return `value` as an int within [least, most]."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValueError(f"{where}: {name} must be a whole number, not {shown(value)}")
    if not least <= value <= most:
        raise ValueError(f"{where}: {name} must be between {least} and {most}, not {shown(value)}")
    return int(value)


def _items(value: Any) -> tuple[Any, ...] | None:
    """Return the items of a list or other iterable; None for text and for anything that is not iterable."""
    if isinstance(value, (str, bytes)):
        return None
    try:
        return tuple(value)
    except TypeError:
        return None


def wholes(where: str, name: str, value: Any, count: int, least: int, most: int) -> tuple[int, ...]:
    """Return `value` as a tuple of `count` ints within [least, most]."""
    items = _items(value)
    if items is None or len(items) != count:
        raise ValueError(f"{where}: {name} must be {count} whole numbers, not {shown(value)}")
    return tuple(whole(where, name, item, least, most) for item in items)


def flag(where: str, name: str, value: Any) -> bool:
    """Return `value`, which must be True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{where}: {name} must be True or False, not {shown(value)}")
    return bool(value)


def text(where: str, name: str, value: Any) -> str:
    """Return `value`, which must be a str."""
    if not isinstance(value, str):
        raise ValueError(f"{where}: {name} must be text, not {shown(value)}")
    return value


def choice(where: str, name: str, value: Any, among: Sequence[str]) -> str:
    """Return `value`, which must be one of the words in `among`."""
    if not isinstance(value, str) or value not in among:
        raise ValueError(f"{where}: {name} must be one of {', '.join(among)}, not {shown(value)}")
    return value


def names(where: str, name: str, value: Any, what: str = "names") -> tuple[str, ...]:
    """Return `value` as a tuple of str; a single str is refused."""
    items = _items(value)
    if items is None:
        raise ValueError(f"{where}: {name} must be a list of {what}, not {shown(value)}")
    if set(map(type, items)) <= {str}:
        return items
    for item in items:
        if not isinstance(item, str):
            raise ValueError(f"{where}: {name} must be a list of {what}, but contains {shown(item)}")
    return items


def rays(where: str, name: str, value: Any) -> frozenset[str]:
    """Return `value` as a set of kinds of rays (`RAYS`)."""
    if isinstance(value, frozenset) and value <= _RAYS:
        return value
    items = _items(value)
    if items is None:
        raise ValueError(f"{where}: {name} must be a set of {', '.join(RAYS)}, not {shown(value)}")
    for ray in items:
        if not isinstance(ray, str) or ray not in RAYS:
            raise ValueError(f"{where}: {name} must be a set of {', '.join(RAYS)}, but contains {shown(ray)}")
    return frozenset(items) if not isinstance(value, frozenset) else value


def instance(where: str, name: str, value: Any, kinds: type | tuple[type, ...]) -> Any:
    """Return `value`, which must be an instance of one of the classes `kinds`."""
    if not isinstance(value, kinds):
        several = kinds if isinstance(kinds, tuple) else (kinds,)
        expected = " or ".join(f"edgegrad.{kind.__name__}" for kind in several)
        raise ValueError(f"{where}: {name} must be an {expected}, not {shown(value)}")
    return value


def function(where: str, name: str, value: Any) -> Any:
    """Return `value`, which must be callable and not a class."""
    if not callable(value) or isinstance(value, type):
        raise ValueError(f"{where}: {name} must be a function, not {shown(value)}")
    return value


def mapping(where: str, name: str, value: Any, item: Callable[[str, str, Any], Any] | None = None) -> Mapping[str, Any]:
    """Return `value` as a mapping from str to values that `item` has checked."""
    if type(value) is dict and not value:
        return value
    if not isinstance(value, Mapping):
        raise ValueError(f"{where}: {name} must be a dict by name, not {shown(value)}")
    for key in value:
        if not isinstance(key, str):
            raise ValueError(f"{where}: {name} must be a dict by name, but has the key {shown(key)}")
    if item is None:
        return value
    out = {key: item(where, f"{name}['{key}']", one) for key, one in value.items()}
    return value if all(out[key] is one for key, one in value.items()) else out


def file_path(where: str, name: str, value: Any) -> Path:
    """Return `value` as the path of a file; the file need not exist."""
    if not isinstance(value, (str, os.PathLike)) or not isinstance(os.fspath(value), str):
        raise ValueError(f"{where}: {name} must be the path of a file, not {shown(value)}")
    if "\0" in os.fspath(value) or len(os.fspath(value)) > _LONGEST_PATH:
        raise ValueError(f"{where}: {name} must be the path of a file, but is {shown(os.fspath(value))}")
    return Path(value)


def orthonormal(where: str, name: str, matrix: NDArray[np.float64], what: str) -> None:
    """Refuse a matrix whose upper left 3 x 3 part is not orthonormal."""
    axes = matrix[:3, :3]
    if not np.allclose(axes @ axes.T, np.eye(3), atol=_ORTHONORMAL):
        raise ValueError(f"{where}: {name} must be a {what}; its axes are not orthonormal")

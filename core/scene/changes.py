"""The float parameters by which two scenes of the same structure differ.

The structure is everything but the float parameters: names, topology, materials of faces, kinds, settings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from ..expression.numbers import numbers, with_numbers
from . import parameters
from .medium import Medium, coefficient
from .scene import Scene


class StructureChange(ValueError):
    """Raised for scenes that differ by more than float parameters; the text names the part and the field."""


def changes(before: Scene, after: Scene) -> dict[str, Any]:
    """Return the values in `after` of the parameters that differ, by their paths.

    Raises
    ------
    StructureChange
        If the scenes differ by more than float parameters.
    """
    found: dict[str, Any] = {}
    for collection in parameters.COLLECTIONS:
        old, new = getattr(before, collection), getattr(after, collection)
        if old.keys() != new.keys():
            name = min(old.keys() ^ new.keys())
            raise StructureChange(f"'{name}' {'appears in' if name in new else 'disappears from'} {collection}")
        for name, held in old.items():
            if held is not new[name]:
                _compare(f"{collection}.{name}", held, new[name], found)
    for single in parameters.SINGLE:
        _compare(single, getattr(before, single), getattr(after, single), found)
    return found


def changed_fields(before: Any, after: Any, what: str) -> dict[str, Any]:
    """Return the float fields by which two parts of scenes (two cameras, two materials) differ."""
    found: dict[str, Any] = {}
    _compare(what, before, after, found)
    return {path[len(what) + 1 :]: value for path, value in found.items()}


def _compare(path: str, before: Any, after: Any, found: dict[str, Any]) -> None:
    if type(before) is not type(after):
        raise StructureChange(f"'{path}' becomes another kind")
    for field in fields(before):
        old, new = getattr(before, field.name), getattr(after, field.name)
        if old is new:
            continue
        where = f"{path}.{field.name}"
        if isinstance(old, Mapping):
            _compare_mappings(where, field.name, old, new, found)
        elif _is_float(old) and _is_float(new):
            _compare_floats(where, old, new, found)
        elif isinstance(old, Medium) and isinstance(new, Medium):
            for one in fields(old):
                a, b = (coefficient(medium, one.name) for medium in (old, new))
                _compare_floats(f"{where}.{one.name}", a, b, found)
        elif not _equal(old, new):
            raise StructureChange(f"'{where}' changes")


def _compare_mappings(
    where: str, field: str, before: Mapping[str, Any], after: Mapping[str, Any], found: dict[str, Any]
) -> None:
    if before.keys() != after.keys():
        raise StructureChange(f"'{where}.{min(before.keys() ^ after.keys())}' appears or disappears")
    for key, old in before.items():
        new = after[key]
        if old is new:
            continue
        if field + "." == parameters.TEXTURES:
            a, b = numbers(old), numbers(new)
            if len(a) != len(b) or with_numbers(new, a) != old:
                raise StructureChange(f"'{where}.{key}' is computed by other operations")
            _compare_floats(f"{where}.{key}", a, b, found)
        else:
            _compare_floats(f"{where}.{key}", old, new, found)


def _compare_floats(where: str, before: Any, after: Any, found: dict[str, Any]) -> None:
    if np.shape(before) != np.shape(after):
        raise StructureChange(f"'{where}' changes its shape from {np.shape(before)} to {np.shape(after)}")
    if not np.array_equal(before, after):
        found[where] = after


def _is_float(value: Any) -> bool:
    return isinstance(value, float) or (isinstance(value, np.ndarray) and np.issubdtype(value.dtype, np.floating))


def _equal(before: Any, after: Any) -> bool:
    if isinstance(before, np.ndarray) or isinstance(after, np.ndarray):
        return bool(np.array_equal(before, after))
    return bool(before == after)

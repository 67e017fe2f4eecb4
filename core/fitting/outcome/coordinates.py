"""The numbers of a fit's parameters, one by one, and the directions in which each moves the scene's parameters.

A colour has three numbers, a pose six: rotations about the axes of the world and translations along them. Arrays such
as vertices and texels have too many to be looked at one by one (`is_array`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..control_vertices import ControlVertices
from ..driven import Numbers, Placement, Variable
from ..rigid_variables import Directions, Poses, Positions
from ..variables import Unknown, Values

F64 = NDArray[np.float64]
Tangent = Mapping[str, Any]

# Numbers of a parameter that are looked at one by one, and of all parameters together.
MOST_OF_ONE, MOST = 16, 48
RADIANS, METRES = "rad", "m"
# How far a fit usually looks, in first steps, where a parameter has no range.
USUAL_WAY = 50.0


@dataclass(frozen=True)
class Coordinate:
    """One number of a fitted parameter.

    Attributes
    ----------
    path
        Path of the parameter.
    name
        Which number of it; empty if it is the only one.
    value
        The number; None for a coordinate of a pose, which is a change from where the fit has ended.
    unit
        "rad", "m", or empty: the unit of the parameter.
    step
        First step of the fit.
    way
        What counts as a large error: the range of the number, or what a fit may change it by.
    tangent
        Maps the number of a picture to the derivative of the scene's parameters by this number.
    at
        Place of the number in its parameter; of a pose, which of its six.
    """

    path: str
    name: str
    value: float | None
    unit: str
    step: float
    way: float
    tangent: Callable[[int], Tangent]
    at: int

    @property
    def label(self) -> str:
        """The number in words."""
        return f"'{self.path}'{f' {self.name}' if self.name else ''}"


def coordinates(variables: Sequence[Unknown | Variable | Numbers], values: Mapping[str, Any],
                placement: Placement | None) -> tuple[list[Coordinate], list[str]]:  # fmt: skip
    """Return the coordinates of all variables at their values, and the paths of the arrays.

    Numbers that a limit holds have none: they do not move.
    """
    found: list[Coordinate] = []
    arrays = []
    for item in variables:
        value = np.asarray(values[item.path], np.float64)
        own = _of(item, value, placement)
        if own is None or len(found) + len(own) > MOST:
            arrays.append(item.path)
        else:
            found += own
    return found, arrays


def _of(item: Unknown | Variable | Numbers, value: F64, placement: Placement | None) -> list[Coordinate] | None:
    """The coordinates of one variable; None for an array, or where no derivative is known."""
    if isinstance(item, Numbers):
        if placement is None or placement.push is None:
            return None
        return _of_numbers(item, value, placement.push)
    if isinstance(item, ControlVertices):
        if placement is None or placement.push is None or value.size > MOST or not item.independent:
            return None
        return _of_control_vertices(item, value, placement.push)
    if isinstance(item, Poses):
        return None if value.ndim > 2 else _of_pose(item, value)
    if isinstance(item, Directions):
        return None if value.ndim > 1 else _of_direction(item, value)
    if isinstance(item, (Positions, Values)) and value.size <= MOST_OF_ONE:
        return _of_values(item, value)
    return None


def _of_values(item: Positions | Values, value: F64) -> list[Coordinate]:
    low, high = item.limits if isinstance(item, Values) else (-np.inf, np.inf)
    bounded = np.isfinite(low) and np.isfinite(high)
    out = []
    for k, at in enumerate(np.ndindex(value.shape)):
        if value[at] <= low or value[at] >= high:
            continue
        tangent = np.zeros(value.shape)
        tangent[at] = 1.0
        relative = abs(float(value[at])) if np.isfinite(low) else 0.0
        way = high - low if bounded else relative or USUAL_WAY * item.step
        out.append(Coordinate(item.path, f"[{k}]" if value.ndim else "", float(value[at]),
                              METRES if isinstance(item, Positions) else "", item.step, way,
                              _constant({item.path: tangent}), k))  # fmt: skip
    return out


def _of_direction(item: Directions, value: F64) -> list[Coordinate]:
    unit = value / np.linalg.norm(value)
    across = np.linalg.svd(unit[None])[2][1:]
    tangents = [{item.path: np.linalg.norm(value) * axis} for axis in across]
    return [Coordinate(item.path, f"turn {k + 1}", None, RADIANS, item.step, 1.0, _constant(tangent), k)
            for k, tangent in enumerate(tangents)]  # fmt: skip


def _of_pose(item: Poses, value: F64) -> list[Coordinate]:
    columns = value[:3].copy()
    rigid = value.shape[-1] == 4
    if rigid:
        columns[:, 3] -= item.pivot
    out = []
    for k, (axis, name) in enumerate(zip(np.eye(3), "xyz", strict=True)):
        tangent = np.zeros(value.shape)
        tangent[:3] = np.cross(axis, columns.T).T
        out.append(Coordinate(item.path, f"rotation about {name}", None, RADIANS, item.step, 1.0,
                              _constant({item.path: tangent}), k))  # fmt: skip
    for k, name in enumerate("xyz" if rigid else ""):
        tangent = np.zeros(value.shape)
        tangent[k, 3] = 1.0
        out.append(Coordinate(item.path, f"translation along {name}", None, METRES, item.step * item.extent,
                              item.extent, _constant({item.path: tangent}), 3 + k))  # fmt: skip
    return out


def _of_numbers(item: Numbers, value: F64, push: Callable[[str, int, int], Tangent]) -> list[Coordinate]:
    out = []
    for k, number in enumerate(value):
        if item.low[k] < number < item.high[k]:
            bounded = np.isfinite(item.low[k]) and np.isfinite(item.high[k])
            way = float(item.high[k] - item.low[k]) if bounded else np.inf
            out.append(Coordinate(item.path, f"[{k}]" if value.size > 1 else "", float(number), "",
                                  float(item.steps[k]), min(way, USUAL_WAY * float(item.steps[k])),
                                  partial(push, item.path, k), k))  # fmt: skip
    return out


def _of_control_vertices(item: ControlVertices, value: F64, push: Callable[[str, int, int], Tangent]
                         ) -> list[Coordinate]:  # fmt: skip
    return [Coordinate(item.path, f"vertex {k // 3} {'xyz'[k % 3]}", float(value.flat[k]), "", item.step,
                       USUAL_WAY * item.step, partial(push, item.path, k), k)
            for k in np.flatnonzero(item.free).tolist()]  # fmt: skip


def moved(variables: Sequence[Unknown | Variable | Numbers], values: Mapping[str, Any], places: Sequence[Coordinate],
          changes: F64) -> dict[str, Any]:  # fmt: skip
    """Return the values after changes of their coordinates: within limits, with poses rigid, and without folds."""
    by_path: dict[str, list[tuple[Coordinate, float]]] = {}
    for place, change in zip(places, changes, strict=True):
        by_path.setdefault(place.path, []).append((place, float(change)))
    out = dict(values)
    for item in variables:
        if item.path in by_path:
            value = np.asarray(values[item.path], np.float64)
            now = _moved(item, value, by_path[item.path])
            out[item.path] = now if value.ndim else float(now)
    return out


def _moved(item: Unknown | Variable | Numbers, value: F64, changes: Sequence[tuple[Coordinate, float]]) -> F64:
    if isinstance(item, (Numbers, ControlVertices)):
        change = np.zeros(value.size)
        for place, amount in changes:
            change[place.at] = amount
        change = change.reshape(value.shape)
        if isinstance(item, Numbers):
            return np.clip(value + change, item.low, item.high)
        return value + item.without_folds(value, change)
    if isinstance(item, Poses):
        motion = np.zeros(6)
        for place, amount in changes:
            motion[place.at] = amount
        return item.moved(value, motion)
    total = value + sum(amount * place.tangent(0)[item.path] for place, amount in changes)
    if isinstance(item, Values):
        return np.clip(total, *item.limits)
    if isinstance(item, Directions):
        return np.asarray(total * (np.linalg.norm(value) / np.linalg.norm(total)))
    return np.asarray(total)


def _constant(tangent: Tangent) -> Callable[[int], Tangent]:
    """The same tangent for all pictures."""
    return lambda view: tangent

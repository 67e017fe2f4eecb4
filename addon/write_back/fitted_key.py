"""The shape key of fitted vertices: one for all fits of an object, as long as it is switched on."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..problem import Problem

KEY_NAME = "Edgegrad"
_NAMED = re.compile(rf"{KEY_NAME}(\.\d+)?$")
# A smaller value of the key would need a large change of its points.
LEAST_VALUE = 0.05


def write_key(ob: Any, moved: NDArray[np.float64]) -> None:
    """Add a move (n, 3) of all vertices to the fitted key that is switched on; if there is none, make one.

    A new key is relative to the active one, so that it is a correction of that shape, and its value is 1.
    """
    mesh = ob.data
    key = fitted_key(ob)
    if key is not None:
        set_points(key, points_of(key) + moved / key.value)
        return
    if mesh.shape_keys is None:
        ob.shape_key_add(name="Basis", from_mix=False)
    base = ob.active_shape_key or mesh.shape_keys.reference_key
    key = ob.shape_key_add(name=KEY_NAME, from_mix=False)
    key.relative_key = base
    set_points(key, points_of(base) + moved)
    key.value = 1.0
    if key.value != 1.0:
        raise Problem(f"object '{ob.name}': shape key '{key.name}' can't be switched on")


def fitted_key(ob: Any) -> Any:
    """Return the key of an earlier fit that shapes the object now: the active one, or else the last; None: none.

    A key that is switched off, or that a vertex group restricts, is left as it is.
    """
    keys = ob.data.shape_keys
    found = [key for key in ([] if keys is None else keys.key_blocks)
             if _NAMED.match(key.name) and key != keys.reference_key and not key.mute and not key.vertex_group
             and abs(key.value) >= LEAST_VALUE]  # fmt: skip
    active = ob.active_shape_key
    return active if active in found else found[-1] if found else None


def points_of(key: Any) -> NDArray[np.float32]:
    """Return the points (n, 3) of a shape key."""
    out = np.empty((len(key.points), 3), np.float32)
    key.points.foreach_get("co", out.ravel())
    return out


def set_points(key: Any, points: NDArray[Any]) -> None:
    """Replace the points (n, 3) of a shape key."""
    key.points.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())

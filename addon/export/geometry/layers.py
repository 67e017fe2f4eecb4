"""Numbers that Blender's data holds: its properties, and its layers of attributes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Maps the data type of a layer to the name of the value, the number of components, and the stored type.
LAYERS: dict[str, tuple[str, int, type[np.generic]]] = {
    "FLOAT": ("value", 1, np.float32), "INT": ("value", 1, np.int32), "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, np.bool_), "FLOAT_VECTOR": ("vector", 3, np.float32), "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32), "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32), "FLOAT4": ("value", 4, np.float32),
}  # fmt: skip


def property_of(owners: Iterable[Any], path: str) -> tuple[float, ...] | None:
    """Return the numbers of a property of the first of Blender's data that has it; None if none does."""
    for owner in owners:
        for key in (f'["{path}"]', path):
            try:
                value = owner.path_resolve(key)
            except (AttributeError, ValueError):
                continue
            value = int(value) if isinstance(value, bool) else value  # but several truth values are no numbers
            found = np.atleast_1d(np.asarray(value)) if not isinstance(value, str) else np.zeros(0)
            if found.ndim == 1 and 1 <= len(found) <= 4 and np.issubdtype(found.dtype, np.number):
                return tuple(map(float, found))
    return None


def layer_values(layer: Any) -> NDArray[Any] | None:
    """(n, c) values of a layer of attributes; None if there is none, or of a type without numbers."""
    if layer is None or layer.data_type not in LAYERS:
        return None
    field, width, kind = LAYERS[layer.data_type]
    values = np.empty((len(layer.data), width), kind)
    layer.data.foreach_get(field, values.ravel())
    return values

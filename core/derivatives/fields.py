"""The derivatives of the tables of distance fields: their coefficients, and their maps from grid to world."""

from __future__ import annotations

import numpy as np

from ..scene.field import Field
from ..scene.scene import Scene
from ..tables.tables import Tables
from .linear_map import F64, Piece, by_matrix, same


def pieces(scene: Scene, tables: Tables, name: str, field: str) -> list[Piece]:
    """Return the pieces of the tables that depend on one parameter of a distance field."""
    number = list(scene.fields).index(name)
    if field != "values":
        return by_matrix("field_to_world", 12 * number, _by_place(scene.fields[name], field))
    first = sum(table.values.size for table in tables.fields[:number])
    shape = tables.fields[number].values.shape
    size = int(np.prod(shape))
    return [same("field_values", first, first + size, (size,), shape)]


def _by_place(held: Field, field: str) -> F64:
    """The derivative of the (12,) rows of the map to the world by `transform`, `lower` or `upper`."""
    spacing = (held.upper - held.lower) / held.cells
    if field == "transform":
        out = np.zeros((3, 4, 4, 4))
        for row in range(3):
            out[row, :3, row, :3] = np.diag(spacing)
            out[row, 3, row, :3] = held.lower
            out[row, 3, row, 3] = 1.0
        return out.reshape(12, 4, 4)
    sign = 1.0 if field == "upper" else -1.0
    by = np.zeros((3, 4, 3))
    for axis in range(3):
        by[:, axis, axis] = sign * held.transform[:3, axis] / held.cells[axis]
        if field == "lower":
            by[:, 3, axis] = held.transform[:3, axis]
    return by.reshape(12, 3)

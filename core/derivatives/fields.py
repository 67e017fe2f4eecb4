"""The derivatives of the tables of distance fields: their coefficients, attributes, and maps from grid to world."""

from __future__ import annotations

from ..scene.parameters import layer_of
from ..scene.scene import Scene
from ..tables.tables import Tables
from .complex_step import jacobian
from .linear_map import Piece, by_matrix, same


def pieces(scene: Scene, tables: Tables, name: str, field: str) -> list[Piece]:
    """Return the pieces of the tables that depend on one parameter of a distance field."""
    number = list(scene.fields).index(name)
    if (layer := layer_of(field)) is not None:
        values = scene.fields[name].attributes[layer[1]]
        first = None if tables.textures is None else tables.textures.grid_place(layer[1], number)
        if first is None:  # no texture reads it
            return []
        return [same("texture_attributes", first, first + values.size, (values.size,), values.shape)]
    if field != "values":
        place = jacobian(lambda held: held.grid_to_world().reshape(12), scene.fields[name], field)
        return by_matrix("field_to_world", 12 * number, place)
    first = sum(table.values.size for table in tables.fields[:number])
    values, scale = tables.fields[number].values, tables.fields[number].scale
    whole = same("field_values", first, first + values.size, (values.size,), values.shape)
    return [whole if scale == 1.0 else whole.after(lambda v: scale * v, lambda g: scale * g)]

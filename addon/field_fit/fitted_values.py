"""Values of a field's material that are fitted as grids: which there are, and the material that reads them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.expression import Attribute

from ..export import Export
from ..problem import Problem
from ..write_back.painted import LAYERS
from ..write_back.values import find_material

# Words of the command line and of the panel, by fields of materials.
WORDS = {"base_color": "color", "roughness": "roughness", "metallic": "metallic"}
# Cells of the field along each axis to a cell of its grids: pictures rarely show finer colours.
CELLS = 2
# Beginnings of the types of nodes that are shaders, or may hold such.
_SHADERS = ("BSDF", "EMISSION", "MIX_SHADER", "ADD_SHADER", "GROUP")


@dataclass(frozen=True)
class FittedValues:
    """Values of a material in a fit as a field.

    Attributes
    ----------
    material
        Full name of Blender's material that they replace; None: there is none.
    grids
        The values at the start, by the name of the attribute.
    """

    material: str | None
    grids: dict[str, NDArray[np.float32]]


def fit_values(export: Export, field: edgegrad.Field, of: str | None, fields: tuple[str, ...],
               where: str) -> tuple[edgegrad.Field, FittedValues]:
    """Let the field's material read grids, which begin with the material's values.

    Parameters
    ----------
    of
        Name of the exported material that the object has; None: none.
    fields
        Fields of the material to fit: some of `WORDS`.

    Raises
    ------
    Problem
        If the object's material isn't one Principled BSDF, in which the result could be written.
    """
    reading = None if of is None else export.materials.get(of)
    name = None if reading is None else reading.material
    if name is not None:
        check_material(name, where)
    material = export.scene.materials[field.material]
    assert isinstance(material, edgegrad.Material)  # one shader
    count = field.cells // CELLS + 1
    grids = {}
    for one in fields:
        value = np.atleast_1d(np.asarray(getattr(material, one), np.float32))
        grids[LAYERS[one]] = np.broadcast_to(value, (*count, len(value))).copy()
    read = {one: Attribute(LAYERS[one]) for one in fields}
    fitted = f"{field.material} (fitted)"
    export.scene.materials = {**export.scene.materials,
                              fitted: replace(material, textures={**material.textures, **read})}  # fmt: skip
    return replace(field, material=fitted, attributes=grids), FittedValues(name, grids)


def check_material(name: str, where: str) -> None:
    """Raise `Problem` unless the material has one shader, a Principled BSDF."""
    found = find_material(name)
    nodes = () if found is None or found.node_tree is None else found.node_tree.nodes
    shaders = [node.type for node in nodes if node.type.startswith(_SHADERS)]
    if shaders != ["BSDF_PRINCIPLED"]:
        raise Problem(f"{where}: values of its material can be fitted only where that has one Principled BSDF and no "
                      f"other shader, unlike '{name}'; change the material, or fit the shape alone")  # fmt: skip

"""Attributes of meshes as attributes of fields."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from .._check import instance, names, shown, whole
from .._fields import near
from ..scene.field import Field
from ..scene.mesh import Mesh
from ..scene.placement import expanded
from .closest import nearest


def sampled_attributes(field: Field, mesh: Mesh, layers: Iterable[str], *, cells: int = 2) -> Field:
    """Give a field attributes of a mesh: each value of a grid is that of the nearest place of the mesh.

    Parameters
    ----------
    field
        The field, of about the same surface as the mesh.
    mesh
        The mesh; its transform and instances are applied.
    layers
        Names of attributes of the mesh: colours and other values that are continuous over the surface, unlike UV maps.
    cells
        Cells of the field along each axis to a cell of the grids.

    Returns
    -------
    The field with these attributes besides its own.

    Raises
    ------
    ValueError
        If the mesh has no such attribute, or no faces.
    """
    instance("sampled_attributes", "field", field, Field).validate("sampled_attributes")
    instance("sampled_attributes", "mesh", mesh, Mesh).validate("sampled_attributes")
    cells = whole("sampled_attributes", "cells", cells, 1, 1 << 14)
    placed = expanded(mesh)
    layers = names("sampled_attributes", "layers", layers, "attributes of the mesh")
    for name in layers:
        if name not in placed.attributes:
            raise ValueError(f"sampled_attributes: the mesh has no attribute {shown(name)}"
                             f"{near(name, placed.attributes)}")
    if not len(placed.faces):
        raise ValueError("sampled_attributes: the mesh has no faces; give it a surface")
    count = [1 + -(-int(n) // cells) for n in field.cells]
    axes = [np.linspace(0.0, float(n), size) for n, size in zip(field.cells, count, strict=True)]
    to_world = field.grid_to_world()
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    face, weight, _ = nearest(grid @ to_world[:, :3].T + to_world[:, 3], placed.vertices[placed.faces])
    found = {name: np.einsum("nk,nkc->nc", weight, placed.attributes[name][face]).reshape(*count, -1).astype(np.float32)
             for name in layers}  # fmt: skip
    return replace(field, attributes={**field.attributes, **found})

"""Fitted values of a material as attributes of a mesh, and the material that reads them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .values import find_material

SUFFIX = " (fitted)"
# Names of the attributes, by fields of materials.
LAYERS = {"base_color": "Fitted Color", "roughness": "Fitted Roughness", "metallic": "Fitted Metallic"}
_SOCKETS = {"base_color": "Base Color", "roughness": "Roughness", "metallic": "Metallic"}

# Attribute -> (v, 1 or 3) values at the vertices.
Layers = Mapping[str, NDArray[Any]]


def paint(mesh: Any, layers: Layers, material: str | None) -> None:
    """Give a mesh attributes, and a copy of a material that reads them as its only material.

    Parameters
    ----------
    material
        Full name of the material that is copied; a new one is made if there is none of this name.
    """
    for name, values in layers.items():
        if values.shape[1] == 3:
            colors = np.concatenate([values, np.ones((len(values), 1))], axis=1)
            made = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
            made.data.foreach_set("color", colors.astype(np.float32).ravel())
            mesh.color_attributes.active_color = made
        else:
            mesh.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", values.astype(np.float32).ravel())
    mesh.materials.clear()
    mesh.materials.append(_material(layers, None if material is None else find_material(material)))
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))


def _material(layers: Layers, old: Any) -> Any:
    """A copy of a material with a Principled BSDF, or a new one, that reads the attributes."""
    if old is None:
        made = bpy.data.materials.new(SUFFIX.strip(" ()").capitalize())
        if made.node_tree is None:
            made.use_nodes = True
    else:
        made = old.copy()
        made.name = old.name + SUFFIX
    tree = made.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    if old is None:  # as the fit rendered a surface without a material
        shader.inputs["Specular IOR Level"].default_value = 0.0
    for row, (field, name) in enumerate(LAYERS.items()):
        if name in layers:
            node = tree.nodes.new("ShaderNodeAttribute")
            node.attribute_name, node.label = name, name
            node.location = (shader.location.x - 300.0, shader.location.y - 180.0 * row)
            output = node.outputs["Color" if layers[name].shape[1] == 3 else "Fac"]
            tree.links.new(output, shader.inputs[_SOCKETS[field]])
    return made

"""UV maps and attributes that materials read, but that a mesh does not have: they are 0 there, as in Cycles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from edgegrad.expression import nodes_of
from edgegrad.expression.hit_point import Attribute

from ..geometry.attributes import ACTIVE_UV, TANGENT


def warn_of_missing_layers(out: Any) -> None:
    """Warn of each object that lacks a UV map or an attribute of its materials."""
    read = {name: set(_read(material)) for name, material in out.scene.materials.items()}
    for key, mesh in out.scene.meshes.items():
        has = {*mesh.attributes, *mesh.instance_attributes}
        for material in dict.fromkeys(mesh.materials):
            for name in sorted(read.get(material, set()) - has):
                where = f"object '{out.meshes[key].object}'"
                if name == ACTIVE_UV:
                    out.report.warn(where, f"has no UV map, which material '{material}' reads; it is 0 there, as in "
                                    "Cycles; unwrap the mesh")  # fmt: skip
                else:
                    out.report.warn(where, f"has no UV map or attribute '{name}', which material '{material}' reads; "
                                    "it is 0 there, as in Cycles; add it, or choose another one in the "
                                    "material")  # fmt: skip


def _read(material: Any) -> Iterator[str]:
    """Yield the layers of meshes that a material reads. Other attributes have names in brackets."""
    for value in getattr(material, "textures", {}).values():
        for node in nodes_of(value):
            if isinstance(node, Attribute) and not node.required and not node.name.endswith(TANGENT) and (
                    node.name == ACTIVE_UV or not node.name.startswith("(")):  # fmt: skip
                yield node.name

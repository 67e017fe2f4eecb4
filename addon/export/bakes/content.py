"""Hashes of all that decides a bake: node trees with their settings, and meshes."""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np

from .image_cache import key_of

# Properties that say nothing about what is rendered.
_SKIPPED = {"rna_type", "animation_data", "preview", "asset_data", "library", "original", "users", "tag",
            "session_uid", "override_library", "library_weak_reference", "id_data", "grease_pencil", "annotation",
            "select", "location", "location_absolute", "width", "height", "show_preview", "show_options",
            "warning_propagation"}  # fmt: skip


class UnknownContent(Exception):
    """Raised for data whose content cannot be told."""


def content_of(owner: Any) -> bytes:
    """Hash of a material or world and all that its nodes refer to.

    Raises
    ------
    UnknownContent
        If it refers to data whose content can change unnoticed, such as painted images and driven values.
    """
    reader = _Reader()
    reader.struct(owner)
    return reader.hash.digest()


def mesh_content(mesh: Any) -> bytes:
    """Hash of a mesh: its attributes, faces and texture space."""
    found = hashlib.sha256()
    for attribute in mesh.attributes:
        found.update(repr((attribute.name, attribute.data_type, attribute.domain, len(attribute.data))).encode())
        for name, kind, width in _FIELDS.get(attribute.data_type, ()):
            values = np.empty(len(attribute.data) * width, kind)
            attribute.data.foreach_get(name, values)
            found.update(values.tobytes())
        if attribute.data_type not in _FIELDS:
            raise UnknownContent(attribute.data_type)
    for parts, name, kind, width in ((mesh.polygons, "loop_start", np.int32, 1),
                                     (mesh.vertices, "undeformed_co", np.float32, 3),
                                     (mesh.corner_normals, "vector", np.float32, 3)):  # fmt: skip
        values = np.empty(len(parts) * width, kind)
        parts.foreach_get(name, values)
        found.update(values.tobytes())
    active = [(layer.name, layer.active_render) for layer in mesh.uv_layers]
    color = mesh.color_attributes.render_color_index
    found.update(repr((tuple(mesh.texspace_location), tuple(mesh.texspace_size), active, color)).encode())
    return found.digest()


_FIELDS: dict[str, tuple[tuple[str, Any, int], ...]] = {
    "FLOAT": (("value", np.float32, 1),), "INT": (("value", np.int32, 1),), "INT8": (("value", np.int32, 1),),
    "BOOLEAN": (("value", np.bool_, 1),), "FLOAT_VECTOR": (("vector", np.float32, 3),),
    "FLOAT2": (("vector", np.float32, 2),), "FLOAT_COLOR": (("color", np.float32, 4),),
    "BYTE_COLOR": (("color", np.float32, 4),), "QUATERNION": (("value", np.float32, 4),),
    "INT32_2D": (("value", np.int32, 2),), "INT16_2D": (("value", np.int32, 2),),
}  # fmt: skip


def _plain(value: Any) -> Any:
    """A value that is written the same way whenever it is the same."""
    if isinstance(value, (str, int, float)) or value is None:
        return value
    return sorted(value) if isinstance(value, set) else np.asarray(value).tolist()


class _Reader:
    """Hashes structures of Blender property by property; each structure once, then its number."""

    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        self.seen: dict[tuple[str, int], int] = {}

    def put(self, *values: object) -> None:
        self.hash.update(repr(values).encode())

    def struct(self, one: Any) -> None:
        key = (type(one).__name__, one.as_pointer())
        if key in self.seen:
            self.put("seen", self.seen[key])
            return
        self.seen[key] = len(self.seen)
        self.put(key[0])
        animation = getattr(one, "animation_data", None)
        if animation is not None and len(animation.drivers):
            raise UnknownContent(one.name)
        for prop in one.bl_rna.properties:
            if prop.identifier not in _SKIPPED:
                self.put(prop.identifier)
                self.value(getattr(one, prop.identifier, None), prop)

    def value(self, value: Any, prop: Any) -> None:
        if prop.type == "COLLECTION":
            self.put(len(value))
            for item in value:
                self.struct(item)
        elif prop.type != "POINTER":
            self.put(_plain(value))
        elif value is None:
            self.put(None)
        elif isinstance(value, bpy.types.Image):
            key = key_of(value)
            if key is None:
                raise UnknownContent(value.name_full)
            self.put(key)
        elif isinstance(value, bpy.types.Object):
            self.put(value.name_full, tuple(map(tuple, value.matrix_world)))
        elif isinstance(value, bpy.types.Text):
            self.put(value.as_string())
        elif isinstance(value, bpy.types.ID) and not isinstance(value, (bpy.types.NodeTree, bpy.types.Material)):
            raise UnknownContent(value.name_full)
        else:
            self.struct(value)

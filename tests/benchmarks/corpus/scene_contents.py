"""What a .blend contains, as a digest: whether a rewritten script still builds the scene that Cycles has rendered.

Scripts change without changing their scene, and one script never gives the same file twice: the order of a sphere's
faces differs from run to run. The digest is of every property of every datablock; elements of meshes count without
their order.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

# Collections of `bpy.data` that don't decide about a picture.
_INTERFACE = {"brushes", "libraries", "palettes", "screens", "texts", "window_managers", "workspaces"}
# Properties that differ between two builds of one scene, or are derived from others.
_VOLATILE = {"animation_visualization", "asset_data", "bl_rna", "edit_mesh", "evaluated", "filepath", "filepath_raw",
             "id_properties", "is_dirty", "is_evaluated", "original", "override_library", "packed_file", "packed_files",
             "preview", "rna_type", "session_uid", "session_uuid", "users",
             "seed", "tool_settings"}  # fmt: skip
_FIGURES = 5  # significant digits of numbers that builders compute


def differences(first: dict[str, str], second: dict[str, str]) -> list[str]:
    """Names of the datablocks that only one has, or that are not the same in both."""
    return sorted(name for name in first.keys() | second.keys() if first.get(name) != second.get(name))


def contents() -> dict[str, str]:
    """A digest for each datablock of the open file."""
    found = {"version": str(bpy.data.version)}
    for group in bpy.data.bl_rna.properties:
        if group.type != "COLLECTION" or group.identifier in _INTERFACE:
            continue
        for block in getattr(bpy.data, group.identifier):
            text = "\n".join(_described(block, set(), ""))
            found[f"{group.identifier}/{block.name_full}"] = hashlib.sha256(text.encode()).hexdigest()
    return found


def _described(struct: Any, seen: set[tuple[int, str]], path: str) -> Iterator[str]:
    """Lines "path.property value" of a struct and of what it owns."""
    key = (struct.as_pointer(), struct.bl_rna.identifier)
    if key in seen:
        return
    seen.add(key)
    if isinstance(struct, bpy.types.Mesh):
        yield from _mesh(struct, path)
    if isinstance(struct, bpy.types.Image) and struct.has_data:
        values = np.empty(len(struct.pixels), np.float32)
        struct.pixels.foreach_get(values)
        yield f"{path}.pixels {_array(values)}"
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in _VOLATILE or (isinstance(struct, bpy.types.Image) and name == "pixels"):
            continue
        if isinstance(struct, bpy.types.Mesh) and prop.type in ("COLLECTION", "POINTER") and name != "materials":
            continue  # elements, which `_mesh` describes
        try:
            value = getattr(struct, name)
        except Exception as error:  # a property that this state of the datablock hasn't
            yield f"{path}.{name} {type(error).__name__}"
            continue
        yield from _value(value, prop.type, seen, f"{path}.{name}")
    for name in sorted(struct.keys()) if hasattr(struct, "keys") and isinstance(struct, bpy.types.ID) else ():
        yield f"{path}[{name}] {struct[name]!r}"[:400]


def _value(value: Any, kind: str, seen: set[tuple[int, str]], path: str) -> Iterator[str]:
    """Lines of a property's value."""
    if kind == "COLLECTION":
        yield f"{path} {len(value)}"
        for index, one in enumerate(value):
            yield from _reference(one, seen, f"{path}.{index}")
    elif kind == "POINTER":
        yield from _reference(value, seen, path)
    elif kind == "FLOAT":
        yield f"{path} {_array(np.ravel(np.array(value, np.float64)))}"
    elif kind in ("INT", "BOOLEAN"):
        yield f"{path} {np.ravel(np.array(value)).tolist()}"
    else:
        yield f"{path} {sorted(value) if isinstance(value, set) else value!r}"


def _reference(value: Any, seen: set[tuple[int, str]], path: str) -> Iterator[str]:
    """Lines of a struct that another has: other datablocks by name, except the node trees that belong to one."""
    if isinstance(value, bpy.types.ID) and not getattr(value, "is_embedded_data", False):
        yield f"{path} {value.bl_rna.identifier} {value.name_full}"
    elif isinstance(value, bpy.types.bpy_struct):
        yield from _described(value, seen, path)
    else:
        yield f"{path} {value!r}"


def _mesh(mesh: Any, path: str) -> Iterator[str]:
    """Lines of a mesh's faces and attributes, each sorted."""
    count = len(mesh.polygons)
    for name, width in (("center", 3), ("normal", 3), ("area", 1), ("material_index", 1), ("use_smooth", 1)):
        values = np.empty(count * width, np.float32)
        mesh.polygons.foreach_get(name, values)
        yield f"{path}.polygons.{name} {_rows(values, width)}"
    widths = {"FLOAT_VECTOR": ("vector", 3), "FLOAT2": ("vector", 2), "FLOAT": ("value", 1), "INT": ("value", 1),
              "FLOAT_COLOR": ("color", 4), "BYTE_COLOR": ("color", 4), "BOOLEAN": ("value", 1)}  # fmt: skip
    for attribute in sorted(mesh.attributes, key=lambda one: one.name):
        line = f"{path}.attributes.{attribute.name} {attribute.domain} {attribute.data_type} {len(attribute.data)}"
        if attribute.data_type in widths and not attribute.name.startswith("."):
            field, width = widths[attribute.data_type]
            values = np.empty(len(attribute.data) * width, np.float32)
            attribute.data.foreach_get(field, values)
            line += f" {_rows(values, width)}"
        yield line
    rendered = [layer.name for layer in mesh.uv_layers if layer.active_render]
    yield f"{path}.rendered {rendered} {mesh.color_attributes.render_color_index}"


def _rows(values: Any, width: int) -> str:
    """Moments of rows, which don't depend on their order: their number, their means and how they vary together."""
    rows = np.asarray(values, np.float64).reshape(-1, width)
    powers = [rows, rows**2, rows**3, np.prod(rows, axis=1, keepdims=True)]
    size = max(float(np.abs(rows).max(initial=0.0)), 1.0)
    moments = [(power / size**degree).mean(axis=0) if len(rows) else np.zeros(1)
               for power, degree in zip(powers, (1, 2, 3, width), strict=True)]  # fmt: skip
    return f"{len(rows)} {_array([size])} {_array(np.round(np.concatenate(moments), 4))}"


def _array(values: Any) -> str:
    """Numbers with few significant digits; a digest if there are many."""
    text = " ".join(f"{value:.{_FIGURES}g}" for value in (np.asarray(values, np.float64) + 0.0).tolist())
    return text if len(text) < 400 else hashlib.sha256(text.encode()).hexdigest()

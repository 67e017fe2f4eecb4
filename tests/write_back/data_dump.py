"""Everything that Blender's data hold, as text by path, to be compared before and after a change."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

# Not stored in files, or different at each reading.
VOLATILE = {"rna_type", "bl_rna", "session_uid", "is_evaluated", "original", "users", "is_updated", "is_updated_data",
            "tag", "id_data", "is_dirty", "is_runtime_data", "depsgraph", "render_slots", "bindcode", "pixels",
            "current_character", "current_line", "select_end_line", "select_end_character", "is_modified",
            "is_in_memory"}  # fmt: skip
# The user interface, of which Blender 4.5 cannot read all properties without a window.
INTERFACE = ("screens", "window_managers", "workspaces")
MOST_DEPTH = 8


def dump() -> dict[str, str]:
    """Return all values of all datablocks by their paths."""
    found: dict[str, str] = {}
    for prop in bpy.types.BlendData.bl_rna.properties:
        if prop.type != "COLLECTION" or prop.identifier in INTERFACE:
            continue
        for datablock in getattr(bpy.data, prop.identifier):
            where = f"{prop.identifier}[{datablock.name_full!r}]"
            found[where] = type(datablock).__name__
            found |= dict(_struct(where, datablock, 0, set()))
            for key in datablock.keys():  # noqa: SIM118  (custom properties)
                found[f"{where}[{key!r}]"] = repr(datablock[key])
    return found


def difference(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """Return a line for each path whose value differs, or that only one has."""
    return [f"{path}: {before.get(path)} -> {after.get(path)}" for path in dict.fromkeys((*before, *after))
            if before.get(path) != after.get(path)]  # fmt: skip


def _struct(where: str, held: Any, depth: int, seen: set[int]) -> Iterator[tuple[str, str]]:
    if not isinstance(held, bpy.types.bpy_struct):
        yield where, repr(held)
        return
    if depth > MOST_DEPTH or held.as_pointer() in seen:
        return
    inside = seen | {held.as_pointer()}
    for prop in held.bl_rna.properties:
        name = prop.identifier
        if name in VOLATILE or name.startswith("is_"):
            continue
        try:
            value = getattr(held, name)
        except (AttributeError, RuntimeError, ValueError):
            continue
        path = f"{where}.{name}"
        if isinstance(value, bpy.types.ID):
            embedded = value.id_type == "NODETREE" and value.is_embedded_data
            yield path, value.name_full
            if embedded:
                yield from _struct(path, value, depth + 1, inside)
        elif prop.type == "POINTER":
            yield path, str(value is None)
            if value is not None:
                yield from _struct(path, value, depth + 1, inside)
        elif prop.type == "COLLECTION":
            yield path, str(len(value))
            for k, one in enumerate(value):
                if isinstance(one, bpy.types.ID):
                    yield f"{path}[{k}]", one.name_full
                else:
                    yield from _struct(f"{path}[{k}]", one, depth + 1, inside)
        elif getattr(prop, "is_array", False):
            yield path, repr([list(row) if hasattr(row, "__len__") else row for row in value])
        else:
            yield path, repr(value)

"""The list of parameters that a .blend stores in its scene, and lists of all properties of one thing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from ..problem import Problem
from . import data_path, gathering, refusals
from .data_path import Place
from .parameter import Wanted

PROPERTY = "PROPERTY"


def row_name(row: Any) -> str | None:
    """Whole path of a row's property; None if its datablock was removed, or if it is of another kind."""
    return None if row.owner is None or row.kind != PROPERTY else Place(row.owner, row.path, row.index).name


def stored_wanted(scene: Any) -> list[Wanted]:
    """Return the properties of the scene's list that are switched on (`wanted_of_rows`)."""
    settings = getattr(scene, "edgegrad", None)
    return wanted_of_rows([] if settings is None else [row for row in settings.parameters if row.enabled])


def wanted_of_rows(rows: Iterable[Any]) -> list[Wanted]:
    """Return the properties of rows of this kind.

    Raises
    ------
    Problem
        For a row whose datablock was removed.
    """
    out = []
    for row in rows:
        if row.kind != PROPERTY:
            continue
        name = row_name(row)
        if name is None:
            raise Problem(f"parameter '{row.path}': its datablock was removed; remove it from the list")
        low, high = (row.low, row.high) if row.use_limits else (None, None)
        film = row.id_data.edgegrad.use_frames
        out.append(Wanted(name, low, high, row.step or None, row.keyed and film))
    return out


def add_row(scene: Any, owner: Any, path: str, index: int = -1) -> Any:
    """Add a property to the scene's list; return its row, also if it was there before.

    Raises
    ------
    Problem
        If a fit cannot set it.
    """
    found = data_path.places(owner, path if index < 0 else f"{path}[{index}]")
    for place in found:
        refusals.check(place, scene.edgegrad.use_frames)
    first = found[0]
    index = first.index if len(found) == 1 else -1
    rows = scene.edgegrad.parameters
    for row in rows:
        if row.kind == PROPERTY and row.owner == owner and row.path == first.path and row.index == index:
            return row
    row = rows.add()
    row.owner, row.path, row.index = owner, first.path, index
    return row


def remember_sensitivities(scene: Any, found: dict[str, float]) -> None:
    """Store the sensitivities of parameters, by their whole paths, in the scene's list."""
    settings = getattr(scene, "edgegrad", None)  # the add-on may be imported without being enabled
    for row in () if settings is None else settings.parameters:
        row.sensitivity = found.get(row_name(row) or "", row.sensitivity)


def all_of(text: str) -> list[tuple[Any, str]]:
    """Return datablock and path of all properties of one thing, by its path.

    Raises
    ------
    Problem
        If there is no such thing.
    """
    match = data_path.START.match(text.strip())
    held = getattr(bpy.data, match["collection"], None) if match is not None else None
    owner = held.get(bpy.utils.unescape_identifier(match["name"])) if held is not None and match is not None else None
    if owner is None:
        raise Problem(f"'{text}': there is no such object, light, camera, material, world or bone; write it like "
                      "'objects[\"Cube\"]'")  # fmt: skip
    if match is not None and match["rest"]:
        bone = data_path.resolved(owner, match["rest"])
        if not isinstance(bone, bpy.types.PoseBone):
            raise Problem(f"'{text}': is no pose bone; write it like 'objects[\"Rig\"].pose.bones[\"Arm\"]'")
        return gathering.of_bones(owner, bone)
    if isinstance(owner, bpy.types.Object):
        return gathering.of_object(owner)
    if isinstance(owner, (bpy.types.Material, bpy.types.World)):
        return gathering.of_nodes(owner)
    return gathering.of_data(owner)


def wanted_of(text: str) -> tuple[list[Wanted], list[str]]:
    """Return all properties of one thing that a fit can set, and a sentence on each of the others."""
    kept, refused = gathering.settable(all_of(text))
    return [Wanted(Place(places[0].owner, places[0].path, places[0].index if len(places) == 1 else -1).name)
            for places in kept], refused  # fmt: skip

"""The rows of the scene's list of parameters: those of all kinds, in words and as the names of a fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from .animated.data_path import Place
from .animated.driver import relative
from .animated.stored import PROPERTY, row_name
from .parameters import Names
from .problem import Problem
from .session import Session
from .write_back.image_pixels import check_image
from .write_back.values import check_light
from .write_back.vertices import check_own_mesh


@dataclass(frozen=True)
class Kind:
    """A kind of rows: values that the engine differentiates without Blender.

    Attributes
    ----------
    label, icon
        For the panel.
    names
        Attribute of `Names` with the names of such rows' datablocks.
    """

    label: str
    icon: str
    names: str


KINDS = {
    "VERTICES": Kind("Vertices", "MESH_DATA", "vertices"),
    "BASE_COLOR": Kind("Base Color", "MATERIAL", "base_color"),
    "EMISSION": Kind("Emission", "LIGHT_SUN", "emission"),
    "POWER": Kind("Power", "LIGHT", "power"),
    "IMAGE": Kind("Pixels", "IMAGE_DATA", "image"),
}
ICONS = {"MESH": "MESH_DATA", "LIGHT": "LIGHT", "CAMERA": "CAMERA_DATA", "ARMATURE": "ARMATURE_DATA",
         "CURVE": "CURVE_DATA", "LATTICE": "LATTICE_DATA"}  # fmt: skip
PARTS, COLOR_PARTS = "XYZW", "RGB"
COLORS = ("COLOR", "COLOR_GAMMA")  # subtypes of properties whose numbers are red, green, blue and alpha
# What Blender's buttons name otherwise than its data, and the parts that begin with W.
ROTATIONS = ("rotation_euler", "rotation_quaternion", "rotation_axis_angle")
# Of names of nodes, what short names of rows do without: nodes that nearly each material and world has, and suffixes.
USUAL_NODES, SUFFIXES = ("Principled BSDF", "Background"), (" BSDF", " Texture")


def switched_on(scene: Any, kind: str | None = None) -> Iterator[Any]:
    """Yield the rows that are switched on, of one kind if it is given."""
    for row in scene.edgegrad.parameters:
        if row.enabled and kind in (None, row.kind):
            yield row


def names_of(rows: Any) -> Names:
    """Return the names of rows of the engine's own kinds; raise `Problem` for one whose datablock was removed."""
    found: dict[str, list[str]] = {kind.names: [] for kind in KINDS.values()}
    for row in rows:
        if row.kind == PROPERTY:
            continue
        kind = KINDS[row.kind]
        if row.owner is None:
            raise Problem(f"parameter '{kind.label}': its datablock was removed; remove it from the list")
        name = row.owner.name if isinstance(row.owner, bpy.types.Object) else row.owner.name_full
        if name not in found[kind.names]:
            found[kind.names].append(name)
    return Names(**{name: tuple(values) for name, values in found.items()})


def add_kind(scene: Any, kind: str, owner: Any) -> Any:
    """Add a row of one of `KINDS` to the scene's list; return it, also if it was there before.

    Raises
    ------
    Problem
        If the datablock has no such value, or none that can be written.
    """
    where = f"{owner.bl_rna.identifier.lower()} '{owner.name}'"
    if kind == "VERTICES":
        if owner.type != "MESH":
            raise Problem(f"{where}: is no mesh, so it has no vertices to fit")
        check_own_mesh(owner)
    elif kind == "POWER":
        check_light(owner, owner.name)
    elif kind == "IMAGE":
        check_image(owner, owner.name_full)
    for row in scene.edgegrad.parameters:
        if row.kind == kind and row.owner == owner:
            return row
    row = scene.edgegrad.parameters.add()
    row.kind, row.owner = kind, owner
    return row


def title(row: Any) -> tuple[str, str, str]:
    """Return icon, owner and property of a row in words."""
    icon, _, owner, inner, label = _named(row)
    return icon, owner, f"{inner}: {label}" if inner else label


def names(row: Any, room: int) -> tuple[str, str, str]:
    """Return icon and name of a row, and a name in so many characters by which it is told apart from others.

    The property is named whole if it can be. The datablock of a bone or a shape key is left out, and usual nodes are;
    what is still too long lacks its middle, since names differ at their ends.
    """
    icon, holder, owner, inner, label = _named(row)
    name = f"{owner}: {inner}: {label}" if inner else f"{owner}: {label}"
    if isinstance(holder, (bpy.types.PoseBone, bpy.types.ShapeKey)):
        owner = inner
    elif inner and inner not in USUAL_NODES:
        for suffix in SUFFIXES:
            inner = inner.replace(suffix, "")
        owner = f"{owner} {inner}"
    label = shortened(label, room * 2 // 3)
    return icon, name, f"{shortened(owner, room - len(label) - 2)}: {label}"


def _named(row: Any) -> tuple[str, Any, str, str, str]:
    """Return the icon of a row, what in its datablock has the property, and the names of the three as `_parts`."""
    if row.owner is None:
        return "ERROR", None, "(removed)", "", KINDS[row.kind].label if row.kind != PROPERTY else row.path
    if row.kind != PROPERTY:
        return KINDS[row.kind].icon, row.owner, row.owner.name, "", KINDS[row.kind].label
    kind = getattr(row.owner, "type", "") if isinstance(row.owner, bpy.types.Object) else ""
    icon = ICONS.get(kind, {"Material": "MATERIAL", "World": "WORLD", "Camera": "CAMERA_DATA"}.get(
        type(row.owner).__name__, "OBJECT_DATA" if kind else "RNA"))  # fmt: skip
    holder, inner, label = _parts(row.owner, row.path, row.index)
    return icon, holder, row.owner.name, inner, label


def words(owner: Any, path: str, index: int = -1) -> str:
    """Return a data path as Blender's buttons name it: 'Bend: Angle', 'Principled BSDF: Roughness'."""
    _, inner, label = _parts(owner, path, index)
    return f"{inner}: {label}" if inner else label


def place_name(place: Place) -> str:
    """Return the name of a number as the list of parameters has it: 'Camera: Location X'."""
    return f"{place.owner.name}: {words(place.owner, place.path, place.index)}"


def _parts(owner: Any, path: str, index: int) -> tuple[Any, str, str]:
    """Return what in a datablock has a property, and the names of both; no name if that is the datablock itself."""
    start, _, name = path.rpartition(".")
    custom = path.endswith('"]')
    if custom:
        start, name = path[: path.rfind('["')].rstrip("."), path[path.rfind('["') + 2 : -2]
        name = bpy.utils.unescape_identifier(name)
    holder = owner
    try:
        holder = owner.path_resolve(start) if start else owner
        found = None if custom else holder.bl_rna.properties.get(name)
    except (ValueError, AttributeError):
        return None, "", f"(missing) {path}"
    inner, label = "", name if found is None else "Rotation" if name in ROTATIONS else found.name
    if isinstance(holder, bpy.types.NodeSocket):
        inner, label = holder.node.label or holder.node.name, holder.name
    elif holder != owner:
        # Settings of a datablock have no name of their own but that of their kind; items of a list have a number.
        inner = getattr(holder, "name", start if start.endswith("]") else holder.bl_rna.name)
    parts = "" if found is None else "RGBA" if found.subtype in COLORS else "WXYZ" if name in ROTATIONS[1:] else PARTS
    return holder, inner, label + ("" if index < 0 else f" {parts[index]}" if index < len(parts) else f" [{index}]")


def shortened(name: str, room: int) -> str:
    """Return a name without as much of its middle as there is no room for; the dots are as wide as two characters."""
    if len(name) <= room:
        return name
    kept = max(room - 2, 2)
    return f"{name[: kept - kept // 2]}…{name[-(kept // 2) :]}"


def value_text(row: Any, whole: bool = False) -> str:
    """Return the present value of a row's property, or how many numbers it has: of a few, the numbers if `whole`."""
    if row.owner is None:
        return ""
    if row.kind == "VERTICES":
        return f"{len(row.owner.data.vertices):,} × 3"
    if row.kind == "POWER":
        return f"{row.owner.data.energy:.4g}"
    if row.kind == "IMAGE":
        return f"{row.owner.size[0]} × {row.owner.size[1]}"
    if row.kind != PROPERTY:
        return "3"
    try:
        found = row.owner.path_resolve(row.path)
    except ValueError:
        return ""
    numbers = list(found) if hasattr(found, "__len__") else [found]
    if row.index >= 0:
        numbers = numbers[row.index : row.index + 1]
    if not all(isinstance(number, (int, float)) for number in numbers):
        return ""
    if len(numbers) == 1 or (whole and len(numbers) <= len(PARTS)):
        return ", ".join(f"{number + 0.0:.4g}" for number in numbers)  # which is not -0
    return str(len(numbers))


def paths_of(row: Any, session: Session) -> list[str]:
    """Return the paths of a row's variables in a fit."""
    if row.owner is None:
        return []
    if row.kind == PROPERTY:
        return [row_name(row) or ""]
    controls = [] if session.driver is None else session.driver.controls
    if row.kind == "VERTICES" and any(control.object == row.owner for control in controls):
        return [control.path for control in controls if control.object == row.owner]
    try:
        return names_of([row]).paths(session.export)
    except Problem:
        return []


def remember_effects(scene: Any, session: Session, effects: Mapping[str, float]) -> None:
    """Store the effects of parameters on the loss, relative to the largest, in the scene's list."""
    found = relative(effects)
    for row in scene.edgegrad.parameters:
        known = [found[path] for path in paths_of(row, session) if path in found]
        if known and row.sensitivity != max(known):
            row.sensitivity = max(known)


def in_words(scene: Any, session: Session, sentences: Iterable[str]) -> list[str]:
    """Return sentences with the names of rows in place of the paths of their variables, each sentence once."""
    paths = [(f"'{path}'", row) for row in switched_on(scene) for path in paths_of(row, session)]
    found = []
    for sentence in sentences:
        for path, row in paths:
            listed = sentence.startswith(f"{path}: ")
            if row.kind in ("BASE_COLOR", "EMISSION"):
                for k, letter in enumerate(COLOR_PARTS):
                    sentence = sentence.replace(f"{path} [{k}]", f"{path} {letter}")
                    if listed:
                        sentence = sentence.replace(f"[{k}] ", f"{letter} ")
            sentence = sentence.replace(path, f"'{row.name}'")
        found.append(sentence)
    return list(dict.fromkeys(found))

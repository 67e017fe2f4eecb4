"""A property of Blender: a datablock, the path of a number in it, and the index of the number in an array."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy

from ..problem import Problem

# 'objects["Rig"]' at the start of a path, whose name may contain escaped quotes.
START = re.compile(r'^(?:bpy\.data\.)?(?P<collection>[a-z_]+)\[(?P<quote>["\'])(?P<name>(?:\\.|(?!(?P=quote)).)*)'
                    r'(?P=quote)\]\.?(?P<rest>.*)$', re.DOTALL)  # fmt: skip
_INDEX = re.compile(r"^(?P<path>.+)\[(?P<index>\d+)\]$", re.DOTALL)
_KEY = re.compile(r'\["((?:\\.|[^"\\])*)"\]$')
_MODIFIER = re.compile(r'^(?P<modifier>modifiers\["(?:\\.|[^"\\])*"\])\["(?P<key>(?:\\.|[^"\\])*)"\]$')
EXAMPLE = 'objects["Cube"].location'


@dataclass(frozen=True)
class Place:
    """The place of one number.

    Attributes
    ----------
    owner
        The datablock, which is never an embedded node tree.
    path
        Path from the datablock to the property, as RNA writes it.
    index
        Index in an array; -1: the property is one number.
    """

    owner: Any
    path: str
    index: int = -1

    @property
    def name(self) -> str:
        """The whole path from ``bpy.data`` on."""
        collection = collection_of(self.owner)
        between = "" if self.path.startswith("[") else "."
        number = "" if self.index < 0 else f"[{self.index}]"
        return f'{collection}["{bpy.utils.escape_identifier(self.owner.name)}"]{between}{self.path}{number}'

    def read(self) -> float:
        """Return the value."""
        found = self.owner.path_resolve(self.path)
        return float(found if self.index < 0 else found[self.index])

    def write(self, value: float) -> float:
        """Set the value, with all that Blender does when a user sets it, and return what it has become."""
        holder, key, custom = self.holder()
        if self.index >= 0:
            (holder[key] if custom else getattr(holder, key))[self.index] = value
        elif custom:
            holder[key] = float(value)  # a custom property keeps the type of what is assigned
        else:
            setattr(holder, key, value)
        # This runs the update of the property, which tags what depends on it, custom properties too.
        self.owner.path_resolve(self.path, False).update()
        return self.read()

    def limits(self) -> tuple[float, float, float, float]:
        """Return the hard limits, then the soft ones."""
        holder, key, custom = self.holder()
        if custom:
            found = holder.id_properties_ui(key).as_dict()
            low, high = float(found.get("min", -math.inf)), float(found.get("max", math.inf))
            return low, high, float(found.get("soft_min", low)), float(found.get("soft_max", high))
        rna = holder.bl_rna.properties[key]
        low, high, soft_low, soft_high = rna.hard_min, rna.hard_max, rna.soft_min, rna.soft_max
        if type(holder).__name__ == "ShapeKey" and key == "value":  # Blender clamps it at its own range
            low = soft_low = holder.slider_min
            high = soft_high = holder.slider_max
        return low, high, soft_low, soft_high

    def is_angle(self) -> bool:
        """Whether the value is an angle in radians."""
        holder, key, custom = self.holder()
        if custom:
            return str(holder.id_properties_ui(key).as_dict().get("subtype", "")) == "ANGLE"
        return str(holder.bl_rna.properties[key].unit) == "ROTATION"

    def holder(self) -> tuple[Any, str, bool]:
        """Return the struct with the property, the property's name, and whether it is a custom one."""
        custom = self.path.endswith('"]')
        cut = _KEY.search(self.path).start() if custom else self.path.rfind(".")  # type: ignore[union-attr]
        holder = self.owner.path_resolve(self.path[:cut]) if cut > 0 else self.owner
        key = bpy.utils.unescape_identifier(self.path[cut + 2 : -2]) if custom else self.path[cut + 1 :]
        return holder, key, custom


def collection_of(owner: Any) -> str:
    """Name of the collection in ``bpy.data`` that holds a datablock."""
    for prop in bpy.types.BlendData.bl_rna.properties:
        if prop.type == "COLLECTION" and isinstance(owner, getattr(bpy.types, prop.fixed_type.identifier)):
            library = None if owner.library is None else owner.library.filepath
            if getattr(bpy.data, prop.identifier).get((owner.name, library)) == owner:
                return str(prop.identifier)
    raise Problem(f"datablock '{owner.name}': is not in this file's data")


def of_button(owner: Any, path: str) -> tuple[Any, str]:
    """Return the datablock and path of the property that a button shows.

    Blender tells an embedded node tree as the owner of what its nodes hold.

    Raises
    ------
    Problem
        If it is no property of a datablock.
    """
    if not isinstance(owner, bpy.types.ID):
        raise Problem(f"property '{path}': is a setting of Blender, not of this file, so a fit can't change it")
    if not owner.is_embedded_data:
        return owner, path
    for one in (*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights):
        if one.node_tree == owner:
            return one, f"node_tree.{path}"
    raise Problem(f"property '{path}': belongs to '{owner.name}', which a fit can't change")


def find(text: str) -> list[Place]:
    """Return the places of a property by its whole path: one, or one for each number of an array.

    Raises
    ------
    Problem
        If there is no such property, or if it has no float values; the message says what the path should be like.
    """
    match = START.match(text.strip())
    if match is None:
        raise Problem(f"property '{text}': must be a datablock and a path in it, such as '{EXAMPLE}'; 'Copy Full Data "
                      "Path' in the menu of Blender's button gives it")  # fmt: skip
    held = getattr(bpy.data, match["collection"], None)
    if not isinstance(held, bpy.types.bpy_prop_collection):
        raise Problem(f"property '{text}': Blender has no data '{match['collection']}'; write it like '{EXAMPLE}'")
    name = bpy.utils.unescape_identifier(match["name"])
    owner = held.get(name)
    if owner is None:
        known = ", ".join(f"'{one.name}'" for one in held[:8]) or "none"
        raise Problem(f"property '{text}': there is no '{name}' in {match['collection']} (known: {known})")
    return places(owner, match["rest"].replace("'", '"') if '"' not in match["rest"] else match["rest"], text)


def places(owner: Any, path: str, text: str = "") -> list[Place]:
    """Return the places of the property at a path in a datablock; see `find`."""
    text = text or f"{owner.name}: {path}"
    if not path:
        raise Problem(f"property '{text}': names a whole datablock; add a property, such as '{EXAMPLE}'")
    path, index = _translated(owner, path), -1
    found = resolved(owner, path)
    number = _INDEX.match(path)
    if number is not None and isinstance(found, (float, int, type(None))):
        array = resolved(owner, number["path"])
        if _count(array):
            path, index, found = number["path"], int(number["index"]), array
    if found is None:
        raise Problem(f"property '{text}': Blender finds no property '{path}' in '{owner.name}'")
    count = _count(found)
    if count:
        if index >= count:
            raise Problem(f"property '{text}': has {count} numbers, so its last one is [{count - 1}]")
        sample, out = found[0], [Place(owner, path, k) for k in (range(count) if index < 0 else [index])]
    else:
        sample, out = found, [Place(owner, path)]
    if not isinstance(sample, float):
        kind = type(sample).__name__
        raise Problem(f"property '{text}': is of the kind {kind}, but only decimal numbers can be fitted")
    return out


def resolved(owner: Any, path: str) -> Any:
    """Return what a path in a datablock leads to; None: nothing."""
    try:
        return owner.path_resolve(path)
    except (ValueError, KeyError, IndexError, TypeError):
        return None


def _count(found: Any) -> int:
    """Number of floats in an array; 0: it is none."""
    if isinstance(found, (str, bytes, bpy.types.bpy_struct, bpy.types.bpy_prop_collection)):
        return 0
    try:
        return len(found) if all(isinstance(one, float) for one in found) else 0
    except TypeError:
        return 0


def _translated(owner: Any, path: str) -> str:
    """Translate an input of a geometry nodes modifier to the running version, whose name may be given too."""
    match = _MODIFIER.match(path)
    if match is None:
        return path
    modifier = resolved(owner, match["modifier"])
    group = getattr(modifier, "node_group", None)
    if group is None:
        return path
    key = bpy.utils.unescape_identifier(match["key"])
    inputs = [item for item in group.interface.items_tree if item.item_type == "SOCKET" and item.in_out == "INPUT"]
    named = [item.identifier for item in inputs if key in (item.identifier, item.name)]
    if len(named) != 1:
        return path
    if bpy.app.version >= (5, 2, 0):
        return f"{match['modifier']}.properties.inputs.{named[0]}.value"
    return f'{match["modifier"]}["{named[0]}"]'


def restored(places_: Iterable[Place], values: Iterable[float]) -> None:
    """Write back values that were read, unless they are still there."""
    for place, value in zip(places_, values, strict=True):
        if place.read() != value:
            place.write(float(value))

"""Where the results of a fit go: each is checked before anything is written, and is kept if it can't be written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..animated.data_path import find
from ..animated.parameter import Parameter
from ..animated.refusals import check as check_property
from ..export.materials.material import MaterialReading, SocketPath
from ..problem import Problem
from .held import Held
from .image_pixels import check_image, find_image, write_pixels
from .keys import write_keys
from .new_object import check_object, make_free_object, make_object
from .values import check_light, check_sockets, find_material, write_material, write_power
from .vertices import Topology, check_editable, displacement, write_move

F64 = NDArray[np.float64]
Entry = dict[str, Any]
SOCKETS = ("base_color", "emission_color", "emission_strength")


class Destination(Protocol):
    """The place of one fitted parameter in Blender's data."""

    def check(self) -> None:
        """Raise `Problem` unless the parameter can be written as the data are now."""
        ...

    def write(self, before: Any, after: Any) -> None:
        """Write the value `after`; `before` is that at the beginning of the fit."""
        ...

    def entry(self, before: Any, after: Any) -> Entry:
        """Return what `write_back.kept` needs to write the value later, as JSON has it."""
        ...


@dataclass(frozen=True)
class VerticesOf:
    """The vertices of an object's mesh.

    Attributes
    ----------
    object
        The object.
    topology
        That of its mesh at the beginning.
    matrix
        (4, 4) transform from the space of the object to that of the fitted positions.
    in_place
        Whether the mesh itself changes, instead of a shape key.
    """

    object: Held
    topology: Topology
    matrix: F64
    in_place: bool

    @staticmethod
    def of(ob: Any, matrix: F64, in_place: bool) -> VerticesOf:
        """Make the destination for a mesh object."""
        if ob.mode == "EDIT":
            ob.update_from_editmode()
        return VerticesOf(Held.of("objects", ob), Topology.of(ob.data), matrix, in_place)

    def check(self) -> None:
        ob = self.object.get()
        check_editable(ob, self.in_place)
        if Topology.of(ob.data) != self.topology:
            raise Problem(f"object '{ob.name}': its mesh has another topology than when the fit began; undo that "
                          "change, then write the result")  # fmt: skip

    def write(self, before: Any, after: Any) -> None:
        write_move(self.object.get(), displacement(self.matrix, before, after), self.in_place)

    def entry(self, before: Any, after: Any) -> Entry:
        return {"vertices": self.object.name_now, "in_place": self.in_place,
                "corners": self.topology.corners,
                "move": np.round(displacement(self.matrix, before, after), 9).tolist()}  # fmt: skip


@dataclass(frozen=True)
class MaterialValue:
    """The base colour or the emission of a material; the emission's unit is `unit`."""

    material: Held
    reading: MaterialReading
    field: str
    unit: float

    def check(self) -> None:
        check_sockets(self.material.get(), self.reading, self.field)

    def write(self, before: Any, after: Any) -> None:
        write_material(self.material.get(), self.reading, self.field, np.asarray(after) / self.unit)

    def entry(self, before: Any, after: Any) -> Entry:
        sockets = {name: None if path is None else [path.node, path.socket] for name, path in (
            (name, getattr(self.reading, name)) for name in SOCKETS)}  # fmt: skip
        return {"material": self.material.name_now, "field": self.field,
                "sockets": sockets, "value": (np.asarray(after) / self.unit).tolist()}  # fmt: skip


@dataclass(frozen=True)
class LightPower:
    """The power of a light object, or the strength of a sun."""

    light: Held
    unit: float

    def check(self) -> None:
        ob = self.light.get()
        check_light(ob, ob.name)

    def write(self, before: Any, after: Any) -> None:
        write_power(self.light.get(), float(after) / self.unit)

    def entry(self, before: Any, after: Any) -> Entry:
        return {"light": self.light.name_now, "value": float(after) / self.unit}


@dataclass(frozen=True)
class PixelsOf:
    """The pixels of an image; `codes`: they are fitted as code values."""

    image: Held
    codes: bool

    def check(self) -> None:
        image = self.image.get()
        check_image(image, image.name_full)

    def write(self, before: Any, after: Any) -> None:
        write_pixels(self.image.get(), np.asarray(after, np.float64), self.codes)

    def entry(self, before: Any, after: Any) -> Entry:
        return {"image": self.image.name_now, "codes": self.codes,
                "pixels": np.round(np.asarray(after, np.float64), 7).tolist()}  # fmt: skip


@dataclass(frozen=True)
class PropertyValue:
    """The numbers of an animatable property."""

    parameter: Parameter

    def check(self) -> None:
        self.parameter.renew()
        for place in self.parameter.places:
            check_property(place)

    def write(self, before: Any, after: Any) -> None:
        self.parameter.write(after)

    def entry(self, before: Any, after: Any) -> Entry:
        return {"properties": self.parameter.names, "values": np.asarray(after).tolist()}


@dataclass(frozen=True)
class StoredEntry:
    """What `Destination.entry` has kept, to be written later by the names in it."""

    entry: Entry

    @property
    def name(self) -> str:
        """What it is the value of, in words."""
        for kind, word in (("vertices", "object"), ("surface", "object"), ("material", "material"), ("light", "light"),
                           ("image", "image")):  # fmt: skip
            if kind in self.entry:
                return f"{word} '{self.entry[kind]}'"
        return f"property '{self.entry['properties'][0]}'"

    def write(self) -> None:
        """Write the value.

        Raises
        ------
        Problem
            If that is still not possible.
        """
        entry = self.entry
        if "vertices" in entry:
            ob = _found(bpy.data.objects.get(entry["vertices"]), self.name)
            check_editable(ob, entry["in_place"])
            if Topology.of(ob.data) != Topology(len(entry["move"]), entry["corners"]):
                raise Problem(f"{self.name}: its mesh has another topology than when the fit began; undo that change")
            write_move(ob, np.array(entry["move"], np.float64).reshape(-1, 3), entry["in_place"])
        elif "surface" in entry:
            points, triangles = np.array(entry["points"], np.float64), np.array(entry["triangles"], np.int32)
            layers = {name: np.array(values, np.float64) for name, values in entry.get("layers", {}).items()}
            ob, material = bpy.data.objects.get(entry["surface"]), entry.get("material")
            if ob is None:
                make_free_object(entry["surface"], points, triangles, layers, material)
            else:
                check_object(ob)
                make_object(ob, points, triangles, layers, material)
        elif "material" in entry:
            material = _found(find_material(entry["material"]), self.name)
            sockets = {name: None if path is None else SocketPath(*path) for name, path in entry["sockets"].items()}
            reading = MaterialReading(
                edgegrad.Material(), base_color=sockets["base_color"], emission_color=sockets["emission_color"],
                emission_strength=sockets["emission_strength"],
            )  # fmt: skip
            check_sockets(material, reading, entry["field"])
            write_material(material, reading, entry["field"], np.array(entry["value"]))
        elif "light" in entry:
            ob = bpy.data.objects.get(entry["light"])
            check_light(ob, entry["light"])
            write_power(ob, entry["value"])
        elif "image" in entry:
            image = find_image(entry["image"])
            check_image(image, entry["image"])
            write_pixels(image, np.array(entry["pixels"], np.float64), entry["codes"])
        else:
            places = [place for name in entry["properties"] for place in find(name)]
            keyed = "frames" in entry
            for place in places:
                check_property(place, may_be_keyed=keyed)
            if keyed:
                write_keys(places, entry["frames"], entry["values"])
                return
            for place, value in zip(places, entry["values"], strict=True):
                place.write(float(value))


def _found(datablock: Any, where: str) -> Any:
    if datablock is None:
        raise Problem(f"{where}: there is none of this name; rename another one so, or remove it from the text")
    return datablock

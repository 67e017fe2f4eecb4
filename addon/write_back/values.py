"""Fitted colours and powers: the sockets and lights that they were read from, and whether these can be written."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..animated import refusals
from ..animated.data_path import Place
from ..export.materials.material import MaterialReading, SocketPath
from ..export.surroundings.lights import power_factor
from ..problem import Problem

F64 = NDArray[np.float64]
LABELS = {"base_color": "base color", "emission": "emission"}


def check_material(reading: MaterialReading, name: str, fieldname: str) -> Any:
    """Raise `Problem` unless this field of the material can be written; return Blender's material."""
    where = f"material '{name}'"
    material = None if reading.material is None else find_material(name)
    if material is None:
        raise Problem(f"{where}: there is no such material to write to")
    label = LABELS[fieldname]
    socket = reading.base_color if fieldname == "base_color" else reading.emission_color
    if socket is None and not (fieldname == "base_color" and material.node_tree is None):
        raise Problem(f"{where}: has no node whose {label} can be written (a Principled, Diffuse or Emission shader "
                      "alone has one); fit the values of its nodes as properties instead")  # fmt: skip
    if fieldname in reading.fed:
        raise Problem(f"{where}: its {label} is fed by node '{reading.fed[fieldname]}', so it can't be written; "
                      "unlink it first")  # fmt: skip
    if fieldname in reading.value.textures:
        raise Problem(f"{where}: its {label} is scaled by subsurface scattering, which depends on the view, or is "
                      "above 1, so it can't be written; set subsurface to 0 or the color lower")  # fmt: skip
    check_sockets(material, reading, fieldname)
    return material


def find_material(name: str) -> Any:
    """Return the material of this full name, which has its library; None: there is none."""
    return next((material for material in bpy.data.materials if material.name_full == name), None)


def check_sockets(material: Any, reading: MaterialReading, fieldname: str) -> None:
    """Raise `Problem` unless the sockets of this field are still there and a fit can set them."""
    where = f"material '{material.name}'"
    refusals.check_own(where, material)
    for path in _sockets(reading, fieldname):
        socket = found_socket(material, path)
        if socket is None:
            raise Problem(f"{where}: its node '{path.node}' has no socket '{path.socket}' any more")
        if socket.is_linked:
            raise Problem(f"{where}: its {LABELS[fieldname]} is fed by another node now; unlink it first")
        refusals.check(Place(material, f"node_tree.{socket.path_from_id('default_value')}"))
    if fieldname == "base_color" and reading.base_color is None:
        refusals.check(Place(material, "diffuse_color"))


def _sockets(reading: MaterialReading, fieldname: str) -> list[SocketPath]:
    paths = [reading.base_color] if fieldname == "base_color" else [reading.emission_color, reading.emission_strength]
    return [path for path in paths if path is not None]


def found_socket(material: Any, path: SocketPath) -> Any:
    """Return a socket of the material; None: there is none, or no node."""
    node = None if material.node_tree is None else material.node_tree.nodes.get(path.node)
    return None if node is None else node.inputs.get(path.socket)


def write_material(material: Any, reading: MaterialReading, fieldname: str, value: F64) -> None:
    """Write a base colour or an emission into the sockets that it was read from."""
    if fieldname == "base_color":
        if reading.base_color is None:
            material.diffuse_color[:3] = value
        else:
            reading.base_color.find(material).default_value[:3] = value
        return
    assert reading.emission_color is not None and reading.emission_strength is not None
    strength = reading.emission_strength.find(material)
    if not strength.default_value > 0.0:
        strength.default_value = 1.0
    reading.emission_color.find(material).default_value[:3] = value / strength.default_value


def check_light(ob: Any, name: str) -> None:
    """Raise `Problem` unless the power of the light object can be written; `name` is what the user calls it."""
    if ob is None:
        raise Problem(f"light '{name}': there is no such light")
    where = f"light '{ob.name}'"
    if ob.type != "LIGHT":
        raise Problem(f"{where}: there is no such light; the object of this name is a {ob.type.lower()}")
    refusals.check_own(where, ob.data)
    sharing = [other.name for other in bpy.data.objects if other.data is ob.data and other != ob]
    if sharing:
        raise Problem(f"{where}: is shared with object '{sharing[0]}', which would change too; make it single-user "
                      "first")  # fmt: skip
    if not getattr(ob.data, "normalize", True):
        raise Problem(f"{where}: its power can't be fitted while its 'Normalize' option is off; switch it on")
    refusals.check(Place(ob.data, "energy"))


def write_power(ob: Any, value: float) -> None:
    """Write a fitted power, or the strength of a sun, into a light object."""
    ob.data.energy = value / power_factor(ob.data)

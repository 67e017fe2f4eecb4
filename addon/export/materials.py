"""Base colour and emission from Principled, Diffuse and Emission nodes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..problem import Report
from . import nodes

# Cycles' colour of faces without a material.
DEFAULT_COLOR = 0.8
# Sockets of the Principled node with the value at which the node is a diffuse surface.
NOT_DIFFUSE = {
    "Metallic": 0.0,
    "Specular IOR Level": 0.0,
    "Transmission Weight": 0.0,
    "Subsurface Weight": 0.0,
    "Coat Weight": 0.0,
    "Sheen Weight": 0.0,
    "Thin Film Thickness": 0.0,
    "Diffuse Roughness": 0.0,
    "Alpha": 1.0,
}


@dataclass
class SocketPath:
    """An input of a node, by names, as references to nodes don't survive an undo."""

    node: str
    socket: str

    def find(self, material: Any) -> Any:
        """The socket in the material's node tree."""
        return material.node_tree.nodes[self.node].inputs[self.socket]


@dataclass
class MaterialReading:
    """A material as it was read, and the sockets that its values came from.

    Attributes
    ----------
    value
        What is rendered.
    material
        Name of Blender's material; None for faces without one.
    base_color, emission_color, emission_strength
        Sockets to write to; None: the material has no such socket.
    fed
        Sockets' names -> the node that feeds them and can't be read.
    """

    value: edgegrad.Material
    material: str | None = None
    base_color: SocketPath | None = None
    emission_color: SocketPath | None = None
    emission_strength: SocketPath | None = None
    fed: dict[str, str] = field(default_factory=dict)


def read_material(material: Any, report: Report) -> MaterialReading:
    """What this version can render of a material; a warning for each node that can't be read.

    Parameters
    ----------
    material
        Blender's material (original), or None for faces without one.
    """
    if material is None:
        return MaterialReading(edgegrad.Material(np.full(3, DEFAULT_COLOR)))
    tree = material.node_tree
    # From 5.0 on materials always have nodes, and asking for `use_nodes` is deprecated.
    if tree is None or (bpy.app.version < (5, 0, 0) and not material.use_nodes):
        return MaterialReading(edgegrad.Material(_reflectance(material.diffuse_color[:3], f"material '{material.name}'",
                                                              report)), material.name)  # fmt: skip
    reading = MaterialReading(edgegrad.Material(np.zeros(3)), material.name)
    where = f"material '{material.name}'"
    output = tree.get_output_node("CYCLES")
    if output is None:
        report.warn(where, "has no active output; it is rendered black")
        return reading
    for name in ("Volume", "Displacement"):
        if name in output.inputs and nodes.source(output.inputs[name]) is not None:
            report.warn(where, f"what is linked to '{name}' of its output is ignored")
    _read_shader(nodes.source(output.inputs["Surface"]), reading, where, report)
    return reading


def _read_shader(fed_by: Any, reading: MaterialReading, where: str, report: Report) -> None:
    """Add what one shader node contributes."""
    if fed_by is None:
        return
    node = fed_by.node
    at = f"{where}, node '{node.name}'"
    if node.type == "BSDF_PRINCIPLED":
        _read_principled(node, reading, at, report)
    elif node.type == "BSDF_DIFFUSE":
        if node.inputs["Roughness"].default_value > 0.0:
            report.warn(at, "its roughness is ignored")
        _add_base_color(node, "Color", reading, at, report)
    elif node.type == "EMISSION":
        _add_emission(node, "Color", "Strength", reading, at, report)
    elif node.type == "ADD_SHADER":
        for socket in node.inputs:
            _read_shader(nodes.source(socket), reading, where, report)
    elif node.type == "MIX_SHADER":
        shaders = [s for s in (nodes.source(node.inputs[1]), nodes.source(node.inputs[2])) if s is not None]
        used = f"node '{shaders[0].node.name}' alone is used" if shaders else "it is rendered black"
        report.warn(at, f"a mix of shaders can't be read; {used}")
        _read_shader(shaders[0] if shaders else None, reading, where, report)
    else:
        report.warn(at, f"nodes of type '{node.bl_label or node.type}' can't be read; it is rendered black")


def _read_principled(node: Any, reading: MaterialReading, at: str, report: Report) -> None:
    ignored = [name for name, plain in NOT_DIFFUSE.items() if name in node.inputs
               and (node.inputs[name].is_linked or not np.isclose(node.inputs[name].default_value, plain))]  # fmt: skip
    if ignored:
        report.warn(at, f"{', '.join(ignored)}: ignored in this version; it is rendered as a diffuse surface")
    if "Normal" in node.inputs and nodes.source(node.inputs["Normal"]) is not None:
        report.warn(at, "what is linked to 'Normal' is ignored")
    _add_base_color(node, "Base Color", reading, at, report)
    _add_emission(node, "Emission Color", "Emission Strength", reading, at, report)


def _add_base_color(node: Any, name: str, reading: MaterialReading, at: str, report: Report) -> None:
    socket = node.inputs[name]
    if reading.base_color is not None:
        report.warn(at, "a second surface shader can't be added; it is ignored")
        return
    reading.base_color = SocketPath(node.name, name)
    reading.value.base_color = _reflectance(nodes.color(socket, at, report), at, report)
    _note_feed(reading, "base_color", socket)


def _add_emission(node: Any, color_name: str, strength_name: str, reading: MaterialReading, at: str,
                  report: Report) -> None:  # fmt: skip
    color, strength = node.inputs[color_name], node.inputs[strength_name]
    emission = nodes.color(color, at, report) * nodes.number(strength, at, report)
    if reading.emission_color is not None:
        if not np.any(emission != 0.0):
            return
        if np.any(reading.value.emission > 0.0):
            report.warn(at, "a second emission can't be added; it is ignored")
            return
    reading.emission_color = SocketPath(node.name, color_name)
    reading.emission_strength = SocketPath(node.name, strength_name)
    if emission.min() < 0.0:
        report.warn(at, "negative emission is treated as zero")
    reading.value.emission = np.maximum(emission, 0.0)
    _note_feed(reading, "emission", color)
    _note_feed(reading, "emission", strength)


def _note_feed(reading: MaterialReading, fieldname: str, socket: Any) -> None:
    fed_by = nodes.source(socket)
    if fed_by is not None:
        reading.fed[fieldname] = fed_by.node.name


def _reflectance(color: Any, at: str, report: Report) -> NDArray[np.float64]:
    value = np.array(color, np.float64)
    if value.min() < 0.0 or value.max() > 1.0:
        report.warn(at, "its base colour is clipped to the range 0 to 1")
    return np.clip(value, 0.0, 1.0)

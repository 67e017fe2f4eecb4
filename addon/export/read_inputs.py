"""Translation of nodes that describe the hit point: coordinates, attributes, object and ray."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from edgegrad import expression as e
from edgegrad.expression import Operand

from . import attributes
from .expressions import Reader, Unreadable, reads
from .nodes import Groups, label

Rows = tuple[tuple[float, float, float, float], ...]


def rows(matrix: Any) -> Any:
    """Convert the first three rows of a matrix to the form of `edgegrad.expression.Transform`."""
    return tuple(tuple(float(c) for c in row) for row in np.asarray(matrix, np.float64)[:3])


def unreadable(node: Any, groups: Groups, what: str) -> Unreadable:
    """Make the error for a part of a node that no expression can represent."""
    return Unreadable(f"node '{label(node, groups)}' ({what})")


@reads("VALUE", "RGB")
def _own_output(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    value = node.outputs[0].default_value
    return float(value) if node.type == "VALUE" else tuple(float(c) for c in value)


@reads("UVMAP")
def _uv_map(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return attributes.layer(node.uv_map or attributes.ACTIVE_UV)


@reads("TEX_COORD")
def _texture_coordinate(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if node.from_instancer and output.identifier in ("Generated", "UV"):
        reader.note(f"node '{label(node, groups)}' uses the coordinates of the object, not of its instancer")
    name = output.identifier
    if name == "Generated":
        return attributes.layer(attributes.GENERATED)
    if name == "UV":
        return attributes.layer(attributes.ACTIVE_UV)
    if name == "Normal":
        return e.VectorMath("NORMALIZE", attributes.layer(attributes.OBJECT_NORMAL))
    if name == "Object":
        if node.object is None:
            return attributes.layer(attributes.OBJECT)
        inverse = np.linalg.pinv(np.array(node.object.matrix_world, np.float64))
        return e.Transform(e.Coordinates("POSITION"), rows(inverse))
    if name == "Reflection":
        return e.Coordinates("REFLECTION")
    if name == "Camera" and reader.world_to_camera is not None:
        return e.Transform(e.Coordinates("POSITION"), rows(reader.world_to_camera))
    raise unreadable(node, groups, name)


@reads("NEW_GEOMETRY")
def _geometry(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    known = {"Position": "POSITION", "Normal": "NORMAL", "True Normal": "TRUE_NORMAL", "Incoming": "INCOMING"}
    if output.identifier in known:
        return e.Coordinates(known[output.identifier])
    if output.identifier == "Backfacing":
        return e.Backfacing()
    raise unreadable(node, groups, output.identifier)


@reads("ATTRIBUTE")
def _attribute(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if node.attribute_type == "VIEW_LAYER":
        raise unreadable(node, groups, "attribute of the view layer")
    of_object = node.attribute_type in ("OBJECT", "INSTANCER")
    value = attributes.layer(attributes.PROPERTY + node.attribute_name if of_object else node.attribute_name)
    if output.identifier == "Fac":
        return e.Average(value)
    return e.Channel(value, 3) if output.identifier == "Alpha" else value


@reads("VERTEX_COLOR")
def _color_attribute(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    value = attributes.layer(node.layer_name or attributes.ACTIVE_COLOR)
    return e.Channel(value, 3) if output.identifier == "Alpha" else value


@reads("OBJECT_INFO")
def _object_info(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    name = output.identifier
    if name == "Material Index":
        return float(reader.material_index)
    if name == "Alpha":
        return e.Channel(attributes.layer(attributes.COLOR), 3)
    known = {"Location": attributes.LOCATION, "Color": attributes.COLOR, "Object Index": attributes.INDEX,
             "Random": attributes.RANDOM}  # fmt: skip
    return attributes.layer(known[name])


@reads("LIGHT_PATH")
def _light_path(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    known = {"Is Camera Ray": "CAMERA", "Is Shadow Ray": "SHADOW", "Is Diffuse Ray": "DIFFUSE",
             "Is Glossy Ray": "GLOSSY", "Is Transmission Ray": "TRANSMISSION"}  # fmt: skip
    name = output.identifier
    if name in known:
        return e.LightPath(known[name])
    if name == "Is Reflection Ray":
        return e.Math("ADD", e.LightPath("DIFFUSE"), e.LightPath("GLOSSY"))
    if name == "Ray Depth":
        reader.note(f"'{name}' of node '{label(node, groups)}' is 0 for camera rays and 1 for all other rays")
        return e.Math("SUBTRACT", 1.0, e.LightPath("CAMERA"))
    reader.note(f"'{name}' of node '{label(node, groups)}' is replaced by 0")
    return 0.0


@reads("FRESNEL")
def _fresnel(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return e.Fresnel(reader.get(node, "IOR", groups), _normal(reader, node, groups))


@reads("LAYER_WEIGHT")
def _layer_weight(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    blend = reader.get(node, "Blend", groups)
    return e.LayerWeight(output.identifier.upper(), blend, _normal(reader, node, groups))


def _normal(reader: Reader, node: Any, groups: Groups) -> Operand | None:
    try:
        found: Operand | None = reader.get_or(node, "Normal", groups, None)
        return found
    except Unreadable as error:
        reader.note(f"node '{label(node, groups)}' uses the smooth normal, since {error} can't be read")
        return None


@reads("BLACKBODY")
def _blackbody(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    temperature = reader.get(node, "Temperature", groups)
    if isinstance(temperature, e.Expression) or bpy.app.version < (4, 5, 0):
        raise unreadable(node, groups, node.bl_label)
    # Blender converts a temperature to a colour only as a property of a light.
    light = bpy.data.lights.new("Edgegrad temperature", "POINT")
    try:
        light.temperature = float(temperature[0] if isinstance(temperature, tuple) else temperature)
        return (*(float(c) for c in light.temperature_color), 1.0)
    finally:
        bpy.data.lights.remove(light)

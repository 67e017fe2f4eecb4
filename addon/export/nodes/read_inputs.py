"""Translation of nodes that describe the hit point: coordinates, attributes, object and ray."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from edgegrad import expression as e
from edgegrad.expression import Operand

from ..approximated.sizes import unevenly_scaled
from ..geometry import attributes
from .expressions import Reader, Unreadable, folded, number, reads
from .links import Groups, label
from .read_tangents import tangent_around


def rows(matrix: Any) -> Any:
    """Convert the first three rows of a matrix to the form of `edgegrad.expression.Transform`."""
    return tuple(tuple(float(c) for c in row) for row in np.asarray(matrix, np.float64)[:3])


def unreadable(node: Any, groups: Groups, what: str, bakeable: bool = True) -> Unreadable:
    """Make the error for a part of a node that no expression can represent."""
    return Unreadable(f"node '{label(node, groups)}' ({what})", bakeable)


@reads("VALUE", "RGB")
def _own_output(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    value = node.outputs[0].default_value
    return float(value) if node.type == "VALUE" else tuple(float(c) for c in value)


@reads("UVMAP")
def _uv_map(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return attributes.layer(attributes.INSTANCER_UV if node.from_instancer else node.uv_map or attributes.ACTIVE_UV)


def object_normal() -> Operand:
    """Smooth normal in the object's space, a unit vector on the viewer's side, as all normals of Cycles."""
    front = e.Math("MULTIPLY_ADD", e.Backfacing(), -2.0, 1.0)
    return e.VectorMath("SCALE", e.VectorMath("NORMALIZE", attributes.layer(attributes.OBJECT_NORMAL)), scale=front)


@reads("TEX_COORD")
def _texture_coordinate(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    name = output.identifier
    if name == "Generated":
        return attributes.layer(attributes.INSTANCER_GENERATED if node.from_instancer else attributes.GENERATED)
    if name == "UV":
        return attributes.layer(attributes.INSTANCER_UV if node.from_instancer else attributes.ACTIVE_UV)
    if name == "Normal":
        return object_normal()
    if name == "Object":
        if node.object is None:
            return attributes.layer(attributes.OBJECT)
        inverse = np.linalg.pinv(np.array(node.object.matrix_world, np.float64))
        return e.Transform(e.Coordinates("POSITION"), rows(inverse))
    if name == "Reflection":
        return e.Coordinates("REFLECTION")
    if name == "Camera" and reader.view is not None:
        return e.Transform(e.Coordinates("POSITION"), rows(reader.view.world_to_camera))
    if name == "Window" and reader.view is not None and reader.view.window is not None:
        return reader.view.window
    raise unreadable(node, groups, name, bakeable=False)  # a bake has no camera


@reads("NEW_GEOMETRY")
def _geometry(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    known = {"Position": "POSITION", "Normal": "NORMAL", "True Normal": "TRUE_NORMAL", "Incoming": "INCOMING"}
    if output.identifier in known:
        return e.Coordinates(known[output.identifier])
    if output.identifier == "Backfacing":
        return e.Backfacing()
    if output.identifier == "Pointiness":
        return attributes.layer(attributes.POINTINESS)
    if output.identifier == "Random Per Island":
        return attributes.layer(attributes.ISLAND)
    if output.identifier == "Parametric":
        return attributes.layer(attributes.PARAMETRIC)
    if output.identifier == "Tangent":
        return tangent_around("Z")
    raise unreadable(node, groups, output.identifier)


@reads("ATTRIBUTE")
def _attribute(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if node.attribute_type == "VIEW_LAYER":
        if reader.view is None:
            raise unreadable(node, groups, "attribute of the view layer", bakeable=False)
        return _of_layer(reader.view.of_layer(node.attribute_name) or (0.0, 0.0, 0.0, 0.0), output)
    kind = {"OBJECT": attributes.PROPERTY, "INSTANCER": attributes.INSTANCER}.get(node.attribute_type)
    value = _layer(reader, node, groups, node.attribute_name) if kind is None else attributes.layer(
        kind + node.attribute_name)  # fmt: skip
    if output.identifier == "Fac":
        if kind is None and isinstance(value, e.Attribute):
            # Of two components, as of a UV map, Cycles takes the first.
            count = attributes.layer(attributes.COMPONENTS + value.name)
            return e.Mix(e.Math("COMPARE", count, 2.0, 0.5), e.Average(value), e.Channel(value, 0))
        return e.Average(value)
    if output.identifier == "Alpha":
        # What a mesh does not have is black, but opaque.
        return attributes.layer(attributes.ALPHA + value.name) if isinstance(value, e.Attribute) else 1.0
    return value


# Names that Cycles keeps for attributes of its own, which hide those that meshes have by these names.
RESERVED = {"uv": attributes.ACTIVE_UV, "generated": attributes.GENERATED, "pointiness": attributes.POINTINESS,
            "random_per_island": attributes.ISLAND, "curve_intercept": attributes.INTERCEPT,
            "curve_length": attributes.LENGTH, "curve_random": attributes.RANDOM_STRAND,
            "point_random": attributes.RANDOM_POINT}  # fmt: skip
ABSENT = frozenset((
    "vertex_color", "undeformed", "undisplaced", "motion_P", "motion_N", "particle", "ptex_face_id", "ptex_uv",
    "density", "color", "flame", "heat", "temperature", "velocity", "velocity_x", "velocity_y", "velocity_z",
    "shadow_transparency",
))  # fmt: skip
UNREAD = frozenset(("N", "generated_transform", "tangent", "tangent_sign"))


def _layer(reader: Reader, node: Any, groups: Groups, name: str) -> Operand:
    """Return the attribute that Cycles finds by a name."""
    if name in UNREAD:
        reader.note(f"node '{label(node, groups)}' reads 0; '{name}' is the name of an attribute of Cycles' own")
    elif name in ABSENT:
        return _hidden(reader, node, groups, name)
    else:
        return attributes.layer(RESERVED.get(name, name))
    return (0.0, 0.0, 0.0, 0.0)


def _hidden(reader: Reader, node: Any, groups: Groups, name: str) -> Operand:
    reader.note(f"node '{label(node, groups)}' reads 0, as in Cycles, which keeps the name '{name}' for an attribute "
                "of its own; rename the attribute")  # fmt: skip
    return (0.0, 0.0, 0.0, 0.0)


def _of_layer(values: tuple[float, ...], output: Any) -> Operand:
    """Return an output of an Attribute node for one to four numbers; a single one is a grey."""
    color = (*values, 0.0)[:3] if len(values) > 1 else values * 3
    if output.identifier == "Fac":
        return sum(color) / 3.0
    return (values[3] if len(values) > 3 else 1.0) if output.identifier == "Alpha" else color


@reads("VERTEX_COLOR")
def _color_attribute(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    name = node.layer_name
    hidden = name in (*RESERVED, *ABSENT, *UNREAD)
    value = _hidden(reader, node, groups, name) if hidden else attributes.layer(name or attributes.ACTIVE_COLOR)
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


@reads("PARTICLE_INFO")
def _particle_info(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return attributes.layer(attributes.PARTICLE + output.identifier)


@reads("HAIR_INFO")
def _hair_info(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    known = {"Is Strand": attributes.IS_STRAND, "Intercept": attributes.INTERCEPT, "Length": attributes.LENGTH,
             "Thickness": attributes.THICKNESS, "Random": attributes.RANDOM_STRAND}  # fmt: skip
    if output.identifier not in known:
        raise unreadable(node, groups, output.identifier)
    return attributes.layer(known[output.identifier])


@reads("POINT_INFO")
def _point_info(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    known = {"Radius": attributes.POINT_RADIUS, "Random": attributes.RANDOM_POINT}
    if output.identifier not in known:
        raise unreadable(node, groups, output.identifier)
    return attributes.layer(known[output.identifier])


# Outputs of Light Path that are a kind of ray.
RAY_KINDS = {"Is Camera Ray": "CAMERA", "Is Shadow Ray": "SHADOW", "Is Diffuse Ray": "DIFFUSE",
             "Is Glossy Ray": "GLOSSY", "Is Transmission Ray": "TRANSMISSION"}  # fmt: skip
# Outputs that count bounces.
RAY_COUNTS = {"Ray Depth": "ALL", "Diffuse Depth": "DIFFUSE", "Glossy Depth": "GLOSSY",
              "Transmission Depth": "TRANSMISSION", "Transparent Depth": "TRANSPARENT"}  # fmt: skip


@reads("LIGHT_PATH")
def _light_path(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    name = output.identifier
    what = f"'{name}' of node '{label(node, groups)}'"
    if name in RAY_KINDS:
        return e.LightPath(RAY_KINDS[name])
    if name == "Is Reflection Ray":
        return e.Math("ADD", e.LightPath("DIFFUSE"), e.LightPath("GLOSSY"))
    if name in RAY_COUNTS:
        return e.RayBounces(RAY_COUNTS[name])
    if name == "Ray Length":
        if reader.view is None:
            return e.RayLength()
        # Cycles measures camera rays from the near plane.
        start = e.Math("MULTIPLY", e.LightPath("CAMERA"), reader.view.ray_start)
        return e.Math("SUBTRACT", e.RayLength(), start)
    if name not in ("Is Volume Scatter Ray", "Portal Depth"):  # without volumes and portals, these are 0 in Cycles too
        reader.note(f"{what} is replaced by 0")
    return 0.0


@reads("VOLUME_INFO")
def _of_no_mesh(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    """Return what the node gives on a mesh, which has no voxels."""
    return (0.0, 0.0, 0.0) if output.type in ("VECTOR", "RGBA") else 0.0


@reads("SCRIPT")
def _script(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    raise unreadable(node, groups, "a script in Open Shading Language", bakeable=False)


@reads("WIREFRAME")
def _wireframe(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    width = reader.get(node, "Size", groups)
    if node.use_pixel_size:
        if reader.view is None:
            raise unreadable(node, groups, "its size in pixels", bakeable=False)
        width = e.Math("MULTIPLY", width, _seen_pixel_size(reader.view.pixel_size))
        reader.note(f"lines of node '{label(node, groups)}' are in reflections as wide as their distance from the "
                    "camera makes them, in Cycles as the length of the path does")  # fmt: skip
    if name := unevenly_scaled(reader.owner):
        reader.note(f"lines of node '{label(node, groups)}' on object '{name}', whose scale differs between axes, have "
                    "the width of its mean scale in all directions")  # fmt: skip
    distances = attributes.layer(attributes.EDGE_DISTANCES)
    nearest = e.Math("MINIMUM", e.Math("MINIMUM", e.Channel(distances, 0), e.Channel(distances, 1)),
                     e.Channel(distances, 2))  # fmt: skip
    nearest = e.Math("MULTIPLY", nearest, attributes.layer(attributes.SCALE))
    # The other half of a line is on the neighbouring triangle. Strands and points, and what is no surface, have no
    # distances, whose fourth component is then 0, and no lines.
    line = e.Math("LESS_THAN", nearest, e.Math("MULTIPLY", width, 0.5))
    return e.Math("MULTIPLY", line, e.Channel(distances, 3))


def _seen_pixel_size(size: Operand) -> Operand:
    """Mean extent, across the view, of two vectors of this size along the face: how Cycles measures a pixel there."""
    normal, view = e.Coordinates("TRUE_NORMAL"), e.Coordinates("INCOMING")
    # Cycles' frame of a face: the first vector is across (1, 1, 1), or across (-1, 1, 1) where that is the normal.
    across = e.VectorMath("CROSS_PRODUCT", (1.0, 1.0, 1.0), normal)
    tilted = e.VectorMath("CROSS_PRODUCT", (-1.0, 1.0, 1.0), normal)
    other = e.Math("LESS_THAN", e.VectorMath("LENGTH", across), 1e-6)
    first = e.VectorMath("NORMALIZE", e.Mix(other, across, tilted))
    second = e.VectorMath("CROSS_PRODUCT", normal, first)

    def extent(vector: Operand) -> Operand:
        along = e.VectorMath("DOT_PRODUCT", vector, view)
        return e.Math("SQRT", e.Math("SUBTRACT", 1.0, e.Math("MULTIPLY", along, along)))

    return e.Math("MULTIPLY", e.Math("ADD", extent(first), extent(second)), e.Math("MULTIPLY", size, 0.5))


@reads("CAMERA")
def _camera_data(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if reader.view is None:
        raise unreadable(node, groups, output.identifier, bakeable=False)
    place = e.AtHitPoint(e.Transform(e.Coordinates("POSITION"), rows(reader.view.world_to_camera)))
    if output.identifier == "View Distance":
        return e.VectorMath("LENGTH", place)
    return e.Channel(place, 2) if output.identifier == "View Z Depth" else e.VectorMath("NORMALIZE", place)


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


COOLEST, HOTTEST = 800.0, 12000.0  # kelvin; Blackbody is constant outside
BLACKBODY_TABLE = 1024


@reads("BLACKBODY")
def _blackbody(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if bpy.app.version < (4, 5, 0):
        raise unreadable(node, groups, node.bl_label)
    temperature = folded(reader.get(node, "Temperature", groups))
    fixed = number(temperature)
    if fixed is not None:
        return _blackbody_colors([fixed])[0]
    table = _blackbody_colors(np.linspace(COOLEST, HOTTEST, BLACKBODY_TABLE))
    return e.Ramp(e.MapRange(temperature, COOLEST, HOTTEST, 0.0, 1.0), table)


def _blackbody_colors(temperatures: Any) -> Any:
    """Colours of these temperatures; Blender converts a temperature to a colour only as a property of a light."""
    light = bpy.data.lights.new("Edgegrad temperature", "POINT")
    try:
        light.use_temperature = True
        colors = []
        for one in temperatures:
            light.temperature = float(one)
            colors.append((*(float(c) for c in light.temperature_color), 1.0))
        return tuple(colors)
    finally:
        bpy.data.lights.remove(light)

"""Translation of nodes that compute numbers, vectors and colours, and of ramps and curves."""

from __future__ import annotations

from typing import Any

import numpy as np

from edgegrad import expression as e
from edgegrad.expression import Operand

from .expressions import INLINES, Reader, folded, number, reads, rgb
from .links import Groups, is_computed_by_blender
from .object_space import from_object, to_object
from .read_inputs import rows, unreadable

TABLE = 257  # rows of ramps and curves in Cycles


@reads("MATH")
def _math(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    a, b, c = (reader.value(socket, groups) for socket in node.inputs[:3])
    return e.Math(node.operation, a, b, c, node.use_clamp)


@reads("VECT_MATH")
def _vector_math(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if node.operation not in e.VECTOR_OPERATIONS:
        raise unreadable(node, groups, node.operation)
    a, b, c = (reader.value(socket, groups) for socket in node.inputs[:3])
    return e.VectorMath(node.operation, a, b, c, reader.get(node, "Scale", groups))


@reads("VECT_TRANSFORM")
def _vector_transform(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    vector, kind = reader.get(node, "Vector", groups), node.vector_type
    source, target = node.convert_from, node.convert_to
    if source == target:
        return vector
    if reader.view is None:
        raise unreadable(node, groups, node.bl_label, bakeable="CAMERA" not in (source, target))
    camera = np.array(reader.view.world_to_camera, np.float64)
    if kind != "POINT":
        camera[:3, 3] = 0.0
    if source == "OBJECT":
        vector = from_object(vector, kind)
    elif source == "CAMERA":
        vector = e.Transform(vector, rows(np.linalg.inv(camera)))
    if target == "OBJECT":
        vector = to_object(vector, kind)
    elif target == "CAMERA":
        vector = e.Transform(vector, rows(camera))  # the camera's axes are orthonormal: normals turn like vectors
    return e.VectorMath("NORMALIZE", vector) if kind == "NORMAL" else vector


@reads("NORMAL")
def _normal(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    direction = e.VectorMath("NORMALIZE", tuple(float(c) for c in node.outputs["Normal"].default_value))
    if output.identifier == "Normal":
        return direction
    given = e.VectorMath("NORMALIZE", reader.get(node, "Normal", groups))
    return e.VectorMath("DOT_PRODUCT", given, direction)


@reads("MIX")
def _mix(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
    if kind is None:
        raise unreadable(node, groups, node.data_type)
    uniform = kind != "Vector" or node.factor_mode == "UNIFORM"
    factor = reader.get(node, "Factor_Float" if uniform else "Factor_Vector", groups)
    a, b = (reader.get(node, f"{side}_{kind}", groups) for side in "AB")
    if kind == "Color":
        return e.Mix(factor, a, b, node.blend_type, node.clamp_factor, node.clamp_result)
    return e.Mix(factor, a, b, "MIX", node.clamp_factor)


@reads("MIX_RGB")
def _mix_rgb(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    factor, a, b = (reader.value(socket, groups) for socket in node.inputs[:3])
    return e.Mix(factor, a, b, node.blend_type, True, node.use_clamp)


@reads("VALTORGB")
def _ramp(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    ramp = node.color_ramp
    # Blender's ramps in HSL are not a number for colours above 1.
    colors = np.nan_to_num([ramp.evaluate(i / (TABLE - 1)) for i in range(TABLE)], posinf=0.0, neginf=0.0)
    table: Any = tuple(tuple(map(float, row)) for row in colors)
    factor = reader.get(node, "Fac", groups)
    fixed = number(folded(factor))
    if fixed is not None and INLINES and is_computed_by_blender(node, groups):
        color = tuple(map(float, ramp.evaluate(min(max(fixed, 0.0), 1.0))))
        return color[3] if output.identifier == "Alpha" else color
    value = e.Ramp(factor, table, ramp.interpolation != "CONSTANT")
    return e.Channel(value, 3) if output.identifier == "Alpha" else value


@reads("CURVE_RGB", "CURVE_VEC", "CURVE_FLOAT")
def _curves(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    mapping = node.mapping
    mapping.initialize()
    curves = list(mapping.curves)
    ends = [(c.points[0].location[0], c.points[len(c.points) - 1].location[0]) for c in curves]
    low, high = min(a for a, _ in ends), max(b for _, b in ends)
    high = high if high > low else low + 1.0
    places = np.linspace(low, high, TABLE)

    computed = INLINES and is_computed_by_blender(node, groups)

    def row(x: float) -> Any:
        if len(curves) == 1:
            y = mapping.evaluate(curves[0], x)
            if computed and mapping.use_clip:  # Cycles' table goes beyond the limits
                y = min(max(y, mapping.clip_min_y), mapping.clip_max_y)
            return (y,) * 3
        if len(curves) == 4:  # the last curve is applied first, to all channels
            x = mapping.evaluate(curves[3], x)
        return tuple(mapping.evaluate(c, x) for c in curves[:3])

    name = {"CURVE_RGB": "Color", "CURVE_VEC": "Vector", "CURVE_FLOAT": "Value"}[node.type]
    factor = "Factor" if node.type == "CURVE_FLOAT" else "Fac"
    value, mixed = reader.get(node, name, groups), reader.get(node, factor, groups)
    fixed = rgb(folded(value)) if computed else None
    if fixed is not None:
        exact = tuple(row(float(x))[k] for k, x in enumerate(fixed))
        return e.Mix(mixed, value, exact, clamp_factor=False)
    return e.Curves(value, tuple(row(float(x)) for x in places), mixed, low, high,
                    mapping.extend == "EXTRAPOLATED")  # fmt: skip


@reads("MAP_RANGE")
def _map_range(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    vector = node.data_type == "FLOAT_VECTOR"

    def read(name: str) -> Operand:
        return reader.get(node, name.replace(" ", "_") + "_FLOAT3" if vector else name, groups)

    value = reader.get(node, "Vector" if vector else "Value", groups)
    return e.MapRange(value, read("From Min"), read("From Max"), read("To Min"), read("To Max"),
                      node.interpolation_type, read("Steps"), node.clamp, vector)  # fmt: skip


@reads("CLAMP")
def _clamp(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    value, low, high = (reader.get(node, name, groups) for name in ("Value", "Min", "Max"))
    return e.Clamp(value, low, high, node.clamp_type == "RANGE")


@reads("SEPXYZ", "SEPARATE_XYZ", "SEPRGB", "SEPHSV", "SEPARATE_COLOR")
def _separate(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    value = reader.value(node.inputs[0], groups)
    model = node.mode if node.type == "SEPARATE_COLOR" else "HSV" if node.type == "SEPHSV" else "RGB"
    if model != "RGB":
        value = e.ColorModel(value, "RGB", model)
    return e.Channel(value, list(node.outputs).index(output))


@reads("COMBXYZ", "COMBINE_XYZ", "COMBRGB", "COMBHSV", "COMBINE_COLOR")
def _combine(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    x, y, z = (reader.value(socket, groups) for socket in node.inputs[:3])
    value = e.Combine(x, y, z)
    model = node.mode if node.type == "COMBINE_COLOR" else "HSV" if node.type == "COMBHSV" else "RGB"
    return value if model == "RGB" else e.ColorModel(value, model, "RGB")


@reads("HUE_SAT")
def _hue_saturation(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    names = ("Color", "Hue", "Saturation", "Value", "Fac")
    return e.HueSaturation(*(reader.get(node, name, groups) for name in names))


@reads("BRIGHTCONTRAST")
def _bright_contrast(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return e.BrightContrast(*(reader.get(node, name, groups) for name in ("Color", "Bright", "Contrast")))


@reads("GAMMA")
def _gamma(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return e.Gamma(reader.get(node, "Color", groups), reader.get(node, "Gamma", groups))


@reads("INVERT")
def _invert(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return e.Invert(reader.get(node, "Color", groups), reader.get(node, "Fac", groups))


@reads("RGBTOBW")
def _luminance(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return e.Luminance(reader.get(node, "Color", groups))

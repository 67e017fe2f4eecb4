"""Export of Blender's lights. The units below were determined by comparison with Cycles.

With the option 'Normalize' and the power P, an area light of the world-space area A has the radiance P / (pi A), a
point light has the intensity P / (4 pi), and the strength of a sun is its irradiance. Without 'Normalize', an area
light has the radiance P / pi, a point light of the radius r has the intensity P r^2 (P / pi for radius 0), and the disc
of a sun has the radiance P.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e

from ..problem import Report
from .expressions import Reader, Unreadable, folded, number, rgb
from .nodes import Groups, feed, label
from .ray_kinds import SAMPLED, RayReader
from .shaders import Part, parts

Light: TypeAlias = edgegrad.PointLight | edgegrad.SpotLight | edgegrad.SunLight | edgegrad.AreaLight
F64 = NDArray[np.float64]


def power_factor(light: Any) -> float:
    """Factor between `energy` and the emitted power, from the exposure of Blender 4.5 and later."""
    return float(2.0 ** getattr(light, "exposure", 0.0))


def export_light(light_object: Any, matrix: F64, visible: frozenset[str], report: Report) -> Light | None:
    """Export a light; return None, with a warning, if it cannot be rendered.

    Parameters
    ----------
    light_object
        Object of type LIGHT (evaluated).
    matrix
        (4, 4) transform of the object or instance to world space.
    visible
        Kinds of rays that see the light, including the settings of its instancer.
    """
    light = light_object.data
    where = f"light '{light_object.name}'"
    if light.type == "AREA" and getattr(getattr(light, "cycles", None), "is_portal", False):
        report.warn(where, "is a portal, which only guides samples; it is left out")
        return None
    color = np.array(light.color, np.float64)
    if getattr(light, "use_temperature", False):
        color = color * np.array(light.temperature_color, np.float64)
    color = color * _emission(light, where, report)
    power = float(light.energy) * power_factor(light)
    if power < 0.0 or color.min() < 0.0:
        report.warn(where, "negative light can't be rendered; it is left out")
        return None
    out: Light | None
    if light.type == "AREA":
        out = _area_light(light, matrix, where, power, report)
    elif light.type == "SUN":
        out = _sun(light, matrix, power)
    else:
        out = _point_or_spot(light, matrix, where, power, report)
    if out is None:
        return None
    out.color = color
    # The camera never sees sun lights in Cycles.
    out.visible_to = (visible | {"shadow"}) - ({"camera"} if light.type == "SUN" else set())
    cycles = getattr(light, "cycles", None)
    out.casts_shadow = bool(getattr(cycles, "cast_shadow", light.use_shadow))  # a property of Cycles before Blender 4.3
    return out


def _sun(light: Any, matrix: F64, power: float) -> edgegrad.SunLight:
    angle = float(light.angle)
    if not getattr(light, "normalize", True) and angle > 0.0:
        power *= np.pi * np.sin(0.5 * angle) ** 2
    return edgegrad.SunLight(-matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]), power, min(angle, np.pi))


def _point_or_spot(light: Any, matrix: F64, where: str, power: float, report: Report) -> Light:
    radius = float(light.shadow_soft_size)
    if not getattr(light, "normalize", True):
        power *= 4.0 * np.pi * radius**2 if radius > 0.0 else 4.0
    position, sphere = matrix[:3, 3].copy(), not getattr(light, "use_soft_falloff", True)
    if light.type == "POINT":
        return edgegrad.PointLight(position, power, radius, sphere)
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    wide = 0.5 * (scale[0] + scale[1]) / max(scale[2], 1e-20)  # Blender scales the cone with the object
    half = float(np.arctan(wide * np.tan(0.5 * min(light.spot_size, np.pi - 1e-4))))
    if not np.isclose(scale[0], scale[1], rtol=1e-3):
        report.warn(where, "its cone is scaled to an ellipse; a circular cone of the mean width is used")
    elif not np.isclose(wide, 1.0, rtol=1e-3) and light.spot_blend > 0.0:
        report.warn(where, "its cone is scaled; the soft edge of an unscaled cone of the same width is used")
    return edgegrad.SpotLight(position, -matrix[:3, 2] / scale[2], power, 2.0 * half, light.spot_blend, radius, sphere)


def _area_light(light: Any, matrix: F64, where: str, power: float, report: Report) -> edgegrad.AreaLight | None:
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    size = np.array([light.size, light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size])
    size = size * scale[:2]
    if size.min() <= 0.0 or scale[2] <= 0.0:
        report.warn(where, "has no size; it is left out")
        return None
    to_world = matrix.copy()
    to_world[:3, :3] /= scale
    if np.linalg.det(to_world[:3, :3]) < 0.0:
        to_world[:3, 0] *= -1.0  # a mirrored light still shines along its -Z, and its shape is symmetric
    shape = "RECTANGLE" if light.shape in ("SQUARE", "RECTANGLE") else "ELLIPSE"
    if not getattr(light, "normalize", True):  # then energy is per square metre
        power *= float(size.prod()) * (1.0 if shape == "RECTANGLE" else np.pi / 4.0)
    # The largest value in Blender is 180 degrees, rounded to float32.
    spread = min(float(light.spread), float(np.pi))
    return edgegrad.AreaLight(to_world, size, shape, power, spread if spread < np.pi - 1e-6 else float(np.pi))


def _emission(light: Any, where: str, report: Report) -> F64:
    """(3,) factor of the power from the nodes of the light; only constant emission is supported."""
    tree = light.node_tree
    # From 5.1 on, lights always have nodes, and `use_nodes` is deprecated.
    if tree is None or (bpy.app.version < (5, 1, 0) and not light.use_nodes):
        return np.ones(3)
    output = tree.get_output_node("CYCLES")
    if output is None:
        return np.zeros(3)
    reader = _LampReader(None, SAMPLED)
    out = np.zeros(3)
    for part in parts(reader, feed(output.inputs["Surface"])):
        weight = number(part.weight)
        if weight is None:
            report.warn(where, f"its shader node '{label(part.node, part.groups)}' has a weight that varies; it is "
                        "left out")  # fmt: skip
        elif part.node.type in ("EMISSION", "BACKGROUND"):
            color, strength = (_constant(reader, part, name, where, report) for name in ("Color", "Strength"))
            out += weight * color * strength[0]
        else:
            report.warn(where, f"its shader node '{label(part.node, part.groups)}' can't be read; it is left out")
    for text in (*reader.approximations, *reader.notes):
        report.warn(where, text)
    return out


def _constant(reader: Reader, part: Part, name: str, where: str, report: Report) -> F64:
    """(3,) value of an input of an Emission node; 1 if it varies or can't be read."""
    try:
        value = rgb(folded(reader.value(part.node.inputs[name], part.groups)))
    except Unreadable as error:
        report.warn(where, f"its {name.lower()} is 1 in its nodes, since {error} can't be read")
        return np.ones(3)
    if value is None:
        report.warn(where, f"its shader nodes vary with position or direction; its {name.lower()} is 1 in its nodes")
    return np.ones(3) if value is None else value


class _LampReader(RayReader):
    """Translates the nodes of a light; quadratic falloff without smoothing is that of physical lights."""

    def _read(self, output: Any, groups: Groups) -> e.Operand:
        node = output.node
        if node.type == "LIGHT_FALLOFF" and output.identifier == "Quadratic":
            if number(self.get(node, "Smooth", groups)) != 0.0:
                raise Unreadable(f"'Smooth' of node '{label(node, groups)}'")
            return self.get(node, "Strength", groups)
        return super()._read(output, groups)

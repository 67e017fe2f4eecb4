"""Blender's lights in Blender's units, as measured against Cycles.

Measured: an area light's radiance is P / (pi A), A scaled with the object, P not; a point light's intensity
P / (4 pi); a sun's strength is its irradiance. New lights are neither seen by the camera nor cast shadows.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..problem import Report

Light = edgegrad.PointLight | edgegrad.SunLight | edgegrad.AreaLight


def power_factor(light: Any) -> float:
    """What `energy` is multiplied with before it is emitted (the exposure of Blender 4.5 and later)."""
    return float(2.0 ** getattr(light, "exposure", 0.0))


def export_light(light_object: Any, matrix: NDArray[np.float64], report: Report) -> Light | None:
    """The light, or None with a warning if its kind can't be read.

    Parameters
    ----------
    light_object
        Object of type LIGHT (evaluated).
    matrix
        (4, 4) its world transform (that of the instance).
    """
    light = light_object.data
    where = f"light '{light_object.name}'"
    if light.type not in ("POINT", "SUN", "AREA"):
        report.warn(where, f"{light.type.lower()} lights aren't read in this version; it is left out")
        return None
    _warn_about_settings(light_object, where, report)
    color = np.array(light.color, np.float64)
    if getattr(light, "use_temperature", False):
        color = color * np.array(light.temperature_color, np.float64)
    power = float(light.energy) * power_factor(light)
    if power < 0.0:
        report.warn(where, "negative light can't be rendered; it is left out")
        return None
    position = matrix[:3, 3].copy()
    if light.type == "POINT":
        return edgegrad.PointLight(position, power, color=color)
    if light.type == "SUN":
        return edgegrad.SunLight(-matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]), power, color=color)
    return _area_light(light, matrix, where, power, color, report)


def _area_light(light: Any, matrix: NDArray[np.float64], where: str, power: float, color: NDArray[np.float64],
                report: Report) -> edgegrad.AreaLight | None:  # fmt: skip
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
    return edgegrad.AreaLight(to_world, size, shape, power, color=color)


def _warn_about_settings(light_object: Any, where: str, report: Report) -> None:
    light = light_object.data
    if light.type == "POINT" and light.shadow_soft_size > 0.0:
        report.warn(where, f"its radius of {light.shadow_soft_size:g} m is treated as zero; shadows are sharp")
    if light.type == "SUN" and light.angle > 0.0:
        report.warn(where, f"its angle of {np.degrees(light.angle):.3g} degrees is treated as zero; shadows are sharp")
    if light.type == "POINT" and not getattr(light, "normalize", True):
        report.warn(where, "its 'Normalize' option is treated as switched on")
    if light.type == "AREA" and light.spread < np.pi - 1e-4:
        report.warn(where, "its spread is ignored; it shines over the whole half space")
    if light.type == "AREA" and light_object.visible_camera:
        report.warn(where, "is visible to the camera in Cycles, but not here")
    if not getattr(light, "use_shadow", True):
        report.warn(where, "casts shadows here, although its shadows are switched off")
    if _has_own_nodes(light):
        report.warn(where, "its shader nodes are ignored; power and colour are used")


def _has_own_nodes(light: Any) -> bool:
    """Whether nodes change the light: anything but the default, a white Emission of strength 1."""
    tree = light.node_tree
    # From 5.1 on lights always have nodes, and asking for `use_nodes` is deprecated.
    if tree is None or (bpy.app.version < (5, 1, 0) and not light.use_nodes):
        return False
    for node in tree.nodes:
        if node.type == "EMISSION":
            color, strength = node.inputs["Color"], node.inputs["Strength"]
            plain = np.allclose(color.default_value[:3], 1.0) and np.isclose(strength.default_value, 1.0)
            if color.is_linked or strength.is_linked or not plain:
                return True
        elif node.type != "OUTPUT_LIGHT":
            return True
    return False

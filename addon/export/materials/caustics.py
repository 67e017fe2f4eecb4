"""Cycles' switches of caustics, as expressions of materials.

With a switch off, Cycles drops the glossy and refracting closures of surfaces that rays from a diffuse closure meet. So
does a material whose closures are black for these rays.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Operand

from ...problem import Report
from ..surroundings.settings import RenderSettings
from .shaders import product

FROM_DIFFUSE = e.LightPath("DIFFUSE")
OTHERS = e.Math("SUBTRACT", 1.0, FROM_DIFFUSE)


def drop_caustics(scene: edgegrad.Scene, settings: RenderSettings, report: Report) -> None:
    """Apply the switches to all materials of an exported scene."""
    if settings.reflective_caustics and settings.refractive_caustics:
        return
    # What was read stays as it is.
    materials = {name: replace(material) for name, material in scene.materials.items()}
    scene.materials = materials
    for name, material in materials.items():
        if isinstance(material, edgegrad.Material) and _drop(material, settings):
            report.warn(f"material '{name}'", "is lit by caustics that are switched off for either reflection or "
                        "refraction alone; both are rendered")  # fmt: skip


def _drop(material: edgegrad.Material, settings: RenderSettings) -> bool:
    """Make closures of a material black for rays from diffuse closures; returns whether a caustic remains."""
    reflects, refracts = settings.reflective_caustics, settings.refractive_caustics
    if (material.kind == "GLOSSY" and not reflects) or (material.kind == "REFRACTION" and not refracts):
        _dim(material, "base_color")
    elif material.kind == "GLASS":
        if not reflects and not refracts:
            _dim(material, "base_color")
        return reflects != refracts
    elif material.kind == "PRINCIPLED":
        transmits = material.transmission > 0.0 or "transmission" in material.textures
        if not reflects:
            # Diffuse light is what metal and glass leave over; nothing covers it.
            left = _left_over(material, "metallic")
            if not refracts:
                left = product(left, _left_over(material, "transmission"))
            tint = _coat_tint(material)
            if left != 1.0 or tint is not None:
                _dim(material, "base_color", left if tint is None else e.VectorMath("MULTIPLY", tint, left))
            for field in ("metallic", "specular_ior_level", "coat_weight"):
                _dim(material, field)
            if transmits and not refracts:
                _dim(material, "transmission")
        return transmits and reflects != refracts
    return False


def _coat_tint(material: edgegrad.Material) -> Operand | None:
    """Factor by which the coat tints what lies below it, which Cycles keeps without the coat; None: 1."""
    weight, tint = _value(material, "coat_weight"), _value(material, "coat_tint")
    constant = not isinstance(tint, e.Expression)
    if (not isinstance(weight, e.Expression) and weight == 0.0) or (constant and np.all(tint == 1.0)):
        return None
    color = tuple(float(c) for c in tint) if constant else tint
    return e.VectorMath("SUBTRACT", 1.0, e.VectorMath("MULTIPLY", weight, e.VectorMath("SUBTRACT", 1.0, color)))


def _left_over(material: edgegrad.Material, field: str) -> Operand:
    value = _value(material, field)
    return e.Math("SUBTRACT", 1.0, value) if isinstance(value, e.Expression) else 1.0 - float(value)


def _value(material: edgegrad.Material, field: str) -> Any:
    return material.textures.get(field, getattr(material, field))


def _dim(material: edgegrad.Material, field: str, left: Operand = 0.0) -> None:
    """Multiply a field by `left` for rays from diffuse closures."""
    value = _value(material, field)
    if not isinstance(value, e.Expression) and not np.any(value):
        return
    if field == "base_color":
        color = value if isinstance(value, e.Expression) else tuple(float(c) for c in value)
        kept = OTHERS if left == 0.0 else e.VectorMath("ADD", OTHERS, e.VectorMath("MULTIPLY", FROM_DIFFUSE, left))
        dimmed: e.Expression = e.VectorMath("MULTIPLY", color, kept)
    else:
        dimmed = e.Math("MULTIPLY", value if isinstance(value, e.Expression) else float(value), OTHERS)
    material.textures = {**material.textures, field: dimmed}

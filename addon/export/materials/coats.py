"""Coats whose normal is not that of the base: Cycles' coat keeps the smooth normal unless its own input is linked.

All layers of Edgegrad's Principled material have one normal. Such a material becomes a sum of two: the base, and a
black one with only the coat. The base is dimmed by what the coat reflects, which depends on the angle to the coat's
normal.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Operand
from edgegrad.scene.material import SMOOTH_NORMAL

from ..nodes.expressions import Reader, Unreadable
from ..nodes.links import by_identifier, feed, label
from .shaders import Closure, Part, product

Layer = tuple[Part, edgegrad.Material]
F64 = NDArray[np.float64]

COSINES = 64  # rows of the table of what a coat reflects
_STEPS = 32  # directions on a microfacet integral's grid, each way
BENT = ("normal", "normal_strength", "normal_space", "normal_uv")


def separate_coat(reader: Reader, part: Part, material: edgegrad.Material) -> list[Layer]:
    """Return the closure of a Principled node, or the layers that replace it if its coat has another normal."""
    if part.node.type != "BSDF_PRINCIPLED" or not _varies_or(material, "coat_weight", 0.0):
        return [(part, material)]
    base, coat = (by_identifier(part.node.inputs, name) for name in ("Normal", "Coat Normal"))
    if coat is None:
        return [(part, material)]
    linked = feed(coat, part.groups)
    if linked.output == feed(base, part.groups).output or (linked.output is None and "normal" not in material.textures):
        return [(part, material)]
    obstacle = _obstacle(material)
    normal: Operand = material.textures.get(SMOOTH_NORMAL, e.Coordinates("NORMAL"))
    if obstacle is None and linked.output is not None:
        try:
            normal = reader.value(coat, part.groups)
        except Unreadable as error:
            obstacle = f"{error} can't be read"
    if obstacle is not None:
        reader.note(f"node '{label(part.node, part.groups)}': its coat uses the normal of the base, while Cycles' has "
                    f"a normal of its own, since {obstacle}")  # fmt: skip
        return [(part, material)]
    return _separated(reader, part, material, normal)


def _varies_or(material: edgegrad.Material, field: str, rest: float) -> bool:
    return field in material.textures or getattr(material, field) != rest


def _obstacle(material: edgegrad.Material) -> str | None:
    """Why the layers cannot be told apart; None if they can."""
    if any(field in material.textures for field in ("coat_roughness", "coat_ior", "coat_tint")):
        return "the coat's roughness, index of refraction or tint varies"
    if not np.all(material.coat_tint == 1.0):
        return "the coat has a tint"
    return "sheen lies above the coat" if _varies_or(material, "sheen_weight", 0.0) else None


def _separated(reader: Reader, part: Part, material: edgegrad.Material, normal: Operand) -> list[Layer]:
    weight: Operand = material.textures.get("coat_weight", material.coat_weight)
    above = {key: value for key, value in material.textures.items() if key in ("coat_weight", SMOOTH_NORMAL)}
    coat = edgegrad.Material(np.zeros(3), kind="PRINCIPLED", coat_weight=material.coat_weight, specular_ior_level=0.0,
                             coat_roughness=material.coat_roughness, coat_ior=material.coat_ior, textures=above)
    Closure(reader, part.node, part.groups, coat).normal("Coat Normal")
    below = replace(material, coat_weight=0.0, alpha=1.0, textures={
        key: value for key, value in material.textures.items() if key not in ("coat_weight", "alpha")})  # fmt: skip
    cosine = e.Math("ABSOLUTE", e.VectorMath("DOT_PRODUCT", e.Coordinates("INCOMING"), normal))
    table = tuple((float(c),) * 3 + (1.0,) for c in reflected(material.coat_roughness, material.coat_ior))
    passed = e.Math("SUBTRACT", 1.0, e.Math("MULTIPLY", e.Average(e.Ramp(cosine, table)), weight))
    alpha: Operand = material.textures.get("alpha", material.alpha)
    out = [(replace(part, weight=product(part.weight, product(alpha, passed))), below),
           (replace(part, weight=product(part.weight, alpha)), coat)]  # fmt: skip
    if alpha != 1.0:
        clear = e.Math("SUBTRACT", 1.0, alpha) if "alpha" in material.textures else 1.0 - material.alpha
        out.append((replace(part, weight=product(part.weight, clear)),
                    edgegrad.Material(np.ones(3), kind="TRANSPARENT")))  # fmt: skip
    return out


def reflected(roughness: float, ior: float) -> F64:
    """(COSINES,) share of the light that a coat of weight 1 reflects, by the cosine between normal and view.

    The integral over GGX's microfacets, with light that is scattered several times, as Cycles adds it.
    """
    alpha = max(min(max(roughness, 0.0), 1.0) ** 2, 1e-4)
    cosines = np.linspace(0.0, 1.0, COSINES)
    fresnel, single = _microfacets(np.maximum(cosines, 1e-3), alpha, max(ior, 1.0))
    # Means over all directions, which count by their cosine.
    mean = np.average(single, weights=cosines)
    whole = np.linspace(0.0, 1.0, 1024)
    reflectance = np.average(_dielectric(whole, max(ior, 1.0)), weights=whole)
    repeated = reflectance * mean / max(1.0 - reflectance * (1.0 - mean), 0.1)
    return np.asarray(np.clip(fresnel / single * (single + repeated * (1.0 - single)), 0.0, 1.0))


def _dielectric(cosine: F64, ior: float) -> F64:
    g = np.sqrt(np.maximum(ior**2 - 1.0 + cosine**2, 0.0))
    a = (g - cosine) / (g + cosine)
    b = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0)
    return np.asarray(0.5 * a**2 * (1.0 + b**2))


def _microfacets(cosines: F64, alpha: float, ior: float) -> tuple[F64, F64]:
    """Albedo of single scattering with and without Fresnel reflectance, by visible normals (Heitz 2018)."""
    grid = (np.arange(_STEPS) + 0.5) / _STEPS
    u, v = (x.ravel() for x in np.meshgrid(grid, grid))
    radius, angle = np.sqrt(u), 2.0 * np.pi * v
    cosine = cosines[:, None]
    view = np.stack([np.sqrt(1.0 - cosines**2), np.zeros_like(cosines), cosines], axis=-1)
    stretched = view * (alpha, alpha, 1.0)
    stretched /= np.linalg.norm(stretched, axis=-1, keepdims=True)
    z = stretched[:, 2:]
    first, second = radius * np.cos(angle), radius * np.sin(angle)
    second = 0.5 * (1.0 - z) * np.sqrt(1.0 - first**2) + 0.5 * (1.0 + z) * second
    third = np.sqrt(np.maximum(1.0 - first**2 - second**2, 0.0))
    # The frame around the stretched view: its first axis is Y, its second lies in the plane of view and normal.
    x = -second * z + third * stretched[:, :1]
    y = np.broadcast_to(first, x.shape)
    height = np.maximum(second * stretched[:, :1] + third * z, 1e-6)
    normal = np.stack([alpha * x, alpha * y, height], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    toward = np.maximum((normal * view[:, None]).sum(axis=-1), 0.0)
    out = 2.0 * toward * normal[..., 2] - cosine

    def smith(c: F64) -> F64:
        tan2 = (1.0 - c**2) / np.maximum(c**2, 1e-12)
        return np.asarray(0.5 * (np.sqrt(1.0 + alpha**2 * tan2) - 1.0))

    both = np.where(out > 0.0, (1.0 + smith(cosine)) / (1.0 + smith(cosine) + smith(np.maximum(out, 1e-6))), 0.0)
    return (both * _dielectric(toward, ior)).mean(axis=1), both.mean(axis=1)

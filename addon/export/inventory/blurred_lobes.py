"""Lobes that Cycles' Filter Glossy widens behind rough glossy bounces, where Edgegrad does not (`Bounces`)."""

from __future__ import annotations

import math
from typing import Any

import edgegrad

from ..surroundings.settings import SEGMENTS_AROUND_BOUNCES

# Cycles makes lobes at most so wide.
WIDEST_ALPHA = 0.5
# Share of the directions of a lobe behind which Cycles widens others, from which on the lobe counts as rough.
WIDENING = 0.1


def name_filter_glossy(blender: Any, out: Any) -> None:
    """Tell that lobes behind rough glossy bounces stay as they are, if Cycles would widen some of them.

    Parameters
    ----------
    blender
        Blender's scene.
    out
        The export.
    """
    limits, depth = out.settings.bounces, out.settings.max_depth
    if limits.filter_glossy == 0.0 or depth <= SEGMENTS_AROUND_BOUNCES:
        return
    closures = [one for name in out.scene.used_materials for one in out.scene.closures(name)]
    rough = any(_exceeds(one, "roughness", _least_rough(limits.filter_glossy))
                for one in closures if _scatters_by_gloss(one, limits))  # fmt: skip
    if rough and any(map(_is_narrow, closures)):
        out.report.tell(f"scene '{blender.name}'", "gloss and glass are blurred behind diffuse bounces only; Cycles "
                        f"blurs them behind rough glossy bounces, too ('Filter Glossy' {limits.filter_glossy:g})")


def _least_rough(setting: float) -> float:
    """Roughness from which on a lobe counts as rough.

    Cycles widens lobes behind directions with a density below the setting. The density of GGX for directions at
    which a fraction u of microfacets leans less is (1 - u)^2 / (4 pi alpha^2), seen from above.
    """
    return float((WIDENING**2 / (4.0 * math.pi * setting)) ** 0.25)


def _scatters_by_gloss(closure: edgegrad.Material, limits: edgegrad.Bounces) -> bool:
    """Whether much of what a closure scatters is a glossy bounce. The gloss over a diffuse base is weak."""
    reflects, refracts = limits.glossy > 0, limits.transmission > 0
    if closure.kind == "PRINCIPLED":
        transmits = _exceeds(closure, "transmission")
        return (reflects and (transmits or _exceeds(closure, "metallic"))) or (refracts and transmits)
    return (reflects and closure.kind in ("GLOSSY", "GLASS")) or (refracts and closure.kind in ("REFRACTION", "GLASS"))


def _is_narrow(closure: edgegrad.Material) -> bool:
    """Whether a closure has a lobe that can be widened."""
    found = ["roughness"] if closure.kind in ("GLOSSY", "GLASS", "REFRACTION") else []
    if closure.kind == "PRINCIPLED":
        weights = ("metallic", "transmission", "specular_ior_level")
        found += ["roughness"] if any(_exceeds(closure, one) for one in weights) else []
        found += ["coat_roughness"] if _exceeds(closure, "coat_weight") else []
    return any(one in closure.textures or getattr(closure, one) ** 2 < WIDEST_ALPHA for one in found)


def _exceeds(closure: edgegrad.Material, field: str, least: float = 0.0) -> bool:
    """Whether a field is above a value somewhere; textures may be."""
    return field in closure.textures or getattr(closure, field) > least

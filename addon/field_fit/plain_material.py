"""Materials for fields, which have neither UV maps nor attributes: what needs them is replaced by a mean."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import edgegrad
from edgegrad.expression import Attribute, Expression, nodes_of
from edgegrad.tables.mean_color import mean_expression

COLORS = ("base_color", "specular_tint", "coat_tint", "sheen_tint")


def plain_material(scene: edgegrad.Scene, name: str) -> tuple[str, list[str]]:
    """Return the name of a material that a field can have, and what it lacks; add it to the scene if it is new."""
    material = scene.materials[name]
    parts = material.parts if isinstance(material, edgegrad.Mixture) else ()
    lacks: list[str] = []
    plain = {part: _plain(scene, scene.materials[part], lacks) for part in (*parts, name)}
    if not lacks:
        return name, []
    new = {part: f"{part} (as field)" for part in plain}
    for part, made in plain.items():
        if isinstance(made, edgegrad.Mixture):
            made = replace(made, parts=tuple(new[one] for one in made.parts))
        scene.materials = {**scene.materials, new[part]: made}
    return new[name], list(dict.fromkeys(lacks))


def _plain(
    scene: edgegrad.Scene, one: edgegrad.Material | edgegrad.Mixture, lacks: list[str]
) -> edgegrad.Material | edgegrad.Mixture:
    if isinstance(one, edgegrad.Mixture):
        kept = {key: value for key, value in one.textures.items() if not _reads_attribute(value)}
        if len(kept) == len(one.textures):
            return one
        lacks.append("its mix by an attribute or a UV map is even")
        return replace(one, textures=kept)
    kept, changed = dict(one.textures), dict[str, Any]()
    for key, value in one.textures.items():
        tangent = key == "normal" and one.normal_space == "TANGENT"
        if not tangent and not _reads_attribute(value):
            continue
        del kept[key]
        if key in ("normal", "smooth_normal"):
            lacks.append("its normal map is left out")
        elif key in COLORS:
            changed[key] = np.clip(mean_expression(scene, value), 0.0, 1.0)
            lacks.append(f"its {key.replace('_', ' ')} is the mean of its texture")
        else:
            lacks.append(f"its {key.replace('_', ' ')} is not that of its texture")
    if one.anisotropy != 0.0 or "anisotropy" in kept:
        kept.pop("anisotropy", None)
        changed["anisotropy"] = 0.0
        lacks.append("its anisotropy is left out")
    return replace(one, textures=kept, **changed) if changed or len(kept) != len(one.textures) else one


def _reads_attribute(value: Expression) -> bool:
    """Whether an expression reads an attribute or a UV map, even one that may be missing: it would be 0 everywhere."""
    return any(isinstance(node, Attribute) for node in nodes_of(value))

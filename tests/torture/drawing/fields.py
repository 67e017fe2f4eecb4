"""Distance fields: ordinary surfaces, and grids, values, boxes and transforms at the ends of their ranges."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import Field, Material, Mixture
from tests.support.fields.splines import points
from tests.torture.drawing.draw import Draw
from tests.torture.drawing.meshes import affine
from tests.torture.drawing.textures import LAYERS

F64 = NDArray[np.float64]
SIZES = (4, 5, 7, 8, 11, 12, 13, 20)
# Of the grids of attributes, and factors of their values.
GRIDS = (1, 2, 2, 3, 5, 30)
FACTORS = (1.0, 1.0, 1.0, 1e-30, 1e6, 1e30)


def _length(p: F64) -> F64:
    return np.asarray(np.linalg.norm(p, axis=-1))


# Values at places in the cube [-1, 1]^3.
SHAPES: dict[str, Callable[[F64], F64]] = {
    "ball": lambda p: _length(p) - 0.6,
    "ball that leaves the grid": lambda p: _length(p) - 1.2,
    "hollow": lambda p: 0.8 - _length(p),
    "ring": lambda p: np.hypot(np.hypot(p[..., 0], p[..., 1]) - 0.55, p[..., 2]) - 0.25,
    "cube": lambda p: np.abs(p).max(axis=-1) - 0.5,
    "two balls": lambda p: np.minimum(_length(p - [0.45, 0.0, 0.0]), _length(p + [0.45, 0.0, 0.0])) - 0.3,
    "plane": lambda p: p[..., 2] + 0.1,
    "plane through the middle": lambda p: p[..., 2],
    "sheets that touch": lambda p: p[..., 2] ** 2,
    "thin sheet": lambda p: np.abs(p[..., 2]) - 0.02,
    "cone": lambda p: np.hypot(p[..., 0], p[..., 1]) - np.abs(p[..., 2]),
    "zero": lambda p: np.zeros(p.shape[:-1]),
    "no surface": lambda p: np.ones(p.shape[:-1]),
    "chequered": lambda p: np.where(np.indices(p.shape[:-1]).sum(axis=0) % 2, 1.0, -1.0),
}  # fmt: skip
# Factors of all values: zeros do not move.
STEEPNESS = (1.0, 1.0, 1.0, 1.0, 1e-30, 1e-6, 1e6, 1e30)


def field(draw: Draw, material: str, scale: float) -> Field:
    """Any field, in a world of the size `scale` about the origin."""
    size = (draw.one(SIZES), draw.one(SIZES), draw.one(SIZES))
    places = points(size)
    values = SHAPES[draw.one(tuple(SHAPES))](places)
    if draw.chance(0.3):
        values = values + draw.one((1e-6, 0.02, 0.3)) * draw.rng.normal(size=size)
    values = values * draw.one(STEEPNESS)
    if draw.chance(0.1):  # one value of another order
        values[tuple(draw.whole(0, n - 1) for n in size)] *= draw.one((-1e6, 1e6, -1.0))
    high = np.array(draw.one(((1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 0.02, 1.0), (5.0, 0.5, 0.5))))
    middle = draw.one((0.0, 0.0, 0.3, -2.0)) * draw.rng.normal(size=3)
    extras: dict[str, Any] = {"transform": affine(draw, scale)} if draw.chance(0.6) else {}
    attributes = {name: _grid(draw, count) for name, count in LAYERS.items() if draw.chance(0.4)}
    return Field(values.astype(np.float32), material, scale * (middle - high), scale * (middle + high),
                 visible_to=draw.rays(0.15), attributes=attributes, **extras)  # fmt: skip


def _grid(draw: Draw, components: int) -> NDArray[np.float32]:
    """Values of an attribute: grids of one value to many, and values far beyond those of colours now and then."""
    size = (draw.one(GRIDS), draw.one(GRIDS), draw.one(GRIDS), components)
    values = draw.rng.uniform(draw.one((0.0, 0.0, -1.0)), 1.0, size) * draw.one(FACTORS)
    return values.astype(np.float32)


def plain_materials(
    materials: Mapping[str, Material | Mixture], name: str, prefix: str
) -> dict[str, Material | Mixture]:
    """Copies of a material, and of its parts, without what fields cannot have; that of `name` is called `prefix`."""
    found = materials[name]
    if isinstance(found, Material):
        textures = {key: value for key, value in found.textures.items()
                    if key not in ("emission", "anisotropy") and not _is_mapped(found, key)}  # fmt: skip
        return {prefix: replace(found, emission=np.zeros(3), anisotropy=0.0, textures=textures)}
    parts = [f"{prefix}.{k}" for k in range(len(found.parts))]
    out: dict[str, Material | Mixture] = {prefix: replace(found, parts=tuple(parts))}
    for part, original in zip(parts, found.parts, strict=True):
        out |= plain_materials(materials, original, part)
    return out


def _is_mapped(material: Material, key: str) -> bool:
    return key == "normal" and material.normal_space == "TANGENT"


def fields(
    draw: Draw, materials: Mapping[str, Material | Mixture], scale: float
) -> tuple[dict[str, Field], dict[str, Material | Mixture]]:
    """One field or a few, and the materials that they need besides those of the scene."""
    found: dict[str, Field] = {}
    added: dict[str, Material | Mixture] = {}
    for k in range(draw.one((1, 1, 1, 2, 3))):
        added |= plain_materials(materials, draw.one(tuple(materials)), f"of field {k}")
        found[f"field.{k}"] = field(draw, f"of field {k}", scale)
    return found, added

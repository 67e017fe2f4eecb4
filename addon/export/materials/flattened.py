"""Bodies that are flattened to nothing: their faces lie on each other, and in Cycles each is in the other's shadow.

A ray that leaves a face ignores this face alone. Where the faces lie in a plane across an axis of the world, the hit
point lies exactly in that plane, so that rays meet the other face at a distance of exactly zero, and no light arrives:
the body is black. Where rounding moves hit points off the plane, it decides, ray by ray.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import edgegrad

from ..exported import Export
from ..geometry.meshes import PlacedMeshes
from .material import MaterialReading

SHADOWED = " (in its own shadow)"  # end of the names of these materials
CLEAR = ("TRANSPARENT", "GLASS", "REFRACTION")


def shadow_flattened(out: Export, meshes: PlacedMeshes) -> None:
    """Give flattened bodies that are in their own shadow black materials, and report all flattened bodies."""
    for group in meshes.groups():
        if not group.flattened:
            continue
        where = f"object '{group.sources[0].object}'"
        what = "has a scale of zero along an axis, so its faces lie on each other"
        if not group.shadowed or not all(_is_opaque(out.materials[name]) for name in group.slots):
            out.report.warn(where, f"{what}; rounding decides which of them is seen and, in Cycles, whether they "
                            "shadow each other")  # fmt: skip
            continue
        out.report.warn(where, f"{what}; it is black, since they shadow each other, as in Cycles")
        for name in group.slots:
            black = edgegrad.Material(np.zeros(3), kind="DIFFUSE")
            out.materials[name + SHADOWED] = replace(out.materials[name], value=black, parts={})
        group.slots = tuple(name + SHADOWED for name in group.slots)


def _is_opaque(reading: MaterialReading) -> bool:
    """Whether a material neither emits light nor lets any through."""
    for part in reading.parts.values() if reading.parts else (reading.value,):
        assert isinstance(part, edgegrad.Material)
        changed = part.transmission > 0.0 or part.alpha < 1.0 or part.emission.any()
        if changed or part.kind in CLEAR or {"transmission", "alpha", "emission"} & set(part.textures):
            return False
    return True

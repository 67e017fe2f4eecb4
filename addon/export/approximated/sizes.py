"""Sizes of the objects that have a material, for estimates of what an approximation leaves out."""

from __future__ import annotations

from typing import Any

import bpy

WITH_FACES = ("MESH", "CURVE", "SURFACE", "FONT", "META")


def thinnest(material: Any) -> tuple[str, float]:
    """Return the name and the smallest extent, in metres, of the thinnest object with this material.

    Flat objects count with their second smallest extent. The name is empty if no object has the material.
    """
    found = ("", 0.0)
    for ob in bpy.data.objects:
        if ob.type not in WITH_FACES or not any(slot.material == material.original for slot in ob.material_slots):
            continue
        extents = sorted(float(d) for d in ob.dimensions)
        size = next((d for d in extents if d > 1e-3 * extents[2]), 0.0)
        if size > 0.0 and (not found[0] or size < found[1]):
            found = (ob.name, size)
    return found

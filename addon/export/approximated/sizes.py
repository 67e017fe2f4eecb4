"""Sizes and scales of the objects that have a material, for estimates of what an approximation leaves out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

WITH_FACES = ("MESH", "CURVE", "SURFACE", "FONT", "META")


def thinnest(material: Any) -> tuple[str, float]:
    """Return the name and the smallest extent, in metres, of the thinnest object with this material.

    Flat objects count with their second smallest extent. The name is empty if no object has the material.
    """
    found = ("", 0.0)
    for ob in _with(material):
        extents = sorted(float(d) for d in ob.dimensions)
        size = next((d for d in extents if d > 1e-3 * extents[2]), 0.0)
        if size > 0.0 and (not found[0] or size < found[1]):
            found = (ob.name, size)
    return found


def farthest(material: Any) -> float:
    """Return the largest coordinate, in metres, of the boxes around the objects with this material; 0: there is none.

    Copies that instancers make are not counted.
    """
    found = 0.0
    for ob in _with(material):
        corners = np.array(ob.bound_box, np.float64) @ np.array(ob.matrix_world, np.float64)[:3, :3].T
        found = max(found, float(np.abs(corners + np.array(ob.matrix_world.translation)).max()))
    return found


def unevenly_scaled(material: Any) -> str:
    """Return the name of an object with this material whose scale differs between axes; empty if there is none."""
    for ob in _with(material):
        scales = np.linalg.svd(np.array(ob.matrix_world, np.float64)[:3, :3], compute_uv=False)
        if scales[0] - scales[2] > 1e-3 * scales[0]:
            return str(ob.name)
    return ""


def _with(material: Any) -> Iterator[Any]:
    for ob in bpy.data.objects if material is not None else ():
        if ob.type in WITH_FACES and any(slot.material == material.original for slot in ob.material_slots):
            yield ob

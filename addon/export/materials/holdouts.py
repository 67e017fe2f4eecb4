"""Objects that are holdouts: the camera sees black where they are, and other rays see them as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Operand

from ..exported import Export
from ..geometry.meshes import PlacedMeshes
from .material import PART, MaterialReading
from .shaders import mixture, product, weighted

CAMERA = e.LightPath("CAMERA")
HELD = " (holdout)"  # end of the names of these materials
OTHERS = e.Math("SUBTRACT", 1.0, CAMERA)


def hold_out(out: Export, meshes: PlacedMeshes) -> None:
    """Give the meshes of holdouts copies of their materials that are black for rays from the camera."""
    for group in meshes.groups():
        if not group.holdout:
            continue
        for name in set(group.slots):
            held = _name(name)
            if held not in out.materials:
                out.materials[held] = _held_out(out.materials[name], held)
            out.report.warn(f"object '{group.sources[0].object}'", "is a holdout: it is black, since pictures have no "
                            "alpha")  # fmt: skip
        group.slots = tuple(map(_name, group.slots))


def _name(material: str) -> str:
    return f"{material}{HELD}"


def _held_out(reading: MaterialReading, name: str) -> MaterialReading:
    """Copy a material; what is transparent stays so, as in Cycles."""
    layers: list[tuple[edgegrad.Material, Operand]] = []
    for part, weight in weighted(reading.value, reading.shaders()):
        if part.kind == "TRANSPARENT":
            layers.append((part, weight))
            continue
        layers.append((part, product(weight, OTHERS)))
        if part.alpha < 1.0 or "alpha" in part.textures:
            clear = e.Math("SUBTRACT", 1.0, part.textures.get("alpha", part.alpha))
            layers.append((edgegrad.Material(np.ones(3), kind="TRANSPARENT"),
                           product(weight, e.Math("MULTIPLY", CAMERA, clear))))  # fmt: skip
    keys = [f"{name}{PART}{k}" for k in range(len(layers))]
    # Exposure and switches of caustics change each material once.
    parts = {key: replace(part) for key, (part, _) in zip(keys, layers, strict=True)}
    value = mixture({key: weight for key, (_, weight) in zip(keys, layers, strict=True)})
    return replace(reading, value=value, parts=parts)

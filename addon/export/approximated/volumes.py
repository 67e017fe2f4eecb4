"""Volumes of materials: homogeneous absorption is read. Others are left out, with a warning, and the surfaces
around them are rendered."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..nodes.expressions import constant
from ..nodes.links import Feed, by_identifier, label
from .sizes import thinnest


def describe_volume(found: Feed, material: Any) -> str:
    """Return the sentence on the volume of a material: which node is left out, and how much light it would keep.

    Parameters
    ----------
    found
        What is linked to the volume of the output.
    material
        Blender's material, or None for a world.
    """
    node, groups = found.output.node, found.groups
    text = f"its volume (node '{label(node, groups)}', {node.bl_label}) is left out: light passes through it unchanged"
    extinction = _extinction(node, groups)
    name, size = ("", 0.0) if material is None else thinnest(material)
    if extinction is None or not name:
        return text
    kept = float(np.exp(-extinction * size).mean())
    return f"{text}; Cycles lets {kept:.0%} of it pass straight through the {size:.3g} m of object '{name}'"


def read_absorption(found: Feed) -> NDArray[np.float64] | None:
    """Return the (3,) absorption per metre of a homogeneous volume that scatters and emits no light; None for others.

    Parameters
    ----------
    found
        What is linked to the volume of the output.
    """
    node, groups = found.output.node, found.groups
    extinction = _extinction(node, groups)
    if node.type == "VOLUME_ABSORPTION":
        return extinction
    if node.type != "VOLUME_COEFFICIENTS":
        return None
    rest = [constant(by_identifier(node.inputs, f"{name} Coefficients"), groups) for name in ("Scatter", "Emission")]
    return extinction if all(one is not None and not np.any(one > 0.0) for one in rest) else None


def _extinction(node: Any, groups: Any) -> NDArray[np.float64] | None:
    """(3,) extinction per metre of a homogeneous volume; None if it varies or is unknown."""
    def value(name: str) -> NDArray[np.float64] | None:
        return constant(by_identifier(node.inputs, name), groups)

    if node.type == "VOLUME_COEFFICIENTS":
        absorbed, scattered = value("Absorption Coefficients"), value("Scatter Coefficients")
        return None if absorbed is None or scattered is None else np.maximum(absorbed + scattered, 0.0)
    if node.type not in ("VOLUME_ABSORPTION", "VOLUME_SCATTER", "PRINCIPLED_VOLUME"):
        return None
    color, density = value("Color"), value("Density")
    if color is None or density is None:
        return None
    color, density = np.clip(color, 0.0, 1.0), np.maximum(density, 0.0)
    if node.type == "PRINCIPLED_VOLUME":
        tint = value("Absorption Color")
        if tint is None:
            return None
        return density * (color + (1.0 - color) * np.maximum(1.0 - np.sqrt(np.maximum(tint, 0.0)), 0.0))
    return density * (1.0 - color if node.type == "VOLUME_ABSORPTION" else color)

"""Volumes of materials and worlds: homogeneous ones become media or absorption. Others are left out, with a warning."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..nodes.expressions import constant
from ..nodes.links import Feed, by_identifier, feed, label

F64 = NDArray[np.float64]

# Anisotropies that differ by less are one.
ALIKE = 0.05


@dataclass
class Volume:
    """A homogeneous volume.

    Attributes
    ----------
    scattering, absorption
        (3,) per metre.
    forward
        (3,) scattering times the mean cosine of the phase function.
    remarks
        Sentences on what is approximated.
    """

    scattering: F64
    absorption: F64
    forward: F64
    remarks: list[str] = field(default_factory=list)

    def scaled(self, by: float) -> Volume:
        """Return the volume with all coefficients multiplied."""
        return Volume(self.scattering * by, self.absorption * by, self.forward * by, self.remarks)

    def plus(self, other: Volume) -> Volume:
        """Return the sum of two volumes."""
        remarks = self.remarks + other.remarks
        one, two = self.anisotropy, other.anisotropy
        if one is not None and two is not None and abs(one - two) > ALIKE:
            remarks = [*remarks, f"its volumes of anisotropy {one:.2g} and {two:.2g} are rendered with their mean"]
        return Volume(self.scattering + other.scattering, self.absorption + other.absorption,
                      self.forward + other.forward, remarks)  # fmt: skip

    @property
    def anisotropy(self) -> float | None:
        """Mean cosine of all that scatters; None: nothing does."""
        total = float(self.scattering.sum())
        return float(self.forward.sum()) / total if total > 0.0 else None

    @property
    def medium(self) -> edgegrad.Medium:
        """The medium, with one phase function for all that scatters."""
        return edgegrad.Medium(tuple(self.scattering.tolist()), tuple(self.absorption.tolist()),
                               min(max(self.anisotropy or 0.0, -0.999), 0.999))  # fmt: skip


def read_volume(found: Feed) -> Volume | None:
    """Return what is linked to a volume, which may be nothing; None if it varies or cannot be read."""
    if found.output is None:
        return Volume(np.zeros(3), np.zeros(3), np.zeros(3))
    node, groups = found.output.node, found.groups
    if node.type == "ADD_SHADER":
        one, other = (read_volume(feed(socket, groups)) for socket in node.inputs[:2])
        return None if one is None or other is None else one.plus(other)
    if node.type == "MIX_SHADER":
        share = constant(node.inputs[0], groups)
        one, other = (read_volume(feed(socket, groups)) for socket in node.inputs[1:3])
        if share is None or one is None or other is None:
            return None
        weight = float(np.clip(share.mean(), 0.0, 1.0))
        return one.scaled(1.0 - weight).plus(other.scaled(weight))
    return _node_volume(node, groups)


def describe_volume(found: Feed) -> str:
    """Return the sentence on what is linked to the volume of an output and cannot be read."""
    node = found.output.node
    return (f"its volume (node '{label(node, found.groups)}', {node.bl_label}) is left out, since it is not "
            "homogeneous: light passes through it unchanged")


def _node_volume(node: Any, groups: Any) -> Volume | None:
    """Read a volume's node."""
    def value(name: str) -> F64 | None:
        return constant(by_identifier(node.inputs, name), groups)

    zero = np.zeros(3)
    if node.type == "VOLUME_COEFFICIENTS":
        absorbed, scattered = value("Absorption Coefficients"), value("Scatter Coefficients")
        if absorbed is None or scattered is None:
            return None
        volume = Volume(np.maximum(scattered, 0.0), np.maximum(absorbed, 0.0), zero)
    elif node.type in ("VOLUME_ABSORPTION", "VOLUME_SCATTER", "PRINCIPLED_VOLUME"):
        color, density = value("Color"), value("Density")
        if color is None or density is None:
            return None
        color, density = np.maximum(color, 0.0), np.maximum(density, 0.0)
        rest = np.maximum(1.0 - color, 0.0)
        if node.type == "VOLUME_ABSORPTION":
            return Volume(zero, density * rest, zero)
        volume = Volume(density * color, zero, zero)
        if node.type == "PRINCIPLED_VOLUME":
            tint = value("Absorption Color")
            if tint is None:
                return None
            kept = np.sqrt(np.maximum(tint, 0.0))
            volume.absorption = density * rest * np.maximum(1.0 - kept, 0.0)
    else:
        return None
    cosine = _mean_cosine(node, value, volume.remarks, label(node, groups))
    if cosine is None:
        return None
    volume.forward = volume.scattering * cosine
    _name_emission(node, value, volume.remarks, label(node, groups))
    return volume


def _mean_cosine(node: Any, value: Any, remarks: list[str], name: str) -> float | None:
    """Return the mean cosine of a node's phase function; others than Henyey and Greenstein's are approximated."""
    phase = getattr(node, "phase", "HENYEY_GREENSTEIN")
    if phase in ("HENYEY_GREENSTEIN", "DRAINE"):
        found = value("Anisotropy")
        cosine = None if found is None else float(np.clip(found.mean(), -0.999, 0.999))
    elif phase == "RAYLEIGH":
        cosine = 0.0
    else:  # water and fog scatter most light forwards
        cosine = 0.9
    if phase != "HENYEY_GREENSTEIN" and cosine is not None:
        remarks.append(f"the phase function {phase.replace('_', ' ').title()} of its volume (node '{name}') is "
                       f"rendered as Henyey-Greenstein with an anisotropy of {cosine:.2g}")
    return cosine


def _name_emission(node: Any, value: Any, remarks: list[str], name: str) -> None:
    """Add a remark if a volume emits light."""
    for strength in ("Emission Strength", "Blackbody Intensity", "Emission Coefficients"):
        if by_identifier(node.inputs, strength) is None:
            continue
        found = value(strength)
        if found is None or np.any(found > 0.0):
            remarks.append(f"the light that its volume (node '{name}') emits is left out: set '{strength}' to 0")

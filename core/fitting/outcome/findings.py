"""What a fit has found about its parameters, in words: which stay open, and which are held by their limits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.camera import Camera
from ..control_vertices import ControlVertices
from ..driven import Numbers, Variable
from ..variables import Unknown, Values
from ..vertices.variables import Vertices

# Kinds of findings.
OPEN, LOW, HIGH = "open", "at the lower limit", "at the upper limit"
# Angle (radians) up to which two orthographic cameras look along the same line; it covers the rounding of rotations.
SAME_DIRECTION = 1e-6


@dataclass(frozen=True)
class Finding:
    """What a fit has found about some numbers of a parameter.

    Attributes
    ----------
    path
        Path of the parameter.
    kind
        "open": no picture depended on the numbers in any iteration, so they say nothing about them. "at the lower
        limit" or "at the upper limit": the fit would have left the range there.
    count, size
        Number of such numbers, and of all numbers of the parameter.
    """

    path: str
    kind: str
    count: int
    size: int

    def __str__(self) -> str:
        part = "" if self.count == self.size else f"{self.count:,} of {self.size:,} numbers of "
        if self.kind == OPEN:
            return f"the pictures say nothing about {part}'{self.path}'"
        return f"{part}'{self.path}': {self.kind}"


def findings(touched: Mapping[str, NDArray[np.bool_]], values: Mapping[str, Any],
             variables: Iterable[Unknown | Variable | Numbers]) -> tuple[Finding, ...]:  # fmt: skip
    """Return what is known after a fit.

    Parameters
    ----------
    touched
        For each parameter, which of its numbers had a gradient in some iteration.
    values
        Values at the end.
    variables
        The variables of the fit.
    """
    out = [Finding(path, OPEN, int(np.sum(~one)), one.size) for path, one in touched.items() if not one.all()]
    for item in variables:
        if isinstance(item, Numbers):
            low, high = item.low, item.high
        elif isinstance(item, Values):
            low, high = np.asarray(item.limits)
        else:
            continue
        path, value = item.path, np.asarray(values[item.path], np.float64)
        for kind, at in ((LOW, (value <= low) & np.isfinite(low)), (HIGH, (value >= high) & np.isfinite(high))):
            held = at & touched[path]
            if held.any():
                out.append(Finding(path, kind, int(held.sum()), value.size))
    return tuple(out)


def open_depths(variables: Iterable[Unknown | Variable | Numbers], cameras: Sequence[Camera]) -> list[str]:
    """Say for which shapes there are pictures from one viewpoint only."""
    if not _one_viewpoint(cameras):
        return []
    out = []
    for item in variables:
        if not isinstance(item, (Vertices, ControlVertices)):
            continue
        known = ", except where it shows a vertex and its mirror image from beside the plane of symmetry"
        out.append(f"one view does not determine depth: how far the vertices of '{item.path}' are from the camera is "
                   f"told by shading and shadows alone{known if item.symmetric else ''}; add targets from other sides")
    return out


def _one_viewpoint(cameras: Sequence[Camera]) -> bool:
    """Whether all pictures are projections from one place, or all along one direction from infinitely far away."""
    kinds = [camera.kind == "ORTHOGRAPHIC" for camera in cameras]
    if all(kinds):
        directions = np.array([camera.to_world[:3, 2] for camera in cameras])
        return bool(np.abs(np.cross(directions, directions[0])).max() <= SAME_DIRECTION)
    places = np.array([camera.to_world[:3, 3] for camera in cameras])
    return not any(kinds) and not np.ptp(places, axis=0).any()

"""Outlines and surfaces of distance fields as the boundary terms sample them."""

from __future__ import annotations

from collections import Counter

import numpy as np

from edgegrad import Field, _native
from tests.support.fields.splines import Floats

# Gauss-Legendre places and weights within each segment.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
U = (0.5 * (NODES + 1.0)).astype(np.float32)


def outline(field: Field, viewer: Floats, u: Floats = U, threads: int = 2) -> dict[str, Floats]:
    """The outline as a viewer sees it: ends of segments, and points at the fractions `u` of each."""
    found = _native.field_outline_points(
        field.values, np.ascontiguousarray(field.grid_to_world()), np.asarray(viewer, float),
        np.asarray(u, np.float32), threads)
    return {name: value.astype(float) for name, value in found.items()}


def length(found: dict[str, Floats]) -> float:
    """The length of the outline, by the points that samples take."""
    speed = found["sign"] * np.linalg.norm(found["tangent"], axis=-1)
    return float(np.sum(speed * 0.5 * WEIGHTS))


def unmatched(ends: Floats) -> int:
    """How many ends of segments are not the start of another one, or the other way round."""
    count: Counter[tuple[float, ...]] = Counter()
    for start, end in ends:
        count[tuple(start)] += 1
        count[tuple(end)] -= 1
    return sum(abs(n) for n in count.values())


def surface(field: Field) -> dict[str, Floats]:
    """Points of a field's surface, with the weights of their areas."""
    u, v = np.meshgrid(U, U, indexing="ij")
    found = _native.field_surface_points(field.values, np.ascontiguousarray(field.grid_to_world()),
                                         np.stack([u.ravel(), v.ravel()], axis=-1).astype(np.float32), 2)
    weights = 0.25 * np.outer(WEIGHTS, WEIGHTS).ravel()
    return {"position": found["position"], "normal": found["normal"], "area": found["area"] * weights}


def volume(found: dict[str, Floats]) -> float:
    """The volume within a surface, by the divergence theorem."""
    return float(np.sum(found["area"][..., None] * found["normal"] * found["position"]) / 3.0)

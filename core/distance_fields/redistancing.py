"""Fields that have become something else made distances again, without a motion of their surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .._check import instance
from ..scene.field import Field
from . import spline, sweeping

F64 = NDArray[np.float64]

# Cells on both sides of the surface whose distances come from the field itself. Farther ones are swept outward.
BAND = 1.5


def redistanced(field: Field) -> Field:
    """Return a field with the same surface that is the distance from it, in the field's own space.

    Nodes within 1.5 cells of the surface get their distance from a Newton step to it. All others are reached from these
    by fast sweeping, to first order of the size of a cell. Features of the surface between nodes, where the sign at no
    node changes, disappear.

    Parameters
    ----------
    field
        Any field; its transform stays.

    Raises
    ------
    ValueError
        If the field has no surface: the same sign at all nodes.
    """
    instance("redistanced", "field", field, Field)
    field.validate("redistanced")
    values = distance_coefficients(field.values.astype(np.float64), field.spacing)
    return replace(field, values=values.astype(np.float32))


def distance_coefficients(values: F64, spacing: F64) -> F64:
    """Coefficients of the distance from the surface of the spline `values`, on cells of the size `spacing` (3,)."""
    at_nodes = spline.node_values(values)
    inside = at_nodes < 0.0
    if inside.all() or not inside.any():
        raise ValueError(f"redistanced: the field has no surface: it is {'negative' if inside.all() else 'positive'} "
                         "at all nodes of its grid; shift its values, or use more cells")
    slope = np.stack(spline.node_slopes(values), axis=-1) / spacing
    steepness = np.linalg.norm(slope, axis=-1)
    crossing = _crossings(at_nodes, inside, spacing)
    reach = BAND * float(spacing.max())
    near = np.isfinite(crossing) | (np.abs(at_nodes) < reach * steepness)
    nodes = np.argwhere(near)
    distance = np.full(at_nodes.shape, np.inf)
    found = _projected(values, nodes, at_nodes[near], slope[near], spacing, reach)
    found = np.minimum(found, crossing[near])
    found[found > reach] = np.inf
    distance[near] = found
    distance = sweeping.distances(distance, spacing)
    return spline.coefficients(np.where(inside, -distance, distance))


def coefficients_without(values: F64, removed: NDArray[np.bool_], spacing: F64) -> F64:
    """Coefficients of the distance from the rest of a surface, after some of its parts are gone.

    Parameters
    ----------
    values
        Coefficients of a distance.
    removed
        Selects the nodes inside of the parts that go; nodes inside of others must remain.
    spacing
        (3,) lengths of a cell.
    """
    at_nodes = spline.node_values(values)
    kept = (at_nodes < 0.0) & ~removed
    nearer = [sweeping.distances(np.where(nodes, 0.0, np.inf), spacing) for nodes in (kept, removed)]
    known = (np.abs(at_nodes) < BAND * float(spacing.max())) & (nearer[0] <= nearer[1])
    distance = sweeping.distances(np.where(known, np.abs(at_nodes), np.inf), spacing)
    return spline.coefficients(np.where(kept, -distance, distance))


def _projected(values: F64, nodes: NDArray[np.int64], value: F64, slope: F64, spacing: F64, reach: float) -> F64:
    """Distances of nodes from the surface: a Newton step along the gradient, and the distance that is left there."""
    square = np.sum(slope**2, axis=1)
    flat = ~(np.abs(value) < 2.0 * reach * np.sqrt(square))
    step = (np.where(flat, 0.0, value) / np.where(flat, 1.0, square))[:, None] * slope
    left, change = spline.evaluate(values, nodes - step / spacing)
    steepness = np.linalg.norm(change / spacing, axis=1)
    side = np.where(value < 0.0, -1.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        out = np.linalg.norm(step, axis=1) + side * left / steepness
    # The step may have crossed a fold: then the plain quotient is as good.
    plain = np.linalg.norm(step, axis=1)
    bad = ~(np.abs(out - plain) < 0.5 * float(spacing.max()))
    out = np.where(bad, plain, np.maximum(out, 0.0))
    return np.where(flat, np.inf, out)


def _crossings(at_nodes: F64, inside: NDArray[np.bool_], spacing: F64) -> F64:
    """Upper bounds of the distances of nodes whose neighbour has the other sign; inf for others."""
    out = np.full(at_nodes.shape, np.inf)
    for axis in range(3):
        f, within, bound = (np.moveaxis(x, axis, 0) for x in (at_nodes, inside, out))
        changes = within[1:] != within[:-1]
        t = np.where(changes, f[:-1] / np.where(changes, f[:-1] - f[1:], 1.0), np.inf)
        # A line's crossing is known to a part of a cell only: the spline between two nodes is not straight.
        ahead = np.minimum(1.0, t + 0.25) * spacing[axis]
        behind = np.minimum(1.0, 1.25 - t) * spacing[axis]
        bound[:-1] = np.where(changes, np.minimum(bound[:-1], ahead), bound[:-1])
        bound[1:] = np.where(changes, np.minimum(bound[1:], behind), bound[1:])
    return out

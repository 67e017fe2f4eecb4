"""Distances on a grid outward from known ones: the fast sweeping method (Zhao 2005) for |grad d| = 1."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

# Rounds of eight sweeps. A distance without obstacles needs one; a second one repairs corners of uneven cells.
_ROUNDS = 4
_ENOUGH = 1e-6  # largest change of a round after which no other follows, in cells


def distances(known: F64, spacing: F64) -> F64:
    """Fill in the distances of all nodes from those of some.

    Parameters
    ----------
    known
        (mx, my, mz) distances, not negative; inf where they are not known. Known ones stay.
    spacing
        (3,) lengths of a cell.

    Returns
    -------
    (mx, my, mz) distances to first order of the spacing; inf everywhere if none is known.
    """
    shape = np.array(known.shape)
    padded = np.full(shape + 2, np.inf)
    padded[1:-1, 1:-1, 1:-1] = known
    open_nodes = np.argwhere(~np.isfinite(known))
    if len(open_nodes) == 0 or len(open_nodes) == known.size:
        return np.array(known)
    flat = padded.reshape(-1)
    stride = np.array([(shape[1] + 2) * (shape[2] + 2), shape[2] + 2, 1])
    index = (open_nodes + 1) @ stride
    # The nodes of a plane x +- y +- z = constant do not depend on each other: they are updated together. These planes
    # follow each other in both directions.
    orders = []
    for signs in ((1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)):
        level = open_nodes @ np.array(signs)
        level -= level.min()
        order = np.argsort(level.astype(np.int32), kind="stable")
        ends = np.cumsum(np.bincount(level))
        orders.append((index[order], ends))
    for _ in range(_ROUNDS):
        before = flat[index]
        for nodes, ends in orders:
            planes = [nodes[a:b] for a, b in zip([0, *ends[:-1]], ends, strict=True) if b > a]
            for plane in planes:
                _update(flat, plane, stride, spacing)
            for plane in reversed(planes):
                _update(flat, plane, stride, spacing)
        with np.errstate(invalid="ignore"):
            change = np.abs(flat[index] - before)
        if not np.any(change > _ENOUGH * spacing.min()):  # inf - inf: not reached, nan
            break
    return np.ascontiguousarray(padded[1:-1, 1:-1, 1:-1])


def _update(flat: F64, nodes: NDArray[np.int64], stride: NDArray[np.int64], spacing: F64) -> None:
    """Godunov's upwind scheme: the d with sum over axes of max(d - a, 0)^2 / h^2 = 1, a the smaller neighbour."""
    near = np.stack([np.minimum(flat[nodes - s], flat[nodes + s]) for s in stride])
    if np.all(spacing == spacing[0]):
        near.sort(axis=0)
        h = np.broadcast_to(spacing[:, None], near.shape)
    else:
        order = np.argsort(near, axis=0)
        near, h = np.take_along_axis(near, order, axis=0), spacing[order]
    reached = np.isfinite(near[0])
    if not reached.all():
        nodes, near, h = nodes[reached], near[:, reached], h[:, reached]
        if len(nodes) == 0:
            return
    best = near[0] + h[0]
    weight, mean, square = h[0] ** -2, near[0] * h[0] ** -2, near[0] ** 2 * h[0] ** -2
    for k in (1, 2):
        # Another axis takes part where its neighbour is smaller than the distance without it.
        a = np.where(best > near[k], near[k], best)
        w = np.where(best > near[k], h[k] ** -2, 0.0)
        weight, mean, square = weight + w, mean + w * a, square + w * a * a
        root = np.sqrt(np.maximum(mean**2 - weight * (square - 1.0), 0.0))
        best = np.where(w > 0.0, (mean + root) / weight, best)
    flat[nodes] = np.minimum(flat[nodes], best)

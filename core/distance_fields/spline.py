"""The cubic B-spline of a field: coefficients from values, values from coefficients, and finer grids.

Nodes are the corners of the cells: a grid of n coefficients along an axis has n - 2 nodes. The value at a node is
(c[i] + 4 c[i + 1] + c[i + 2]) / 6 along each axis.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .linear import mapped

Numbers = NDArray[Any]  # real or complex
F64 = NDArray[np.float64]

# Points whose 64 coefficients are gathered at once.
_POINTS = 1 << 15


def coefficients(nodes: F64) -> F64:
    """(mx + 2, my + 2, mz + 2) coefficients of the spline that has the values (mx, my, mz) at the nodes.

    The values leave one degree of freedom at each end of an axis. The third derivative of the outermost cells is set to
    0 there, so that quadratic functions are reproduced exactly. An axis of two nodes has only a linear function.
    """
    out = np.asarray(nodes, np.float64)
    for axis in range(3):
        out = np.moveaxis(_along_first(np.ascontiguousarray(np.moveaxis(out, axis, 0))), 0, axis)
    return np.ascontiguousarray(out)


def _along_first(f: F64) -> F64:
    """Solve for the coefficients along the first axis.

    With c[-3] - 3 c[-2] + 3 c[-1] - c[0] = 0 at an end, the end's equation becomes c[1] - c[2] = f[0] - f[1]. It is
    inserted into its neighbour, and a tridiagonal system of the inner coefficients remains (Thomas' algorithm).
    """
    m = len(f)
    c = np.empty((m + 2, *f.shape[1:]))
    if m == 2:
        c[1], c[2] = f
        c[0], c[3] = 2.0 * f[0] - f[1], 2.0 * f[1] - f[0]
        return c
    first, last = f[0] - f[1], f[-1] - f[-2]
    inner = c[2:-2]
    inner[:] = 6.0 * f[1:-1]
    inner[0] -= first
    inner[-1] -= last
    diagonal = np.full(m - 2, 4.0)
    diagonal[0] += 1.0
    diagonal[-1] += 1.0
    for i in range(1, m - 2):
        factor = 1.0 / diagonal[i - 1]
        diagonal[i] -= factor
        inner[i] -= factor * inner[i - 1]
    inner[-1] /= diagonal[-1]
    for i in range(m - 4, -1, -1):
        inner[i] = (inner[i] - inner[i + 1]) / diagonal[i]
    c[1], c[-2] = c[2] + first, c[-3] + last
    c[0] = 6.0 * f[0] - 4.0 * c[1] - c[2]
    c[-1] = 6.0 * f[-1] - 4.0 * c[-2] - c[-3]
    return c


NODE_WEIGHTS = np.array([1.0, 4.0, 1.0]) / 6.0
NODE_SLOPES = np.array([-0.5, 0.0, 0.5])


def filtered(values: Numbers, axis: int, taps: F64) -> Numbers:
    """Combine three neighbours along an axis with the weights `taps`: n entries become n - 2."""
    moved = np.moveaxis(values, axis, 0)
    return np.moveaxis(taps[0] * moved[:-2] + taps[1] * moved[1:-1] + taps[2] * moved[2:], 0, axis)


def spread(values: Numbers, axis: int, taps: F64) -> Numbers:
    """The transpose of `filtered`: n - 2 entries become n."""
    moved = np.moveaxis(values, axis, 0)
    out = np.zeros((len(moved) + 2, *moved.shape[1:]), moved.dtype)
    for k in range(3):
        out[k : len(moved) + k] += taps[k] * moved
    return np.moveaxis(out, 0, axis)


def node_values(values: Numbers) -> Numbers:
    """Values (nx - 2, ny - 2, nz - 2) of a spline at its nodes."""
    for axis in range(3):
        values = filtered(values, axis, NODE_WEIGHTS)
    return values


def node_slopes(values: Numbers) -> list[Numbers]:
    """Derivatives of a spline at its nodes by the three grid coordinates."""
    out = []
    for by in range(3):
        part = values
        for axis in range(3):
            part = filtered(part, axis, NODE_SLOPES if axis == by else NODE_WEIGHTS)
        out.append(part)
    return out


def spread_slopes(slopes: list[Numbers]) -> Numbers:
    """The transpose of `node_slopes`: the gradient by the coefficients from that by the derivatives at the nodes."""
    total = None
    for by, part in enumerate(slopes):
        for axis in range(3):
            part = spread(part, axis, NODE_SLOPES if axis == by else NODE_WEIGHTS)
        total = part if total is None else total + part
    assert total is not None
    return total


def basis(u: F64) -> tuple[F64, F64]:
    """Weights of the four coefficients of a cell at the place u in [0, 1], and the derivatives of the weights."""
    v = 1.0 - u
    weight = np.stack([v**3, 4.0 - 6.0 * u**2 + 3.0 * u**3, 4.0 - 6.0 * v**2 + 3.0 * v**3, u**3]) / 6.0
    slope = np.stack([-(v**2), u * (3.0 * u - 4.0), -v * (3.0 * v - 4.0), u**2]) / 2.0
    return weight, slope


def evaluate(values: NDArray[np.floating], grid: F64) -> tuple[F64, F64]:
    """Evaluate a spline at points in grid coordinates, which count cells from the lower corner of the box.

    Points outside of the box are evaluated by the polynomial of the nearest cell.

    Parameters
    ----------
    values
        (nx, ny, nz) coefficients.
    grid
        (n, 3) points.

    Returns
    -------
    (n,) values and (n, 3) derivatives by the grid coordinates.
    """
    value, slope = np.empty(len(grid)), np.empty((len(grid), 3))
    flat = np.ascontiguousarray(values).reshape(-1)
    size = np.array(values.shape)
    stride = np.array([size[1] * size[2], size[2], 1])
    for first in range(0, len(grid), _POINTS):
        part = grid[first : first + _POINTS]
        cell = np.clip(np.floor(part).astype(np.int64), 0, size - 4)
        weight, change = basis(part - cell)  # (4, n, 3)
        base = cell @ stride
        total, by = np.zeros(len(part)), np.zeros((3, len(part)))
        for i in range(4):
            for j in range(4):
                row = flat[(base + (i * stride[0] + j * stride[1]))[None] + np.arange(4)[:, None]].astype(np.float64)
                along, steep = (row * weight[..., 2]).sum(axis=0), (row * change[..., 2]).sum(axis=0)
                both = weight[i, :, 0] * weight[j, :, 1]
                total += both * along
                by[0] += change[i, :, 0] * weight[j, :, 1] * along
                by[1] += weight[i, :, 0] * change[j, :, 1] * along
                by[2] += both * steep
        value[first : first + _POINTS], slope[first : first + _POINTS] = total, by.T
    return value, slope


def refined(values: F64) -> F64:
    """(2 nx - 3, ...) coefficients of the same spline on cells of half the size (subdivision)."""
    for axis in range(3):
        c = np.moveaxis(values, axis, 0)
        out = np.empty((2 * len(c) - 3, *c.shape[1:]), np.result_type(values, np.float64))
        out[0::2] = 0.5 * (c[:-1] + c[1:])
        out[1::2] = (c[:-2] + 6.0 * c[1:-1] + c[2:]) / 8.0
        values = np.moveaxis(out, 0, axis)
    return np.ascontiguousarray(values)


def coarsened_gradient(gradient: F64) -> F64:
    """The transpose of `refined`: the gradient by the coarse coefficients from that by the fine ones."""
    for axis in range(3):
        fine = np.moveaxis(gradient, axis, 0)
        out = np.zeros(((len(fine) + 3) // 2, *fine.shape[1:]))
        out[:-1] += 0.5 * fine[0::2]
        out[1:] += 0.5 * fine[0::2]
        inner = fine[1::2]
        out[:-2] += inner / 8.0
        out[1:-1] += 0.75 * inner
        out[2:] += inner / 8.0
        gradient = np.moveaxis(out, 0, axis)
    return np.ascontiguousarray(gradient)


def at_nodes_of(values: NDArray[np.floating], places: list[F64]) -> F64:
    """Values of a spline at all combinations of places along the axes, in grid coordinates within the box."""
    maps = []
    for axis, u in enumerate(places):
        cell = np.clip(np.floor(u).astype(np.int64), 0, values.shape[axis] - 4)
        matrix = np.zeros((len(u), values.shape[axis]))
        rows = np.arange(len(u))
        for k, weight in enumerate(basis(u - cell)[0]):
            matrix[rows, cell + k] = weight
        maps.append(matrix)
    return mapped(np.asarray(values, np.float64), maps)

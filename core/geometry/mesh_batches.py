"""Batches of small meshes: one array operation on a batch replaces many operations on tiny arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..scene.mesh import Mesh

# Vertices and faces of a batch. Larger batches amortise the overhead of array operations; smaller ones keep temporary
# arrays in the caches.
_SIZE = 1 << 16


def batches(sizes: Sequence[int] | NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Yield runs [first, last) of consecutive meshes by their sizes; a mesh larger than a batch is a run of its own."""
    end = np.cumsum(sizes)
    first, before = 0, 0
    while first < len(end):
        last = max(int(np.searchsorted(end, before + _SIZE, side="right")), first + 1)
        yield first, last
        first, before = last, int(end[last - 1])


def corners(meshes: Sequence[Mesh]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 3) lower and upper corners of the bounding box of each mesh."""
    low, high = np.empty((len(meshes), 3)), np.empty((len(meshes), 3))
    counts = np.array([len(mesh.vertices) for mesh in meshes], np.int64)
    for first, last in batches(counts):
        part = meshes[first:last]
        vertices = part[0].vertices if len(part) == 1 else np.concatenate([mesh.vertices for mesh in part])
        begin = np.cumsum(counts[first:last]) - counts[first:last]
        low[first:last], high[first:last] = np.minimum.reduceat(vertices, begin), np.maximum.reduceat(vertices, begin)
    return low, high

"""Batches of small meshes: one array operation on a batch replaces many operations on tiny arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

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


@dataclass
class Batch:
    """Consecutive meshes, concatenated.

    Attributes
    ----------
    first, last
        Range [first, last) of the meshes in the batch.
    vertices, faces
        (v, 3) vertices and (f, 3) faces of all meshes of the batch.
    first_vertex, first_face
        (n + 1,) index of the first vertex and face of each mesh.
    """

    first: int
    last: int
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    first_vertex: NDArray[np.int64]
    first_face: NDArray[np.int64]

    @property
    def mesh_of_vertex(self) -> NDArray[np.int64]:
        """(v,) index, within the batch, of the mesh of each vertex."""
        return np.repeat(np.arange(self.last - self.first), np.diff(self.first_vertex))

    @property
    def mesh_of_face(self) -> NDArray[np.int64]:
        """(f,) index, within the batch, of the mesh of each face."""
        return np.repeat(np.arange(self.last - self.first), np.diff(self.first_face))


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


def joined(meshes: Sequence[Mesh]) -> Iterator[Batch]:
    """Concatenate meshes into batches."""
    for first, last in batches([len(mesh.vertices) + len(mesh.faces) for mesh in meshes]):
        part = meshes[first:last]
        first_vertex = np.cumsum([0, *(len(mesh.vertices) for mesh in part)])
        first_face = np.cumsum([0, *(len(mesh.faces) for mesh in part)])
        faces = np.concatenate([mesh.faces for mesh in part]).astype(np.int64)
        faces += np.repeat(first_vertex[:-1], np.diff(first_face))[:, None]
        vertices = part[0].vertices if len(part) == 1 else np.concatenate([mesh.vertices for mesh in part])
        yield Batch(first, last, vertices, faces, first_vertex, first_face)

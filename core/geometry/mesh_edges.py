"""Counts of the edges of a mesh at which the radiance can be discontinuous, seen from the camera."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene.mesh import Mesh
from . import topology
from .mesh_batches import Batch, joined
from .shape import normals_of

# Two faces are coplanar if the angle between their normals is below this, radians.
COPLANAR = 1e-5
# Shading normals and attributes count as equal if they differ by less (native/boundary/meshes/seams.cpp).
SAME = 1e-5


@dataclass(frozen=True)
class MeshEdges:
    """Counts of the edges of a mesh.

    Attributes
    ----------
    count
        All edges.
    flat
        Edges between two coplanar faces of the same orientation.
    material_seams
        Flat edges between two materials.
    shading_seams
        Flat edges within one material at which shading normals, or attributes that the textures of the material
        may read, are discontinuous.
    """

    count: int
    flat: int
    material_seams: int
    shading_seams: int

    @property
    def plain(self) -> int:
        """Flat edges without a seam, at which nothing is discontinuous."""
        return self.flat - self.material_seams - self.shading_seams

    @staticmethod
    def of_all(meshes: Sequence[Mesh], textured: Collection[str]) -> list[MeshEdges]:
        """Count the edges of each mesh; `textured` names the materials that read textures."""
        return [edges for batch in joined(meshes)
                for edges in _of_batch(batch, meshes[batch.first : batch.last], textured)]


def _of_batch(batch: Batch, meshes: Sequence[Mesh], textured: Collection[str]) -> list[MeshEdges]:
    label = topology.weld(batch.vertices, of=batch.mesh_of_vertex)
    found = topology.edges(batch.faces, label)
    mesh_of_face = batch.mesh_of_face
    first = found.face_first.astype(np.int64)
    pair = np.flatnonzero(np.diff(first) == 2)
    a, b = found.faces[first[pair]].astype(np.int64), found.faces[first[pair] + 1].astype(np.int64)
    normal = normals_of(batch.vertices, batch.faces)
    # |n_a - n_b| is nearly the angle between the normals. The winding of a face sets the sign of its normal.
    flat = np.linalg.norm(normal[a] - normal[b], axis=1) < COPLANAR
    slot, reads = _slots(batch, meshes, textured)
    border = slot[a] != slot[b]
    inside = np.flatnonzero(flat & ~border)
    seam = np.zeros(len(pair), bool)
    values = _CornerValues(batch, meshes)
    corners = label[batch.faces]
    for end in (0, 1):
        at = label[found.vertices[pair[inside], end]][:, None]
        ca, cb = (np.argmax(corners[face[inside]] == at, axis=1) for face in (a, b))
        seam[inside] |= values.differ(a[inside], ca, b[inside], cb, reads[a[inside]])

    def count(faces: NDArray[np.int64]) -> list[int]:
        return np.bincount(mesh_of_face[faces], minlength=len(meshes)).tolist()

    counts = [count(faces) for faces in (found.faces[first[:-1]], a[flat], a[flat & border], a[seam])]
    return [MeshEdges(*numbers) for numbers in zip(*counts, strict=True)]


def _slots(
    batch: Batch, meshes: Sequence[Mesh], textured: Collection[str]
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """(f,) material slot of each face, and whether its material reads textures."""
    slot = np.zeros(len(batch.faces), np.int32)
    reads = np.zeros(len(batch.faces), bool)
    for mesh, begin, end in zip(meshes, batch.first_face, batch.first_face[1:], strict=False):
        if mesh.face_material is None:
            reads[begin:end] = mesh.materials[0] in textured
        else:
            slot[begin:end] = mesh.face_material
            reads[begin:end] = np.array([name in textured for name in mesh.materials])[mesh.face_material]
    return slot, reads


class _CornerValues:
    """Values that shading reads at the corners of the faces of a batch: normal index, normal, attributes."""

    def __init__(self, batch: Batch, meshes: Sequence[Mesh]) -> None:
        spans = list(zip(meshes, batch.first_face, batch.first_face[1:], strict=False))
        faces = len(batch.faces)
        self.smoothing: NDArray[np.int64] | None = None
        self.normals: NDArray[np.float64] | None = None
        self.attributes: list[NDArray[np.float32]] = []
        if any(mesh.smoothing is not None for mesh in meshes):
            self.smoothing = np.full((faces, 3), -1, np.int64)
            given: list[NDArray[np.float64]] = []
            total = 0
            for mesh, begin, end in spans:
                if mesh.smoothing is None:
                    continue
                self.smoothing[begin:end] = np.where(mesh.smoothing < 0, -1, mesh.smoothing + total)
                # Without custom normals, two corners differ if their normal indices differ: NaN compares unequal.
                groups = int(mesh.smoothing.max(initial=-1)) + 1
                unit = np.full((groups, 3), np.nan)
                if mesh.normals is not None:
                    unit = mesh.normals[:groups] / np.linalg.norm(mesh.normals[:groups], axis=1, keepdims=True)
                given.append(unit)
                total += groups
            self.normals = np.concatenate(given)
        layers = {(name, values.shape[2]) for mesh in meshes for name, values in mesh.attributes.items()}
        for name, width in sorted(layers):
            layer = np.zeros((faces, 3, width), np.float32)
            for mesh, begin, end in spans:
                values = mesh.attributes.get(name)
                if values is not None and values.shape[2] == width:
                    layer[begin:end] = values
            self.attributes.append(layer)

    def differ(
        self, a: NDArray[np.int64], ca: NDArray[np.int64], b: NDArray[np.int64], cb: NDArray[np.int64],
        reads: NDArray[np.bool_],
    ) -> NDArray[np.bool_]:
        """(n,) whether corner ca of face a and corner cb of face b, which coincide, have different values."""
        out = np.zeros(len(a), bool)
        if self.smoothing is not None and self.normals is not None:
            na, nb = self.smoothing[a, ca], self.smoothing[b, cb]
            out = na != nb
            both = np.flatnonzero(out & (na >= 0) & (nb >= 0))
            out[both] = ~(np.abs(self.normals[na[both]] - self.normals[nb[both]]).max(axis=1) <= SAME)
        for values in self.attributes:
            out |= reads & (np.abs(values[a, ca] - values[b, cb]).max(axis=1) > SAME)
        return out

"""Which edges of a mesh can carry a jump that the camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import topology
from .mesh import Mesh
from .shape import face_normals

# Two faces whose normals differ by less than this many radians lie in one plane.
COPLANAR = 1e-5
# Normals and attributes that differ by less are the same (native/boundary/seams.cpp).
SAME = 1e-5


@dataclass(frozen=True)
class MeshEdges:
    """Numbers of a mesh's edges.

    Attributes
    ----------
    count
        All edges.
    flat
        Those between two faces of one plane and one orientation.
    material_seams
        Of the flat ones, those between two materials.
    shading_seams
        Of the flat ones inside of one material, those across which shading normals, or attributes that the
        material's textures may read, jump.
    """

    count: int
    flat: int
    material_seams: int
    shading_seams: int

    @property
    def plain(self) -> int:
        """Flat edges without any seam: nothing jumps there."""
        return self.flat - self.material_seams - self.shading_seams

    @staticmethod
    def of(mesh: Mesh, textured: Sequence[bool]) -> MeshEdges:
        """The edges of a mesh; `textured`: by slot, whether the material reads textures."""
        label = topology.weld(mesh.vertices)
        found = topology.edges(mesh.faces, label)
        first = found.face_first.astype(np.int64)
        pair = np.flatnonzero(np.diff(first) == 2)
        a, b = found.faces[first[pair]], found.faces[first[pair] + 1]
        normal = face_normals(mesh)
        # |n_a - n_b| is the angle between them; face windings decide the orientation.
        flat = np.linalg.norm(normal[a] - normal[b], axis=1) < COPLANAR
        slot = np.zeros(len(mesh.faces), np.int32) if mesh.face_material is None else mesh.face_material
        border = slot[a] != slot[b]
        inside = flat & ~border
        reads = np.asarray(textured, bool)[slot[a]]
        seam = np.zeros(len(pair), bool)
        corners = label[mesh.faces]
        for end in (0, 1):
            at = label[found.vertices[pair, end]][:, None]
            ca, cb = (np.argmax(corners[face] == at, axis=1) for face in (a, b))
            seam[inside] |= _differ(mesh, a[inside], ca[inside], b[inside], cb[inside], reads[inside])
        return MeshEdges(len(found), int(flat.sum()), int((flat & border).sum()), int(seam.sum()))


def _differ(
    mesh: Mesh, a: NDArray[np.uint32], ca: NDArray[np.int64], b: NDArray[np.uint32], cb: NDArray[np.int64],
    reads: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """(n,) whether corners ca of faces a and cb of faces b, at one place, differ in what shading reads there."""
    out = np.zeros(len(a), bool)
    if mesh.smoothing is not None:
        na, nb = mesh.smoothing[a, ca], mesh.smoothing[b, cb]
        out |= na != nb
        if mesh.normals is not None:
            unit = mesh.normals / np.linalg.norm(mesh.normals, axis=1, keepdims=True)
            out &= (na < 0) | (nb < 0) | (np.abs(unit[na] - unit[nb]).max(axis=1) > SAME)
    for values in mesh.attributes.values():
        out |= reads & (np.abs(values[a, ca] - values[b, cb]).max(axis=1) > SAME)
    return out

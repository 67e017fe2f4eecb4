"""Triangle meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._check import array


@dataclass
class Mesh:
    """A triangle mesh in world space, flat-shaded.

    Attributes
    ----------
    vertices
        (n, 3) positions, metres. Vertices may be shared between faces or stored once per face:
        topology is decided by position, so both give the same derivatives.
    faces
        (m, 3) vertex indices, counter-clockwise seen from the front.
    materials
        Names of the materials in the scene that the faces use ("slots").
    face_material
        (m,) index into `materials` for each face; None: all faces use the first one.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    materials: tuple[str, ...]
    face_material: NDArray[np.int32] | None = None

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the mesh and the wrong field."""
        where = f"mesh '{name}'"
        self.vertices = array(where, "vertices", self.vertices, (None, 3), np.float64)
        self.faces = array(where, "faces", self.faces, (None, 3), np.int32)
        if len(self.vertices) == 0 or len(self.faces) == 0:
            raise ValueError(f"{where}: is empty ({len(self.vertices)} vertices, {len(self.faces)} faces)")
        low, high = int(self.faces.min()), int(self.faces.max())
        if low < 0 or high >= len(self.vertices):
            worst = low if low < 0 else high
            raise ValueError(f"{where}: faces name vertex {worst}, but there are {len(self.vertices)} vertices")
        self.materials = tuple(self.materials)
        if not self.materials:
            raise ValueError(f"{where}: materials is empty; name at least one material")
        if self.face_material is not None:
            self.face_material = array(where, "face_material", self.face_material, (len(self.faces),), np.int32)
            low, high = int(self.face_material.min()), int(self.face_material.max())
            if low < 0 or high >= len(self.materials):
                raise ValueError(f"{where}: face_material names slot {low if low < 0 else high}, "
                                 f"but there are {len(self.materials)} materials")

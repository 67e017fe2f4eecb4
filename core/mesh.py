"""Triangle meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import LARGEST_LENGTH, RAYS, array, number, rays


@dataclass
class Mesh:
    """A triangle mesh, in world space unless it has a transform.

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
    smoothing
        (m, 3) the shading normal that each corner has, as an index; -1: the face's own. Corners with the same
        index share one normal, so that a sharp edge is where the indices differ. None: flat. For a mesh
        that is smooth all over and shares its vertices, `faces` itself will do.
    normals
        (k, 3) custom normals by that index, of any length but zero; None: each is the mean of its faces'
        normals, weighted by the corners' angles, and follows the vertices.
    attributes
        UV maps, colours and other values by name: (m, 3, c) at the faces' corners, c from 1 to 4, linear
        in between.
    instances
        (k, 4, 4) affine transforms: the mesh is drawn once for each, sharing one BVH; None: once, as it is.
    transform
        (4, 4) affine transform of the whole object, after `instances`: a point v of the mesh is drawn at
        transform * v, or at transform * instances[k] * v. Normals and tangents turn with it. Last rows of
        transforms aren't read.
    visible_to
        Kinds of rays that meet the mesh: a subset of "camera", "diffuse", "glossy", "transmission", "shadow".
    terminator_offset
        In [0, 1]: how far shadow rays from flat-lying light start off a smooth-shaded surface (Blender's
        shadow terminator geometry offset); 0: they start on the triangles themselves, which then shade
        themselves.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    materials: tuple[str, ...]
    face_material: NDArray[np.int32] | None = None
    smoothing: NDArray[np.int32] | None = None
    normals: NDArray[np.float64] | None = None
    attributes: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    instances: NDArray[np.float64] | None = None
    transform: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    visible_to: frozenset[str] = frozenset(RAYS)
    terminator_offset: float = 0.0

    @property
    def used_materials(self) -> list[str]:
        """Names of the materials that faces have, each slot's once."""
        slots: NDArray[np.int32] | list[int] = [0] if self.face_material is None else np.unique(self.face_material)
        return [self.materials[k] for k in slots]

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the mesh and the wrong field."""
        where = f"mesh '{name}'"
        self.check_vertices(name, None)
        self.faces = array(where, "faces", self.faces, (None, 3), np.int32)
        count = len(self.faces)
        if len(self.vertices) == 0 or count == 0:
            raise ValueError(f"{where}: is empty ({len(self.vertices)} vertices, {count} faces)")
        low, high = int(self.faces.min()), int(self.faces.max())
        if low < 0 or high >= len(self.vertices):
            worst = low if low < 0 else high
            raise ValueError(f"{where}: faces name vertex {worst}, but there are {len(self.vertices)} vertices")
        self.materials = tuple(self.materials)
        if not self.materials:
            raise ValueError(f"{where}: materials is empty; name at least one material")
        if self.face_material is not None:
            self.face_material = array(where, "face_material", self.face_material, (count,), np.int32)
            low, high = int(self.face_material.min()), int(self.face_material.max())
            if low < 0 or high >= len(self.materials):
                raise ValueError(f"{where}: face_material names slot {low if low < 0 else high}, "
                                 f"but there are {len(self.materials)} materials")
        self._validate_normals(where)
        self.attributes = {key: self._attribute(where, key, value) for key, value in self.attributes.items()}
        if self.instances is not None:
            self.instances = array(where, "instances", self.instances, (None, 4, 4), np.float64, most=LARGEST_LENGTH)
            if len(self.instances) == 0:
                raise ValueError(f"{where}: instances is empty; leave the mesh out, or give at least one transform")
            if np.any(np.abs(np.linalg.det(self.instances[:, :3, :3])) < 1e-30):
                raise ValueError(f"{where}: instances has a transform that flattens the mesh")
        self.transform = array(where, "transform", self.transform, (4, 4), np.float64, most=LARGEST_LENGTH)
        if abs(np.linalg.det(self.transform[:3, :3])) < 1e-30:
            raise ValueError(f"{where}: transform flattens the mesh")
        self._check_reach(where)
        self.visible_to = rays(where, "visible_to", self.visible_to)
        self.terminator_offset = number(where, "terminator_offset", self.terminator_offset, least=0.0)

    def check_vertices(self, name: str, count: int | None) -> None:
        """Raise ``ValueError`` where the vertices alone are wrong, or not `count` (None: any number)."""
        self.vertices = array(f"mesh '{name}'", "vertices", self.vertices, (count, 3), np.float64, most=LARGEST_LENGTH)

    def _check_reach(self, where: str) -> None:
        """Refuse a mesh that its transforms place too far away, or make too large."""
        if self.instances is None and np.array_equal(self.transform[:3], np.eye(3, 4)):
            return
        placed = self.transform[None] if self.instances is None else self.transform @ self.instances
        corner = np.abs(self.vertices).max(axis=0)
        reach = float((np.abs(placed[:, :3, :3]) @ corner + np.abs(placed[:, :3, 3])).max())
        if reach > LARGEST_LENGTH:
            moved = "transform" if self.instances is None else "instances"
            raise ValueError(f"{where}: {moved} places vertices up to {reach:.3g} m away; {LARGEST_LENGTH:.3g} m are "
                             "the most; scale the scene down")

    def _validate_normals(self, where: str) -> None:
        if self.smoothing is None:
            if self.normals is not None:
                raise ValueError(f"{where}: normals needs smoothing, which says where each of them is used")
            return
        self.smoothing = array(where, "smoothing", self.smoothing, (len(self.faces), 3), np.int32)
        low, high = int(self.smoothing.min()), int(self.smoothing.max())
        if low < -1:
            raise ValueError(f"{where}: smoothing must not be below -1, but contains {low}")
        if self.normals is not None:
            self.normals = array(where, "normals", self.normals, (None, 3), np.float64)
            if high >= len(self.normals):
                raise ValueError(f"{where}: smoothing names normal {high}, but there are {len(self.normals)} normals")
            if len(self.normals) and np.linalg.norm(self.normals, axis=1).min() == 0.0:
                raise ValueError(f"{where}: normals must not be zero")

    def _attribute(self, where: str, key: str, value: NDArray[np.float32]) -> NDArray[np.float32]:
        out = array(where, f"attribute '{key}'", value, (len(self.faces), 3, None), np.float32)
        if not 1 <= out.shape[2] <= 4:
            raise ValueError(f"{where}: attribute '{key}' must have 1 to 4 values per corner, not {out.shape[2]}")
        return out

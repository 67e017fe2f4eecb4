"""Triangle meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import LARGEST_LENGTH, RAYS, array, mapping, names, number, rays, within
from .._fields import Check, Checked, by, optional

_NO_TRANSFORM = np.eye(4)
_NO_BYTES = _NO_TRANSFORM.tobytes()
# What the name of an attribute ends with that holds tangents and their sign (`Material.normal_uv`).
TANGENT = ".tangent"


def leaves_in_place(transform: NDArray[np.float64]) -> bool:
    """Whether an affine transform (4, 4) changes nothing."""
    return transform.tobytes() == _NO_BYTES or np.array_equal(transform[:3], _NO_TRANSFORM[:3])


def _attribute(where: str, name: str, value: Any) -> NDArray[np.float32]:
    out = array(where, name, value, (None, 3, None), np.float32)
    if not 1 <= out.shape[2] <= 4:
        raise ValueError(f"{where}: {name} must have 1 to 4 values per corner, not {out.shape[2]}")
    return out


def _instance_attribute(where: str, name: str, value: Any) -> NDArray[np.float32]:
    out = array(where, name, value, (None, None), np.float32)
    if not 1 <= out.shape[1] <= 4:
        raise ValueError(f"{where}: {name} must have 1 to 4 values per instance, not {out.shape[1]}")
    return out


@dataclass
class Mesh(Checked):
    """A triangle mesh. Its vertices are in world space unless the mesh has a transform or instances.

    Attributes
    ----------
    vertices
        (n, 3) positions, metres. Vertices may be shared between faces or stored once per face. Both
        give the same derivatives, since the topology is found from the positions.
    faces
        (m, 3) vertex indices, counter-clockwise seen from the front.
    materials
        Names of the materials in the scene that the faces use ("slots").
    face_material
        (m,) index into `materials` for each face; None: all faces use the first one.
    smoothing
        (m, 3) index of the shading normal of each corner; -1: the geometric normal of the face. Corners with the
        same index share one normal; an edge whose corners have different indices is sharp. None: flat shading.
        A smooth mesh with shared vertices can use `faces` here.
    normals
        (k, 3) custom normals, indexed by `smoothing`, of any length but zero. None: each normal is the mean of
        the normals of its faces, weighted by the corner angles, and is differentiated with the vertices.
    attributes
        UV maps, colours and other values by name: (m, 3, c) values at the corners of the faces, c from 1 to 4,
        interpolated linearly.
    instances
        (k, 4, 4) affine transforms: one copy of the mesh for each, all with one shared BVH. None: one mesh without
        an instance transform.
    instance_attributes
        Values of whole instances by name: (k, c) for the k instances, c from 1 to 4. A texture reads them by
        `Attribute`, as it reads `attributes`; a name is in one of the two.
    transform
        (4, 4) affine transform of the whole object, after `instances`: a point v of the mesh is at transform * v,
        or at transform * instances[k] * v, in world space. Normals and tangents are transformed too. The last
        rows of all transforms are ignored.
    visible_to
        Kinds of rays that can hit the mesh: a subset of "camera", "diffuse", "glossy", "transmission", "shadow".
    terminator_offset
        Blender's shadow terminator geometry offset, in [0, 1]: how far above a smooth-shaded surface a shadow ray
        starts if light arrives at a grazing angle. 0: on the triangles, which then shadow each other. Above 0, lights
        and images of environments also reach a face from below its plane, if its smooth normals face them, as in
        Cycles.
    terminator_shading
        Blender's shadow terminator shading offset, in [0, 1]: light at grazing angles is dimmed, so that it fades
        out before the triangles turn away from it.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    materials: tuple[str, ...]
    face_material: NDArray[np.int32] | None = None
    smoothing: NDArray[np.int32] | None = None
    normals: NDArray[np.float64] | None = None
    attributes: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    instances: NDArray[np.float64] | None = None
    instance_attributes: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    transform: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    visible_to: frozenset[str] = frozenset(RAYS)
    terminator_offset: float = 0.0
    terminator_shading: float = 0.0

    checks: ClassVar[Mapping[str, Check]] = {
        "vertices": by(array, (None, 3), np.float64, most=LARGEST_LENGTH),
        "faces": by(array, (None, 3), np.int32),
        "materials": by(names, "names of materials"),
        "face_material": optional(by(array, (None,), np.int32)),
        "smoothing": optional(by(array, (None, 3), np.int32, least=-1)),
        "normals": optional(by(array, (None, 3), np.float64)),
        "attributes": by(mapping, _attribute),
        "instances": optional(by(array, (None, 4, 4), np.float64, most=LARGEST_LENGTH)),
        "instance_attributes": by(mapping, _instance_attribute),
        "transform": by(array, (4, 4), np.float64, most=LARGEST_LENGTH),
        "visible_to": rays,
        "terminator_offset": by(number, least=0.0, greatest=1.0),
        "terminator_shading": by(number, least=0.0, greatest=1.0),
    }

    @property
    def is_single(self) -> bool:
        """Whether the mesh is drawn once, at `transform` of its only instance if it has one."""
        return self.instances is None or len(self.instances) == 1

    @property
    def used_materials(self) -> list[str]:
        """Names of the materials that some face uses, one for each used slot."""
        if self.face_material is None:
            return [self.materials[0]]
        return [self.materials[k] for k in np.flatnonzero(np.bincount(self.face_material))]

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the mesh and the wrong field."""
        where = f"mesh '{name}'"
        self.check_fields(where)
        count = len(self.faces)
        if len(self.vertices) == 0 or count == 0:
            raise ValueError(f"{where}: is empty ({len(self.vertices)} vertices, {count} faces)")
        within(where, "faces", self.faces, len(self.vertices), "name vertex", "vertices")
        if not self.materials:
            raise ValueError(f"{where}: materials is empty; name at least one material")
        if self.face_material is not None:
            self._check_count(where, "face_material", self.face_material, (count,))
            within(where, "face_material", self.face_material, len(self.materials), "names slot", "materials")
        self._validate_normals(where)
        for key, value in self.attributes.items():
            self._check_count(where, f"attributes['{key}']", value, (count, 3, value.shape[2]))
        if self.instances is not None:
            if len(self.instances) == 0:
                raise ValueError(f"{where}: instances is empty; leave the mesh out, or give at least one transform")
            if np.any(np.abs(np.linalg.det(self.instances[:, :3, :3])) < 1e-30):
                raise ValueError(f"{where}: instances has a transform that flattens the mesh")
        if self.instance_attributes:
            self._validate_instance_attributes(where)
        if self.instances is None and leaves_in_place(self.transform):
            return
        if abs(np.linalg.det(self.transform[:3, :3])) < 1e-30:
            raise ValueError(f"{where}: transform flattens the mesh")
        self._check_reach(where)

    def check_vertices(self, name: str, count: int) -> None:
        """Check the vertices alone; raise ``ValueError`` if they are wrong or not `count` many."""
        self.vertices = array(f"mesh '{name}'", "vertices", self.vertices, (count, 3), np.float64, most=LARGEST_LENGTH)

    def _check_reach(self, where: str) -> None:
        """Refuse a mesh whose transformed vertices are too far from the origin."""
        placed = self.transform[None] if self.instances is None else self.transform @ self.instances
        corner = np.abs(self.vertices).max(axis=0)
        reach = float((np.abs(placed[:, :3, :3]) @ corner + np.abs(placed[:, :3, 3])).max())
        if reach > LARGEST_LENGTH:
            moved = "transform" if self.instances is None else "instances"
            raise ValueError(f"{where}: {moved} places vertices up to {reach:.3g} m away; the limit is "
                             f"{LARGEST_LENGTH:.3g} m; scale the scene down")

    def _validate_instance_attributes(self, where: str) -> None:
        if self.instances is None:
            raise ValueError(f"{where}: instance_attributes needs instances; give a mesh without instances its values "
                             "in attributes")
        for key, value in self.instance_attributes.items():
            if len(value) != len(self.instances):
                raise ValueError(f"{where}: instance_attributes['{key}'] has {len(value)} rows, but there are "
                                 f"{len(self.instances)} instances")
            if key in self.attributes:
                raise ValueError(f"{where}: '{key}' is both in attributes and in instance_attributes; rename one")
            if key.endswith(TANGENT):
                raise ValueError(f"{where}: instance_attributes['{key}'] cannot hold tangents, which differ from "
                                 "corner to corner; use attributes")

    def _validate_normals(self, where: str) -> None:
        if self.smoothing is None:
            if self.normals is not None:
                raise ValueError(f"{where}: normals needs smoothing, which assigns a normal to each corner")
            return
        self._check_count(where, "smoothing", self.smoothing, (len(self.faces), 3))
        if self.normals is not None:
            named = self.smoothing[self.smoothing >= 0]
            within(where, "smoothing", named, len(self.normals), "names normal", "normals")
            if len(self.normals) and np.linalg.norm(self.normals, axis=1).min() == 0.0:
                raise ValueError(f"{where}: normals must not be zero")

    def _check_count(self, where: str, name: str, value: NDArray[Any], shape: tuple[int, ...]) -> None:
        if value.shape != shape:
            raise ValueError(f"{where}: {name} must have the shape {shape}, since the mesh has {len(self.faces)} "
                             f"faces, not {value.shape}")

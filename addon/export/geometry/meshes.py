"""Export of evaluated objects to `edgegrad.Mesh`es.

Objects with the same mesh, materials and settings become instances of one mesh.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.geometry.topology import is_closed
from edgegrad.scene.placement import cofactors, is_tangent, placed_tangents, stretches

from ...problem import Report
from ..exported import Source, unused_name
from .attributes import TANGENT, ObjectValues, is_of_object, read_attributes
from .group import Group, Placed, Terminator
from .memory import Memory
from .mesh import MeshArrays, evaluated_mesh, read_mesh
from .normals import coarse_share, given_normals
from .visibility import terminator_offsets

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


# Share of a mesh's area that must be coarse for a warning.
COARSE_AREA = 0.05


class PlacedMeshes:
    """Collects evaluated objects while Blender's iterator runs; `build` then makes the meshes of the scene.

    Parameters
    ----------
    memory
        Of earlier exports of the scene; None: there are none.
    framed, own_space
        Keys of the materials with normal maps in tangent space, and of those whose meshes Cycles renders in their own
        space.
    """

    def __init__(self, report: Report, memory: Memory | None = None) -> None:
        self._report = report
        self._memory = memory
        self.framed: set[str] = set()
        self.own_space: set[str] = set()
        self._uses: Counter[tuple[Any, ...]] = Counter()  # of meshes with their materials
        self._arrays: dict[int, MeshArrays] = {}
        self._groups: dict[tuple[Any, ...], Group] = {}

    def add(self, placed: Placed, names: set[str]) -> None:
        """Read the mesh of an object, with the attributes of these names."""
        with evaluated_mesh(placed.object) as data:
            self._add(placed, data, placed.object.data.as_pointer(), names)

    def _add(self, placed: Placed, data: Any, pointer: int, names: set[str]) -> None:
        if pointer not in self._arrays:
            known = self._memory
            self._arrays[pointer] = read_mesh(data) if known is None else known.read(placed.source.object, data)
        arrays = self._arrays[pointer]
        self.place(placed, pointer, arrays, len(data.loops), names,
                   partial(read_attributes if self._memory is None else self._memory.attributes,
                           data, arrays, sorted(names)))  # fmt: skip

    def place(self, placed: Placed, shape: Any, arrays: MeshArrays, corner_count: int, names: set[str],
              attributes: Callable[[ObjectValues], dict[str, F32]]) -> None:  # fmt: skip
        """Add a mesh that has been read.

        Parameters
        ----------
        shape
            Key of the mesh; objects with equal keys become instances of one mesh.
        corner_count
            Corners of Blender's mesh.
        names
            Attributes that the materials need.
        attributes
            Called for their values if the mesh is not an instance.
        """
        ob = placed.object
        if not len(arrays.faces):
            if len(arrays.positions):  # else its modifiers make only instances, hair or points
                self._report.warn(f"object '{placed.source.object}'", "has no faces; it is left out")
            return
        flat = abs(np.linalg.det(placed.source.matrix[:3, :3])) < 1e-30
        terminator = _terminator(ob)
        values = placed.values
        found = {name: values.value(name) for name in sorted(names) if is_of_object(name)}
        own = {name: value for name, value in found.items() if value is not None}
        key = (shape, placed.slots, placed.visible, placed.holdout, terminator, placed.holder if placed.apart else None,
               tuple((name, len(value)) for name, value in own.items()),
               len(self._groups) if flat or (placed.single and own) else None)  # fmt: skip
        if key not in self._groups:
            # What has been read may be that of another object with the same mesh.
            read = dict(attributes(values))
            read |= {name: np.full((*arrays.faces.shape, len(value)), value, np.float32)
                     for name, value in own.items() if name in read}
            self._groups[key] = Group(arrays, read, placed.slots, placed.visible, terminator,
                                      placed.holdout, corner_count=corner_count, singular=flat)  # fmt: skip
            if flat and np.ptp(arrays.positions, axis=0).min() > 0.0:
                self._groups[key].flattened = True
                self._groups[key].shadowed = _shadows_itself(placed, arrays)
        self._uses[key[:2]] += 1
        self._groups[key].sources.append(placed.source)
        self._groups[key].holders.append(placed.holder)
        for name, value in own.items():
            self._groups[key].own.setdefault(name, []).append(value)

    def leave_out_unseen(self) -> None:
        """Leave out meshes that Cycles renders in their own space, to which no ray leads if a scale is zero.

        To be called when all meshes have been added.
        """
        for key, group in list(self._groups.items()):
            if group.singular and self._in_own_space(key):
                del self._groups[key]
                self._report.warn(f"object '{group.sources[0].object}'", "has a scale of zero along an axis, and its "
                                  "mesh is shared with other objects, displaced or scatters light below its surface: "
                                  "it is left out, since Cycles does not show it")  # fmt: skip

    def _in_own_space(self, key: tuple[Any, ...]) -> bool:
        """Whether Cycles does not place the vertices of a mesh in the world before it renders."""
        return self._uses[key[:2]] > 1 or not self.own_space.isdisjoint(key[1])

    def groups(self) -> list[Group]:
        """Return the collected meshes, each with all its instances."""
        return list(self._groups.values())

    def build(self, sources: dict[str, Source]) -> dict[str, edgegrad.Mesh]:
        """Make the meshes of the scene by name; store the origin of each in `sources`."""
        out: dict[str, edgegrad.Mesh] = {}
        for key, group in self._groups.items():
            first = group.sources[0]
            group.framed = not self.framed.isdisjoint(group.slots)
            group.own_space = self._in_own_space(key)
            self._warn_of_coarse(group)
            if len(group.sources) == 1:
                name = unused_name(first, group.holders[0], out)
            else:
                first.instance = True
                first.objects = tuple(dict.fromkeys(source.object for source in group.sources))
                name = unused_name(first, first.object, out)
            out[name] = self._built(name, group)
            sources[name] = first
        return out

    def _built(self, name: str, group: Group) -> edgegrad.Mesh:
        if self._memory is None:
            return _built(group)
        matrices = [source.matrix for source in group.sources]
        return self._memory.built(name, group, matrices, partial(_built, group))

    def _warn_of_coarse(self, group: Group) -> None:
        """Warn of meshes without a terminator offset whose smooth normals lie far from those of their triangles.

        Hair and points are made so.
        """
        arrays = group.arrays
        if not group.corner_count or group.terminator.geometry > 0.0 or self._memory is not None:
            return
        if coarse_share(arrays.positions, arrays.faces, arrays.smoothing, arrays.normals) > COARSE_AREA:
            for name in dict.fromkeys(source.object for source in group.sources):
                self._report.warn(f"object '{name}'", "is shaded smooth but coarse, without a shadow terminator "
                                  "offset: light from below its triangles is left out, with which Cycles lights them "
                                  "where their smooth normals allow it")  # fmt: skip


def _shadows_itself(placed: Placed, arrays: MeshArrays) -> bool:
    """Whether a flattened mesh lies exactly in a plane across an axis of the world, and closed, twice or more.

    Cycles places the vertices of objects that do not share their mesh in the world before it renders.
    """
    across = not placed.source.matrix[:3, :3].any(axis=1).all()
    alone = not placed.source.instance and placed.object.original.data.users == 1
    return across and alone and is_closed(arrays.faces, np.arange(len(arrays.positions)))


def _terminator(ob: Any) -> Terminator:
    """Read the offsets of the shadow terminator."""
    return Terminator(*(float(getattr(holder, name)) for holder, name in terminator_offsets(ob)))


def _materials(group: Group) -> dict[str, Any]:
    # Cycles uses the last slot for larger indices.
    return {"materials": group.slots, "face_material": np.clip(group.arrays.slots, 0, len(group.slots) - 1)}


def _built(group: Group, given: bool | None = None, moved: bool | None = None) -> edgegrad.Mesh:
    """Make the mesh of a group.

    Parameters
    ----------
    given, moved
        Whether it has custom normals, and whether one object has a transform. None: if they are needed.
    """
    if len(group.sources) > 1:
        return _with_instances(group, given)
    matrix = group.sources[0].matrix
    if not (_needs_transform(group, matrix[:3, :3]) if moved is None else moved):
        return _in_world(group, matrix, given)
    mesh = replace(_in_own_space(group, given), transform=matrix)
    # An instance is rendered in its own space. A mesh with a transform is so if a shader reads its tangents.
    return replace(mesh, instances=np.eye(4)[None]) if group.own_space else mesh


def _needs_transform(group: Group, linear: F64) -> bool:
    """Whether shading of one object needs the mesh in object space.

    Under a non-uniform scale, normals that are interpolated in object space differ from those that are interpolated in
    world space, and tangents of normal maps in world space cannot express the scale.
    """
    if abs(np.linalg.det(linear)) < 1e-30 or not stretches(linear):
        return False
    mapped = group.framed and any(name.endswith(TANGENT) for name in group.attributes)
    return mapped or (group.own_space and group.corner_count > 0 and group.arrays.smoothing is not None)


def _in_own_space(group: Group, given: bool | None) -> edgegrad.Mesh:
    """Make a mesh in object space."""
    arrays = group.arrays
    vertices = arrays.positions.astype(np.float64)
    normals = None
    if arrays.smoothing is not None and arrays.normals is not None:
        normals = given_normals(vertices, arrays.faces, arrays.smoothing, arrays.normals.astype(np.float64),
                                arrays.exact, given)  # fmt: skip
    return edgegrad.Mesh(vertices, arrays.faces.copy(), smoothing=arrays.smoothing, normals=normals,
                         attributes=group.attributes, visible_to=group.visible,
                         terminator_offset=group.terminator.geometry,
                         terminator_shading=group.terminator.shading, **_materials(group))  # fmt: skip


def _with_instances(group: Group, given: bool | None) -> edgegrad.Mesh:
    """Make a mesh in object space, with the transforms and the values of all objects."""
    mesh = _in_own_space(group, given)
    return replace(
        mesh, instances=np.stack([source.matrix for source in group.sources]),
        attributes={name: value for name, value in mesh.attributes.items() if name not in group.own},
        instance_attributes={name: np.array(values, np.float32) for name, values in group.own.items()
                             if name in mesh.attributes},
    )  # fmt: skip


def _in_world(group: Group, matrix: F64, given: bool | None) -> edgegrad.Mesh:
    """Make a mesh in world space; a mirrored mesh keeps the orientation of its faces."""
    arrays = group.arrays
    linear = matrix[:3, :3]
    flat = abs(np.linalg.det(linear)) < 1e-30
    vertices = np.ascontiguousarray(arrays.positions @ linear.T + matrix[:3, 3], np.float64)
    faces, smoothing, normals = arrays.faces, arrays.smoothing, None
    if smoothing is not None and arrays.normals is not None and not flat:
        # A non-uniform scale changes the angles of the triangles, and thus the angle-weighted normals.
        turned = arrays.normals @ np.linalg.inv(linear)
        exact = arrays.exact and not stretches(linear)
        normals = given_normals(vertices, faces, smoothing, turned, exact, given)
    attributes = {
        name: _turned(matrix[None, :3], value) if is_tangent(name, value) and not flat else value
        for name, value in group.attributes.items()
    }
    if np.linalg.det(linear) < 0.0:
        faces = faces[:, ::-1]
        smoothing = None if smoothing is None else smoothing[:, ::-1]
        attributes = {name: value[:, ::-1] for name, value in attributes.items()}
    return edgegrad.Mesh(vertices, np.array(faces), smoothing=None if smoothing is None else np.array(smoothing),
                         normals=normals, attributes={k: np.ascontiguousarray(v) for k, v in attributes.items()},
                         visible_to=group.visible, terminator_offset=group.terminator.geometry,
                         terminator_shading=group.terminator.shading,
                         **_materials(group))  # fmt: skip


def _turned(place: F64, tangents: F32) -> F32:
    """Return tangents (m, 3, 4) in world space, as normals are turned.

    Under a non-uniform scale they change their lengths, so that they are interpolated as in object space.
    """
    if not stretches(place[0, :, :3]):
        return placed_tangents(place, tangents)
    out = tangents.copy()
    out[..., :3] = tangents[..., :3] @ cofactors(place)[0].T
    return out

"""What the first of several exports of a scene leaves for the next ones.

Exports that differ by one value of Blender share nearly everything. Topology, triangulation and groups of normals are
those of the first export, so that the arrays of two exports have the same meaning. A mesh whose arrays are equal is the
same object in both, which makes their comparison cheap.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import edgegrad
from edgegrad.scene.changes import StructureChange
from edgegrad.scene.placement import is_moved

from .attributes import ObjectValues, read_attributes
from .group import Group
from .mesh import MeshArrays, corner_vertices, positions, read_mesh
from .normals import corner_normals, shares_normals, usable, vertex_normals


@dataclass
class _Read:
    """A mesh as it was read first and last."""

    corner: Any
    first: MeshArrays
    last: MeshArrays


@dataclass
class _Built:
    """A mesh of the scene as it was built last, and what it was built from."""

    arrays: MeshArrays
    matrices: list[Any]
    attributes: dict[str, Any]
    own: dict[str, Any]
    mesh: edgegrad.Mesh


@dataclass
class Memory:
    """Meshes that an earlier export of the same scene has read and built.

    Attributes
    ----------
    without_normals
        Names of meshes that get no normals but those of their triangles, which follow their vertices.
    widths
        Widths of the images of baked worlds.
    """

    without_normals: set[str] = field(default_factory=set)
    widths: dict[str, int] = field(default_factory=dict)
    _read: dict[tuple[str, int], _Read] = field(default_factory=dict)
    _built: dict[str, _Built] = field(default_factory=dict)
    _count: Counter[str] = field(default_factory=Counter)

    def begin(self) -> None:
        """Begin the next export."""
        self._count.clear()

    def read(self, name: str, mesh: Any) -> MeshArrays:
        """Read an evaluated mesh of the object of this name; its meshes come in the same order in each export."""
        key = name, self._count[name]
        self._count[name] += 1
        known = self._read.get(key)
        if known is None:
            arrays = read_mesh(mesh)
            self._read[key] = _Read(corner_vertices(mesh), arrays, arrays)
            return arrays
        if len(mesh.vertices) != len(known.first.positions) or not np.array_equal(corner_vertices(mesh), known.corner):
            raise StructureChange(f"the topology of object '{name}' changes")
        now, last = positions(mesh), known.last
        normals = _normals(mesh, known.first)
        if not (np.array_equal(now, last.positions) and _same(normals, last.normals)):
            known.last = replace(known.first, positions=now, normals=normals)
        return known.last

    def attributes(self, mesh: Any, arrays: MeshArrays, names: list[str], of: ObjectValues) -> dict[str, Any]:
        """Read attributes of a mesh, as `read_attributes` does."""
        return read_attributes(mesh, arrays, names, of)

    def built(self, name: str, group: Group, matrices: list[Any],
              build: Callable[[bool | None, bool | None], edgegrad.Mesh]) -> edgegrad.Mesh:  # fmt: skip
        """Return the last mesh if nothing has changed; else build it.

        `build` is given whether the mesh has custom normals, and whether it has a transform; None: it decides.
        """
        arrays, attributes, own = group.arrays, group.attributes, group.own
        known = self._built.get(name)
        if known is not None and known.arrays is arrays and known.own == own:
            same = len(known.matrices) == len(matrices) and all(map(np.array_equal, known.matrices, matrices))
            same = same and known.attributes.keys() == attributes.keys()
            if same and all(np.array_equal(attributes[key], value) for key, value in known.attributes.items()):
                return known.mesh
        given = None if known is None else known.mesh.normals is not None
        moved = None if known is None else is_moved(known.mesh)
        mesh = build(False if name in self.without_normals else given, moved)
        self._built[name] = _Built(arrays, matrices, attributes, own, mesh)
        return mesh


def _normals(mesh: Any, first: MeshArrays) -> Any:
    """Read the normals of the groups of the first reading."""
    if first.normals is None or first.smoothing is None:
        return None
    if shares_normals(mesh) and len(first.normals) == len(mesh.vertices):
        return usable(vertex_normals(mesh))
    out = first.normals.copy()
    smooth = first.smoothing >= 0
    out[first.smoothing[smooth]] = corner_normals(mesh)[first.corners[smooth]]
    return usable(out)


def _same(a: Any, b: Any) -> bool:
    return a is b or (a is not None and b is not None and np.array_equal(a, b))

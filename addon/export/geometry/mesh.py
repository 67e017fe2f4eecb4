"""Evaluated meshes as arrays, read by Blender's bulk functions instead of loops over items."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .normals import read_normals


@dataclass
class MeshArrays:
    """A mesh in object space with n vertices, m triangles and c corners of Blender's polygons.

    Attributes
    ----------
    positions
        (n, 3) float32.
    faces
        (m, 3) vertex indices of the triangles.
    corners
        (m, 3) corner of Blender's mesh for each corner of a triangle.
    polygons
        (m,) polygon that contains each triangle.
    slots
        (m,) material index of each triangle.
    smoothing
        (m, 3) as in `edgegrad.Mesh.smoothing`; None: flat.
    normals
        (k, 3) Blender's normals, indexed by `smoothing`; None: flat.
    exact
        Whether the normals certainly equal the angle-weighted normals of the triangles.
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.int32]
    corners: NDArray[np.int32]
    polygons: NDArray[np.int32]
    slots: NDArray[np.int32]
    smoothing: NDArray[np.int32] | None = None
    normals: NDArray[np.float32] | None = None
    exact: bool = True


@contextmanager
def evaluated_mesh(ob: Any) -> Iterator[Any]:
    """Provide the mesh of an evaluated object.

    In edit mode, Blender's evaluated mesh has no arrays, so they are made in a temporary copy, as Cycles does. (With
    `preserve_all_data_layers`, Blender would also evaluate modifiers that are off in edit mode.)
    """
    if not ob.data.is_editmode:
        yield ob.data
        return
    try:
        yield ob.to_mesh()
    finally:
        ob.to_mesh_clear()


def positions(mesh: Any) -> NDArray[np.float32]:
    """(n, 3) positions of the vertices of a mesh."""
    out = np.empty((len(mesh.vertices), 3), np.float32)
    if len(out):
        mesh.attributes["position"].data.foreach_get("vector", out.ravel())
    return out


def corner_vertices(mesh: Any) -> NDArray[np.int32]:
    """(c,) vertex of each face corner."""
    out = np.empty(len(mesh.loops), np.int32)
    if len(out):
        mesh.attributes[".corner_vert"].data.foreach_get("value", out)
    return out


def triangle_corners(triangles: Any) -> NDArray[np.int32]:
    """(m, 3) corners of the polygons for each corner of Blender's triangles.

    Blender's bulk function is slow here, since it makes a call for each number. The numbers are one array in memory, as
    the addresses of the triangles show.
    """
    count = len(triangles)
    out = np.empty((count, 3), np.int32)
    if count:
        start = triangles[0].as_pointer()
        if all(triangles[k].as_pointer() == start + k * out.strides[0] for k in (count // 2, count - 1)):
            ctypes.memmove(out.ctypes.data, start, out.nbytes)
            if all(tuple(triangles[k].loops) == tuple(out[k]) for k in (0, count // 2, count - 1)):
                return out
        triangles.foreach_get("loops", out.ravel())
    return out


def read_mesh(mesh: Any) -> MeshArrays:
    """Read positions, triangles and shading normals of a mesh, with the triangulation of Blender and Cycles."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners = triangle_corners(mesh.loop_triangles)
    polygon = np.empty(count, np.int32)
    slots = np.zeros(count, np.int32)
    if count:
        mesh.loop_triangle_polygons.foreach_get("value", polygon)
    # The attribute is absent if all faces use the first material.
    attribute = mesh.attributes.get("material_index")
    if attribute is not None and attribute.domain == "FACE" and attribute.data_type == "INT" and count:
        of_polygon = np.empty(len(mesh.polygons), np.int32)
        attribute.data.foreach_get("value", of_polygon)
        slots = of_polygon.take(polygon)
    vertex = corner_vertices(mesh)
    out = MeshArrays(positions(mesh), vertex.take(corners), corners, polygon, slots)
    if count:
        shading = read_normals(mesh, out.positions, vertex, out.faces, corners, polygon)
        if shading is not None:
            out.smoothing, out.normals, out.exact = shading
    return out

"""Evaluated meshes as arrays, with the calls that copy memory instead of walking item by item."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .normals import read_normals


@dataclass
class MeshArrays:
    """A mesh in its own space: n vertices, m triangles, c corners of Blender's polygons.

    Attributes
    ----------
    positions
        (n, 3) float32.
    faces
        (m, 3) vertex indices, triangles.
    corners
        (m, 3) the corner of Blender's mesh that each triangle's corner is.
    polygons
        (m,) the polygon that each triangle is a part of.
    slots
        (m,) material index of each triangle.
    smoothing
        (m, 3) as `edgegrad.Mesh.smoothing`; None: flat.
    normals
        (k, 3) Blender's normals by that index; None: flat.
    exact
        Whether those normals are certainly the angle-weighted ones of the triangles.
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.int32]
    corners: NDArray[np.int32]
    polygons: NDArray[np.int32]
    slots: NDArray[np.int32]
    smoothing: NDArray[np.int32] | None = None
    normals: NDArray[np.float32] | None = None
    exact: bool = True


def positions(mesh: Any) -> NDArray[np.float32]:
    """(n, 3) positions of a mesh's vertices."""
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


def read_mesh(mesh: Any) -> MeshArrays:
    """Positions, triangles and shading normals of a mesh; triangulated as Blender and Cycles do."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners = np.empty((count, 3), np.int32)
    polygon = np.empty(count, np.int32)
    slots = np.zeros(count, np.int32)
    if count:
        mesh.loop_triangles.foreach_get("loops", corners.ravel())
        mesh.loop_triangle_polygons.foreach_get("value", polygon)
    # The attribute is absent when all faces use the first material.
    attribute = mesh.attributes.get("material_index")
    if attribute is not None and attribute.domain == "FACE" and attribute.data_type == "INT" and count:
        of_polygon = np.empty(len(mesh.polygons), np.int32)
        attribute.data.foreach_get("value", of_polygon)
        slots = of_polygon[polygon]
    vertex = corner_vertices(mesh)
    out = MeshArrays(positions(mesh), vertex[corners], corners, polygon, slots)
    if count:
        shading = read_normals(mesh, vertex, corners, polygon)
        if shading is not None:
            out.smoothing, out.normals, out.exact = shading
    return out

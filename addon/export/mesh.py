"""Evaluated meshes as arrays, with the calls that copy memory instead of walking item by item."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass
class MeshArrays:
    """A mesh in its own space.

    Attributes
    ----------
    positions
        (n, 3) float32.
    faces
        (m, 3) vertex indices, triangles.
    slots
        (m,) material index of each triangle.
    smooth
        Whether Blender shades it differently from its flat faces.
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.int32]
    slots: NDArray[np.int32]
    smooth: bool


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
    """Positions and triangles of a mesh; triangulated as Blender and Cycles do."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners = np.empty(3 * count, np.int32)
    polygon = np.empty(count, np.int32)
    slots = np.zeros(count, np.int32)
    if count:
        mesh.loop_triangles.foreach_get("loops", corners)
        mesh.loop_triangle_polygons.foreach_get("value", polygon)
    # The attribute is absent when all faces use the first material.
    attribute = mesh.attributes.get("material_index")
    if attribute is not None and attribute.domain == "FACE" and attribute.data_type == "INT" and count:
        of_polygon = np.empty(len(mesh.polygons), np.int32)
        attribute.data.foreach_get("value", of_polygon)
        slots = of_polygon[polygon]
    faces = corner_vertices(mesh)[corners].reshape(-1, 3)
    return MeshArrays(positions(mesh), faces, slots, _is_smooth(mesh))


def _is_smooth(mesh: Any) -> bool:
    if mesh.normals_domain == "FACE" or not len(mesh.polygons):
        return False
    normals = np.empty((len(mesh.polygons), 3), np.float32)
    mesh.polygon_normals.foreach_get("vector", normals.ravel())
    return bool(np.ptp(normals, axis=0).max() > 1e-5)  # a smooth plane is flat

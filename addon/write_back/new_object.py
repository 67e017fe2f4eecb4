"""A new object from the surface of a field, with the materials, UV maps and colours of the object that it replaces."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

from ..export.geometry.mesh import corner_vertices, positions
from ..export.geometry.visibility import RAYS
from ..problem import Problem
from .painted import Layers, paint

F64 = NDArray[np.float64]

SUFFIX = " (field)"


def check_object(ob: Any) -> None:
    """Raise `Problem` unless the object can be replaced as it is now."""
    if ob.mode == "EDIT":
        raise Problem(f"object '{ob.name}': is in edit mode; leave it first")
    if abs(np.linalg.det(np.array(ob.matrix_world, np.float64)[:3, :3])) < 1e-30:
        raise Problem(f"object '{ob.name}': is scaled to zero, so no new object can have its place; change its scale")


def make_object(ob: Any, points: F64, triangles: NDArray[Any], layers: Layers, material: str | None) -> Any:
    """Make an object of the surface, which is in world space, beside the object `ob`, and hide that one.

    The new object has the place and the parent of the old one, but none of its modifiers. An empty stays visible, since
    it is not rendered. `layers` and `material` are fitted values of the material (`painted.paint`); none: the object
    has the old one's materials.
    """
    mesh = bpy.data.meshes.new(f"{ob.name}{SUFFIX}")
    matrix = np.linalg.inv(np.array(ob.matrix_world, np.float64))
    fill(mesh, points @ matrix[:3, :3].T + matrix[:3, 3],
         triangles if np.linalg.det(matrix[:3, :3]) > 0.0 else triangles[:, ::-1])  # fmt: skip
    made = bpy.data.objects.new(f"{ob.name}{SUFFIX}", mesh)
    for collection in ob.users_collection:
        collection.objects.link(made)
    made.parent, made.parent_type, made.parent_bone = ob.parent, ob.parent_type, ob.parent_bone
    made.matrix_parent_inverse = ob.matrix_parent_inverse
    made.matrix_world = ob.matrix_world
    for ray in RAYS:
        setattr(made, f"visible_{ray}", getattr(ob, f"visible_{ray}"))
    if ob.type != "EMPTY":
        for slot in ob.material_slots:
            mesh.materials.append(slot.material)
        carry_over(ob, mesh)
        ob.hide_render = True
        ob.hide_viewport = True
    if layers:
        paint(mesh, layers, material)
    return made


def make_free_object(
    name: str, points: F64, triangles: NDArray[Any], layers: Layers, material: str | None
) -> None:
    """Make an object of a surface in world space, whose old object is gone, in the scene's own collection."""
    mesh = bpy.data.meshes.new(f"{name}{SUFFIX}")
    fill(mesh, points, triangles)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(mesh.name, mesh))
    if layers:
        paint(mesh, layers, material)


def fill(mesh: Any, vertices: F64, faces: NDArray[Any]) -> None:
    """Give a mesh without geometry these vertices and triangles, shaded smooth."""
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(3 * len(faces))
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(faces, np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(faces), 3, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.update(calc_edges=True)
    mesh.validate()


def carry_over(ob: Any, mesh: Any) -> None:
    """Carry material indices, UV maps and colour attributes from the object's evaluated mesh to a mesh of triangles.

    Each new face takes material and UV maps from the old triangle that is nearest to its centre, and its corners from
    the plane of this triangle: so no face crosses a seam. Each new vertex takes its colours from the nearest triangle.
    """
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    old = evaluated.to_mesh()
    try:
        old.calc_loop_triangles()
        count = len(old.loop_triangles)
        if not count:
            return
        corners, polygons = np.empty((count, 3), np.int32), np.empty(count, np.int32)
        old.loop_triangles.foreach_get("loops", corners.ravel())
        old.loop_triangles.foreach_get("polygon_index", polygons)
        owner = corner_vertices(old)
        triangles = positions(old).astype(np.float64)[owner[corners]]
        points = positions(mesh).astype(np.float64)
        places = points[corner_vertices(mesh)].reshape(-1, 3, 3)
        nearest = _nearest(triangles, places.mean(axis=1))
        weights = _weights(triangles[nearest], places)
        indices = np.empty(len(old.polygons), np.int32)
        old.polygons.foreach_get("material_index", indices)
        mesh.polygons.foreach_set("material_index", indices[polygons[nearest]])
        for layer in old.uv_layers:
            values = np.empty((len(old.loops), 2), np.float32)
            layer.data.foreach_get("uv", values.ravel())
            made = mesh.uv_layers.new(name=layer.name, do_init=False)
            made.data.foreach_set("uv", _mixed(values[corners[nearest]], weights).ravel())
        if old.color_attributes:
            nearest = _nearest(triangles, points)
            weights = _within(_weights(triangles[nearest], points[:, None]))
        for attribute in old.color_attributes:
            values = np.empty((len(attribute.data), 4), np.float32)
            attribute.data.foreach_get("color", values.ravel())
            of_corner = owner[corners[nearest]] if attribute.domain == "POINT" else corners[nearest]
            made = mesh.color_attributes.new(attribute.name, attribute.data_type, "POINT")
            made.data.foreach_set("color", _mixed(values[of_corner], weights).ravel())
    finally:
        evaluated.to_mesh_clear()


def _nearest(triangles: F64, points: F64) -> NDArray[np.int64]:
    """Index of the triangle that is nearest to each point."""
    flat = triangles.reshape(-1, 3)
    tree = BVHTree.FromPolygons(flat.tolist(), np.arange(len(flat)).reshape(-1, 3).tolist(), all_triangles=True)
    return np.array([tree.find_nearest(Vector(point))[2] for point in points.tolist()], np.int64)


def _weights(triangles: F64, places: F64) -> F64:
    """Barycentric coordinates (n, p, 3) of the projections of places (n, p, 3) to the plane of each triangle."""
    edge = triangles[:, 1:] - triangles[:, :1]
    gram = np.einsum("nik,njk->nij", edge, edge)
    sides = np.einsum("nik,npk->npi", edge, places - triangles[:, :1])
    # Triangles without an area have no such coordinates; their first corner is taken.
    scale = gram[:, 0, 0] * gram[:, 1, 1]
    usable = np.linalg.det(gram) > 1e-12 * scale
    two = np.zeros(sides.shape)
    two[usable] = np.linalg.solve(gram[usable][:, None], sides[usable][..., None])[..., 0]
    return np.concatenate([1.0 - two.sum(axis=2, keepdims=True), two], axis=2)


def _within(weights: F64) -> F64:
    """Move places outside of their triangle to its border, or near to it."""
    weights = np.maximum(weights, 0.0)
    return np.asarray(weights / weights.sum(axis=2, keepdims=True))


def _mixed(values: NDArray[np.float32], weights: F64) -> NDArray[np.float32]:
    """Interpolate values (n, 3, c) of the corners of triangles at places with barycentric coordinates (n, p, 3)."""
    return np.ascontiguousarray(np.einsum("npk,nkc->npc", weights, values), np.float32)

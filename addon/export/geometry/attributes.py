"""Attributes that materials read from meshes: UV maps, colours, coordinates, tangents and values of the object.

Layers of Blender's mesh keep their names. Names in parentheses are other attributes, which have no layer.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad import _native
from edgegrad.expression import Attribute

from .hashes import WORD, name_hash
from .instancers import InstancerValues
from .islands import island_randoms
from .layers import layer_values, property_of
from .mesh import MeshArrays
from .normals import as_rendered, shading_normals, vertex_normals
from .particles import output
from .pointiness import pointiness

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

ACTIVE_UV = "(active UV map)"
ACTIVE_COLOR = "(active color attribute)"
BAKED_UV = "(baked UV)"
GENERATED = "(generated)"
OBJECT = "(object coordinates)"
OBJECT_NORMAL = "(object normal)"
VERTEX_NORMAL = "(vertex normal)"  # Blender's, also of flat faces
POINTINESS = "(pointiness)"
ISLAND = "(random per island)"
EDGE_DISTANCES = "(distances to edges)"
PARAMETRIC = "(place in the triangle)"
RANDOM, INDEX, COLOR, LOCATION = "(object random)", "(object index)", "(object color)", "(object location)"
SCALE, SIDE = "(object scale)", "(object side)"
# Columns of the object's matrix without its location, and rows of the inverse.
AXES = ("(object axis X)", "(object axis Y)", "(object axis Z)")
INVERSE_ROWS = ("(object inverse X)", "(object inverse Y)", "(object inverse Z)")
# Coordinates of the place on the instancer, which are constant on an instance; 0 on objects that are none.
INSTANCER_GENERATED, INSTANCER_UV = "(instancer's generated)", "(instancer's UV)"
BEFORE = "(position before displacement)"
# Alpha that an Attribute node reads of a layer, before the layer's name: 1 if the layer has none, or does not exist; or
# of a property or an attribute of the instancer: 1 if that has none, and 0 if it does not exist.
ALPHA = "(alpha) "
# Number of components of a layer, before its name; 0: it does not exist.
COMPONENTS = "(components) "
PROPERTY = "(object property) "
INSTANCER = "(instancer) "
PARTICLE = "(particle) "
# Values of strands of hair, which other meshes do not have.
IS_STRAND, INTERCEPT, LENGTH = "(is strand)", "(strand intercept)", "(strand length)"
THICKNESS, RANDOM_STRAND = "(strand thickness)", "(strand random)"
TANGENT = ".tangent"
# Tangents that nodes read as vectors in object space, before the names of UV maps and of `AROUND`.
ALONG = "(along) "
# Whether Cycles takes u = 0 and u = 1 on the sphere of meshes without a UV map for the same place. Before Blender 5.0,
# tangents of faces between the two turn around.
CLOSED_SPHERE = bpy.app.version >= (5, 0, 0)
# Tangents around the axes of the object.
AROUND = {"X": "(around X)", "Y": "(around Y)", "Z": "(around Z)"}
POINT_RADIUS, RANDOM_POINT = "(point radius)", "(point random)"

# Values of one object or instance: instances that share a mesh have their own.
OF_OBJECT = (RANDOM, INDEX, COLOR, LOCATION, SCALE, SIDE, *AXES, *INVERSE_ROWS, INSTANCER_GENERATED, INSTANCER_UV)


def layer(name: str) -> Attribute:
    """Expression that reads a layer; 0 on meshes without the layer, as in Blender."""
    return Attribute(name, required=False, is_position=name in (OBJECT, EDGE_DISTANCES))


def is_of_object(name: str) -> bool:
    """Whether an attribute differs between instances of a mesh."""
    return name in OF_OBJECT or name.removeprefix(ALPHA).startswith((PROPERTY, INSTANCER, PARTICLE))


@dataclass(frozen=True)
class ObjectValues:
    """An object or instance whose attributes are read.

    Attributes
    ----------
    object
        The evaluated object.
    matrix
        (4, 4) transform to world space.
    random_id
        Blender's random number of the instance; 0: the object is not an instance.
    instancer
        What it has of its instancer; None: the object is not an instance.
    """

    object: Any
    matrix: F64
    random_id: int
    instancer: InstancerValues | None

    def value(self, name: str) -> tuple[float, ...] | None:
        """Return an attribute of the whole object; None if it has no such property."""
        ob = self.object
        if name.startswith(ALPHA):
            found = self.value(name.removeprefix(ALPHA))
            return None if found is None else (found[3] if len(found) == 4 else 1.0,)
        if name == RANDOM:
            number = self.random_id & WORD if self.random_id else name_hash(ob.original.name)
            return (number / WORD,)
        if name == INDEX:
            return (float(ob.pass_index),)
        if name == COLOR:
            # Blender gives an instance the colour of its outermost instancer.
            return tuple(ob.color if self.instancer is None else self.instancer.instancer.color)
        if name == LOCATION:
            return tuple(self.matrix[:3, 3])
        if name in AXES:
            return tuple(self.matrix[:3, AXES.index(name)])
        if name in INVERSE_ROWS:
            return tuple(np.linalg.pinv(self.matrix[:3, :3])[INVERSE_ROWS.index(name)])
        if name == SCALE:
            return (float(np.cbrt(abs(np.linalg.det(self.matrix[:3, :3])))),)
        if name == SIDE:
            return (-1.0 if np.linalg.det(self.matrix[:3, :3]) < 0.0 else 1.0,)
        if name == INSTANCER_GENERATED:
            return (0.0, 0.0, 0.0) if self.instancer is None else self.instancer.generated
        if name == INSTANCER_UV:
            return (0.0, 0.0) if self.instancer is None else self.instancer.uv
        if name.startswith(PARTICLE):
            return output({} if self.instancer is None else self.instancer.particle, name.removeprefix(PARTICLE))
        if name.startswith(INSTANCER):
            name = name.removeprefix(INSTANCER)
            value = None if self.instancer is None else self.instancer.value(name)
            if value is not None:
                return value
        return property_of((ob, ob.data), name.removeprefix(PROPERTY))


def read_attributes(mesh: Any, arrays: MeshArrays, names: Iterable[str], of: ObjectValues) -> dict[str, F32]:
    """Read attributes (m, 3, c) of a mesh, in object space, by name; leave out those that the mesh does not have."""
    found = {name: _read(mesh, arrays, name, of) for name in names}
    return {name: np.ascontiguousarray(value, np.float32) for name, value in found.items() if value is not None}


def _read(mesh: Any, arrays: MeshArrays, name: str, of: ObjectValues) -> Any:
    if is_of_object(name):
        value = of.value(name)
        if value is None:
            return None
        return np.broadcast_to(np.array(value, np.float32), (*arrays.faces.shape, len(value)))
    if name == GENERATED:
        return _generated(mesh).take(arrays.faces, axis=0)
    if name in (OBJECT, BEFORE):
        return arrays.positions.take(arrays.faces, axis=0)
    if name == OBJECT_NORMAL:
        return shading_normals(arrays.positions, arrays.faces, arrays.smoothing, arrays.normals)
    if name == VERTEX_NORMAL:
        return vertex_normals(mesh).take(arrays.faces, axis=0)
    if name == POINTINESS:
        return pointiness(mesh).take(arrays.faces, axis=0)
    if name == ISLAND:
        return island_randoms(mesh).take(arrays.corners, axis=0)
    if name == EDGE_DISTANCES:
        return _edge_distances(arrays.positions.take(arrays.faces, axis=0))
    if name == PARAMETRIC:
        return np.broadcast_to(_PARAMETRIC, (len(arrays.faces), 3, 3))
    if name.startswith(ALONG):
        return _along(mesh, arrays, name.removeprefix(ALONG), of)
    if name.startswith(ALPHA):
        value = _read(mesh, arrays, name.removeprefix(ALPHA), of)
        has_alpha = value is not None and value.shape[2] == 4
        return value[..., 3:] if has_alpha else np.ones((*arrays.faces.shape, 1), np.float32)
    if name.startswith(COMPONENTS):
        value = _read(mesh, arrays, name.removeprefix(COMPONENTS), of)
        return np.full((*arrays.faces.shape, 1), 0.0 if value is None else value.shape[2], np.float32)
    if name == ACTIVE_COLOR:
        index = mesh.color_attributes.render_color_index
        return _layer(mesh.color_attributes[index], mesh, arrays) if 0 <= index < len(mesh.color_attributes) else None
    layer = uv_layer(mesh, name)
    if layer is not None:
        points = np.empty((len(mesh.loops), 2), np.float32)
        layer.uv.foreach_get("vector", points.ravel())
        return points.take(arrays.corners, axis=0)
    if name.endswith(TANGENT):
        uv_name = name.removesuffix(TANGENT)
        if uv_name in AROUND.values():
            return _radial_tangents(mesh, arrays, uv_name)
        if uv_name == ACTIVE_UV and not mesh.uv_layers:
            return tangents(arrays, around_sphere(mesh).take(arrays.faces, axis=0), around=CLOSED_SPHERE)
        uv = _read(mesh, arrays, uv_name, of) if uv_layer(mesh, uv_name) is not None else None
        return None if uv is None else tangents(arrays, uv)
    return _layer(mesh.attributes.get(name), mesh, arrays)


def uv_layer(mesh: Any, name: str) -> Any:
    """Return the UV map of this name, for ACTIVE_UV the map that is active in renders; None if there is none."""
    if name == ACTIVE_UV:
        return next((layer for layer in mesh.uv_layers if layer.active_render), None)
    return mesh.uv_layers.get(name)


def _layer(layer: Any, mesh: Any, arrays: MeshArrays) -> Any:
    """Read a layer as corner values (m, 3, c). Byte colours are linear, as in Cycles."""
    sizes = {"POINT": len(mesh.vertices), "CORNER": len(mesh.loops), "FACE": len(mesh.polygons),
             "EDGE": len(mesh.edges)}  # fmt: skip
    if layer is not None and sizes.get(layer.domain) != len(layer.data):
        return None
    values = layer_values(layer)
    if values is None:
        return None
    if layer.domain == "POINT":
        return values.take(arrays.faces, axis=0)
    if layer.domain == "EDGE":
        return _at_vertices(mesh, values).take(arrays.corners, axis=0)
    if layer.domain == "CORNER":
        return values.take(arrays.corners, axis=0)
    return np.broadcast_to(values[arrays.polygons][:, None], (*arrays.faces.shape, values.shape[1]))


def _at_vertices(mesh: Any, values: F32) -> F32:
    """(l, c) means over the edges at the vertex of each of l corners, as in Cycles."""
    parts = as_rendered(mesh)
    ends = parts.edges.ravel()
    count = np.maximum(np.bincount(ends, minlength=parts.vertices), 1)
    both = np.repeat(values[parts.origin], 2, axis=0)
    total = [np.bincount(ends, both[:, k], parts.vertices) for k in range(values.shape[1])]
    return (np.stack(total, axis=1) / count[:, None])[parts.corners].astype(np.float32)


def _undeformed(mesh: Any) -> F32:
    """(n, 3) vertices before modifiers and shape keys moved them."""
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("undeformed_co", points.ravel())
    return points


def around_sphere(mesh: Any) -> F32:
    """(n, 2) places on a sphere around the object's origin: Cycles takes tangents from them if there is no UV map."""
    points = _undeformed(mesh)
    x, y, z = points.T
    length = np.linalg.norm(points, axis=1)
    cosine = np.divide(z, length, out=np.ones_like(z), where=length > 0.0)
    across = np.where((x == 0.0) & (y == 0.0), 0.0, 0.5 - np.arctan2(x, y) / np.float32(2.0 * np.pi))
    down = np.arccos(np.clip(cosine, -1.0, 1.0)) / np.float32(np.pi)
    return np.stack([across, np.where(length > 0.0, 1.0 - down, 0.0)], axis=-1).astype(np.float32)


def _generated(mesh: Any) -> F32:
    """(n, 3) coordinates in the texture space of the mesh: its bounding box, unless the user has set it."""
    points = _undeformed(mesh)
    size = np.array(mesh.texspace_size, np.float32)
    scale = np.where(size != 0.0, 0.5 / np.where(size != 0.0, size, 1.0), 0.0)
    return ((points - np.array(mesh.texspace_location, np.float32)) * scale + 0.5).astype(np.float32)


# Cycles' weights of the first two corners of a triangle, at its three corners.
_PARAMETRIC = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]], np.float32)


def _edge_distances(corners: F32) -> F32:
    """(m, 3, 3) distances of corners to the edges of their triangle, each opposite to a corner.

    They are linear within a triangle, so interpolation between corners gives those of each point.
    """
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)[:, None]
    length = np.linalg.norm(edges, axis=-1)
    heights = np.divide(area, length, out=np.zeros_like(length), where=length > 0.0)
    return (heights[:, None] * np.eye(3, dtype=np.float32)).astype(np.float32)


def _along(mesh: Any, arrays: MeshArrays, name: str, of: ObjectValues) -> Any:
    """(m, 3, 3) tangents of a UV map, or around an axis; None: there is no such map."""
    if name in AROUND.values():
        return _around(mesh, arrays, name)
    framed = _read(mesh, arrays, name + TANGENT, of)
    return None if framed is None else framed[..., :3]


def _around(mesh: Any, arrays: MeshArrays, name: str) -> F32:
    """(m, 3, 3) tangents around an axis through the middle of the texture space, as Cycles' Tangent node has them.

    They are linear in the generated coordinates, so interpolation between corners gives those of each point.
    """
    x, y, z = np.moveaxis(_generated(mesh).take(arrays.faces, axis=0) - np.float32(0.5), -1, 0)
    none = np.zeros_like(x)
    around = {AROUND["X"]: (none, -z, y), AROUND["Y"]: (-z, none, x), AROUND["Z"]: (-y, x, none)}
    return np.stack(around[name], axis=-1)


def _radial_tangents(mesh: Any, arrays: MeshArrays, name: str) -> F32:
    """(m, 3, 4) tangents around an axis, with the sign of the bitangents."""
    around = _around(mesh, arrays, name)
    return np.concatenate([around, np.ones_like(around[..., :1])], axis=-1)


def tangents(arrays: MeshArrays, uv: F32, around: bool = False) -> F32:
    """(m, 3, 4) tangents along u and signs of the bitangents; `around`: u = 0 is where u = 1 is."""
    smoothing, normals = arrays.smoothing, arrays.normals
    if smoothing is None or normals is None:
        smoothing, normals = np.full_like(arrays.faces, -1), np.empty((0, 3), np.float32)
    return _native.corner_tangents(arrays.positions, np.ascontiguousarray(arrays.faces),
                                   np.ascontiguousarray(uv, np.float32), np.ascontiguousarray(smoothing), normals,
                                   around, 0)  # fmt: skip

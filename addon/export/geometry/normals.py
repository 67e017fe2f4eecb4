"""Blender's shading normals, as groups of corners with a common normal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import _native

from .splits import SPLITS, Split, split, unsplit

# Normals count as equal to the angle-weighted normals of the triangles if they differ by less. A larger tolerance
# ignores custom normals; a smaller one keeps normals that differ by rounding only, and these do not follow moving
# vertices.
SAME_NORMAL = 2e-3
CHUNK = 1 << 14  # rows that are looked at together: what is computed on the way stays in the cache

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]


def read_normals(mesh: Any, positions: F32, vertex: I32, faces: I32, corners: I32,
                 polygon: I32) -> tuple[I32, F32, bool] | None:  # fmt: skip
    """Read groups of corners with equal normals, the normals, and whether they certainly follow from the triangles.

    Parameters
    ----------
    positions
        (n, 3) of the vertices.
    vertex
        (c,) vertex of each corner.
    faces, corners
        (m, 3) vertex, and corner of Blender's mesh, for each corner of a triangle.
    polygon
        (m,) polygon of each triangle.

    Returns
    -------
    (m, 3) group of each triangle corner, -1 on flat faces; (k, 3) normal of each group; and the flag. None: the whole
    mesh is flat.
    """
    custom = bool(mesh.has_custom_normals)
    if mesh.normals_domain == "FACE" and not custom:
        return None
    exact = len(corners) == len(mesh.polygons) and not custom
    flat = flags(mesh, "sharp_face", len(mesh.polygons))
    if custom and mesh.normals_domain == "CORNER":
        flat[:] = False
    if shares_normals(mesh):
        normals = vertex_normals(mesh)
        smoothing, exact = faces.copy(), exact and not flat.any()
        smoothing[flat.take(polygon)] = -1
    else:
        of_corner = corner_normals(mesh)
        if custom and SPLITS and mesh.attributes["custom_normal"].data_type == "FLOAT_VECTOR":
            of_corner = _shared(mesh, corners, of_corner)
        group, first = _grouped(vertex, of_corner)
        smoothing, normals = group.take(corners), of_corner[first]
        if flat.any():
            of_flat = np.flatnonzero(flat.take(polygon))
            smoothing[of_flat] = -1
            # Cycles then shades all triangles of a flat face by the normal of the face, which may be bent.
            corner, face = corners[of_flat, 0], polygon[of_flat]
            bent = np.zeros(len(flat), bool)
            bent[face[_is_bent(positions.take(faces[of_flat], axis=0), of_corner[corner])]] = True
            smoothing[of_flat[bent[face]]] = (len(normals) - 1 + np.cumsum(bent))[face[bent[face]], None]
            one = np.full(len(flat), -1, np.int32)
            one[face] = corner
            normals = np.concatenate([normals, of_corner[one[bent]]])
    return (smoothing, usable(normals), exact) if (smoothing >= 0).any() else None


def as_rendered(mesh: Any) -> Split:
    """The mesh as Cycles has it, which is split if it has normals of corners."""
    flat = mesh.normals_domain == "FACE" and not mesh.has_custom_normals
    return split(mesh) if SPLITS and not flat and not shares_normals(mesh) else unsplit(mesh)


def _shared(mesh: Any, corners: I32, normals: F32) -> F32:
    """(c, 3) normal of each corner where all corners of a vertex have that of its last triangle."""
    place = split(mesh).corners
    out = np.empty((place.max(initial=-1) + 1, 3), np.float32)
    out[place] = normals  # corners of no triangle
    out[place[corners.ravel()]] = normals[corners.ravel()]  # the last one counts
    return np.ascontiguousarray(out[place])


def _is_bent(triangles: F32, normals: F32) -> NDArray[np.bool_]:
    """(m,) whether the plane of each triangle (m, 3, 3) is not that of its normal (m, 3)."""
    plane = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(plane, axis=1, keepdims=True)
    return np.abs(plane - length * normals).max(axis=1) > SAME_NORMAL * length[:, 0]


def flags(mesh: Any, name: str, count: int) -> NDArray[np.bool_]:
    """(count,) values of an attribute of booleans; false if there is none."""
    out = np.zeros(count, bool)
    attribute = mesh.attributes.get(name)
    if attribute is not None and count:
        attribute.data.foreach_get("value", out)
    return out


def vertex_normals(mesh: Any) -> F32:
    """(v, 3) normal of each vertex."""
    out = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertex_normals.foreach_get("vector", out.ravel())
    return out


def corner_normals(mesh: Any) -> F32:
    """(c, 3) normal of each face corner."""
    out = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", out.ravel())
    return out


def usable(normals: F32) -> F32:
    """Replace zero normals, which loose vertices and degenerate faces have, by +Z: a normal must not be zero."""
    normals[~(np.abs(normals).max(axis=1, initial=0.0) > 0.0)] = (0.0, 0.0, 1.0)
    return normals


def _grouped(vertex: I32, normals: F32) -> tuple[I32, NDArray[np.int64]]:
    """Group the corners by vertex and by the bits of the normal; also return the first corner of each group."""
    return _native.number_equal_keys(bits(vertex, normals))


def bits(*columns: NDArray[Any]) -> NDArray[np.uint64]:
    """A 64-bit hash (FNV-1a on words) of each row, which identifies equal rows."""
    prime = np.uint64(0x100000001B3)
    result = np.full(len(columns[0]), np.uint64(0xCBF29CE484222325))
    for at in range(0, len(result), CHUNK):
        key = result[at:at + CHUNK]
        for column in columns:
            rows = np.ascontiguousarray(column[at:at + CHUNK]).reshape(len(key), -1)
            if rows.dtype == np.float32:
                rows = (rows + np.float32(0.0)).view(np.uint32)  # -0 is 0
            for k in range(rows.shape[1]):
                key ^= rows[:, k].astype(np.uint64)
                key *= prime
                key ^= key >> np.uint64(29)
    return result


def unit(v: F64) -> F64:
    """Return vectors (..., 3) at length 1; zero vectors stay zero."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.divide(v, length, out=np.zeros_like(v), where=length > 1e-30)


def face_normals(positions: F32, faces: I32) -> F64:
    """(m, 3) unit normals of faces."""
    p = positions[faces].astype(np.float64)
    return unit(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))


def shading_normals(positions: F32, faces: I32, smoothing: I32 | None, normals: F32 | None) -> F64:
    """(m, 3, 3) unit shading normal at each corner of the triangles, in object space."""
    out = np.repeat(face_normals(positions, faces)[:, None], 3, axis=1)
    if smoothing is not None and normals is not None:
        smooth = smoothing >= 0
        out[smooth] = unit(normals[smoothing[smooth]].astype(np.float64))
    return out


def shares_normals(mesh: Any) -> bool:
    """Whether all smooth faces around a vertex have its normal, which is that of all its faces, also of flat ones.

    As in Cycles, where this differs from Blender's window: there, a flat face parts the smooth faces beside it, and
    custom normals of faces make them flat, whose means over the faces around a vertex Cycles shows.
    """
    if mesh.has_custom_normals:
        return bool(mesh.normals_domain != "CORNER")
    return mesh.normals_domain == "POINT" or not flags(mesh, "sharp_edge", len(mesh.edges)).any()


def given_normals(vertices: F64, faces: I32, smoothing: I32, normals: F64, exact: bool,
                  given: bool | None = None) -> F64 | None:  # fmt: skip
    """Return unit normals if they differ from the angle-weighted normals of the triangles, else None.

    Parameters
    ----------
    normals
        (k, 3) in the space of the vertices, of any length.
    exact
        Whether they certainly do not differ.
    given
        Whether to return them; None: if they differ.
    """
    if given is not None:
        return _unit(normals) if given else None
    if exact:
        return None
    own = _native.angle_weighted_normals(vertices, np.ascontiguousarray(faces), np.ascontiguousarray(smoothing),
                                         len(normals))  # fmt: skip
    unit = _unit(normals)
    used = _squares(own) > 0.0  # normals that cancel are zero
    np.abs(np.subtract(own, unit, out=own), out=own)
    return unit if any(own[used, k].max(initial=0.0) > SAME_NORMAL for k in range(3)) else None


def _unit(vectors: F64) -> F64:
    return vectors / np.sqrt(_squares(vectors))[:, None]


def _squares(vectors: F64) -> F64:
    """(n,) squared lengths; numpy's own functions are slow along short axes."""
    return np.asarray(np.einsum("nk,nk->n", vectors, vectors))


# Angle between the smooth normal and a triangle above which the triangle is coarse; triangles that are looked at.
COARSE = np.deg2rad(20.0)
MOST_TRIANGLES = 20_000


def coarse_share(positions: NDArray[np.float32], faces: NDArray[np.int32], smoothing: NDArray[np.int32] | None,
                 normals: NDArray[np.float32] | None) -> float:  # fmt: skip
    """Share of a mesh's area whose smooth normals lie far from those of its triangles."""
    if smoothing is None or normals is None or not len(faces):
        return 0.0
    some = slice(None, None, len(faces) // MOST_TRIANGLES + 1)
    corners, smoothing = positions[faces[some]].astype(np.float64), smoothing[some]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(flat, axis=1)
    cosine = np.einsum("fck,fk->fc", normals[smoothing], flat) / np.maximum(area, 1e-30)[:, None]
    coarse = np.where(smoothing >= 0, cosine, 1.0).min(axis=1) < np.cos(COARSE)
    return float(area[coarse].sum() / max(area.sum(), 1e-30))

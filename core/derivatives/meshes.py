"""Derivatives of the tables with respect to meshes: vertices, custom normals, attributes, transforms and instances.

The tables hold a mesh in one of two ways (`placement.stands_in_world`). Either its copies stand in world space, one
after the other, or it is instanced: then its vertices are in its own space, and the transforms M_k (3, 4) of its
instances are rows of `instance_to_world`. In world space, copy k has

- the vertices M_k v,
- the custom normals N_k n / |N_k n|, where N_k is the inverse transpose of the linear part of M_k,
- the tangents |t| N_k t / |N_k t|; all other attributes are copied.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..scene.mesh import Mesh
from ..scene.parameters import layer_of
from ..scene.placement import (
    cofactors,
    composed,
    is_moved,
    is_tangent,
    mirrored,
    places,
    smoothing_groups,
    stands_in_world,
)
from ..scene.scene import Scene
from ..tables.tables import Tables
from .linear_map import F64, Linear, Piece, same


def pieces(scene: Scene, tables: Tables, name: str, field: str) -> list[Piece]:
    """Return the pieces of the tables that depend on one field of a mesh."""
    mesh = scene.meshes[name]
    k = tables.mesh_number[name]
    in_world = stands_in_world(scene, mesh)
    if field in ("transform", "instances"):
        moved = _world_pieces(tables, mesh, k) if in_world else [_instance_piece(tables, k)]
        to_places = _places_by_transform(mesh) if field == "transform" else _places_by_instances(mesh)
        return [piece.after(*to_places) for piece in moved]
    # Whether the tables hold the values of the mesh itself, not those of its copies in the world.
    own = not in_world or (mesh.instances is None and not is_moved(mesh))
    if field == "vertices":
        first, last = tables.mesh_first_vertex[k : k + 2].tolist()
        if own:
            return [same("vertices", first, last, (-1, 3), mesh.vertices.shape)]
        return [Piece("vertices", first, last, *_placed_vertices(places(mesh)))]
    place = places(mesh) if in_world else np.eye(3, 4)[None]
    if field == "normals":
        first, last = tables.mesh_first_normal[k : k + 2].tolist()
        return [Piece("normals", first, last, *_placed_normals(place, mesh))] if last > first else []
    held, layer = layer_of(field) or ("", "")
    if held == "instance_attributes":
        values = mesh.instance_attributes[layer]
        corners = 3 * len(mesh.faces) if in_world else 1
        return [Piece("texture_attributes", first, first + corners * values.size, *_repeated(values.shape, corners))
                for first in _layer_places(tables, k, layer)]
    values = mesh.attributes[layer]
    if own:
        return [same("texture_attributes", first, first + values.size, (-1,), values.shape)
                for first in _layer_places(tables, k, layer)]
    turned = _turned_corners(place, values.shape)
    if is_tangent(layer, values):
        to_copies = _placed_tangents(place, values.astype(np.float64))
    else:
        to_copies = (lambda v: np.broadcast_to(v, (len(place), *v.shape)), lambda g: g.sum(axis=0))
    return [Piece("texture_attributes", first, first + len(place) * values.size, *turned).after(*to_copies)
            for first in _layer_places(tables, k, layer)]


# ---- Derivatives of the transforms of all copies, (k, 3, 4), by `transform` and by `instances` ----
def _places_by_transform(mesh: Mesh) -> tuple[Linear, Linear]:
    inner = np.eye(3, 4)[None] if mesh.instances is None else mesh.instances[:, :3].copy()

    def pull(g: F64) -> F64:
        out = np.zeros((4, 4))
        out[:3, :3] = np.einsum("kil,kjl->ij", g, inner)
        out[:3, 3] = g[:, :, 3].sum(axis=0)
        return out

    return lambda v: composed(v[:3], inner), pull


def _places_by_instances(mesh: Mesh) -> tuple[Linear, Linear]:
    outer = mesh.transform[:3, :3].copy()

    def pull(g: F64) -> F64:
        out = np.zeros((len(g), 4, 4))
        out[:, :3] = outer.T @ g
        return out

    return lambda v: outer @ v[:, :3], pull


# ---- Derivatives of tables by the transforms of all copies ----
def _instance_piece(tables: Tables, k: int) -> Piece:
    first, last = (int(row) for row in np.searchsorted(tables.instance_mesh, [k, k + 1]))  # sorted by mesh
    return same("instance_to_world", first, last, (last - first, 12), (last - first, 3, 4))


def _world_pieces(tables: Tables, mesh: Mesh, k: int) -> list[Piece]:
    place = places(mesh)
    first, last = (int(v) for v in tables.mesh_first_vertex[k : k + 2])
    out = [Piece("vertices", first, last, *_moved_vertices(mesh))]
    if mesh.normals is not None and smoothing_groups(mesh):
        first, last = (int(n) for n in tables.mesh_first_normal[k : k + 2])
        out.append(Piece("normals", first, last, *_turned_normals(place, mesh)))
    for layer, values in mesh.attributes.items():
        if is_tangent(layer, values):
            corners = _turned_corners(place, values.shape)
            out += [Piece("texture_attributes", first, first + len(place) * values.size, *corners)
                    .after(*_turned_tangents(place, values.astype(np.float64)))
                    for first in _layer_places(tables, k, layer)]
    return out


def _moved_vertices(mesh: Mesh) -> tuple[Linear, Linear]:
    vertices = mesh.vertices.copy()  # the caller may change the scene before gradients are pulled back

    def push(v: F64) -> F64:
        return (np.einsum("kij,nj->kni", v[:, :, :3], vertices) + v[:, None, :, 3]).reshape(-1, 3)

    def pull(g: F64) -> F64:
        g = g.reshape(-1, len(vertices), 3)
        return np.concatenate([np.einsum("kni,nj->kij", g, vertices), g.sum(axis=1)[:, :, None]], axis=2)

    return push, pull


def _turned_normals(place: F64, mesh: Mesh) -> tuple[Linear, Linear]:
    turn, turned, unit = _directions(place, _named_normals(mesh))

    def push(v: F64) -> F64:
        return unit(_turn_change(turn, turned, v)).reshape(-1, 3)

    def pull(g: F64) -> F64:
        return _turn_change_back(turn, turned, unit(g.reshape(turned.shape)))

    return push, pull


def _turned_tangents(place: F64, values: F64) -> tuple[Linear, Linear]:
    """Derivative of the tangents and signs of all copies, (k, m, 3, 4)."""
    tangent = values[..., :3].reshape(-1, 3)
    turn, turned, unit = _directions(place, tangent)
    length = np.linalg.norm(tangent, axis=1)[:, None]
    shape = (len(place), *values.shape)

    def push(v: F64) -> F64:
        out = np.zeros(shape)
        out[..., :3] = (length * unit(_turn_change(turn, turned, v))).reshape(*shape[:3], 3)
        return out

    def pull(g: F64) -> F64:
        return _turn_change_back(turn, turned, unit(length * g[..., :3].reshape(turned.shape)))

    return push, pull


def _turn_change(turn: F64, turned: F64, v: F64) -> F64:
    """Tangent of N n, (k, n, 3), along a tangent of the transforms: d(M^-T) = -M^-T dM^T M^-T."""
    return np.asarray(-np.einsum("kij,klj,knl->kni", turn, v[:, :, :3], turned, optimize=True))


def _turn_change_back(turn: F64, turned: F64, g: F64) -> F64:
    out = np.zeros((len(turn), 3, 4))
    out[:, :, :3] = -np.einsum("knl,kni,kij->klj", turned, g, turn, optimize=True)
    return out


# ---- Derivatives of the values of all copies by those of the mesh ----
def _placed_vertices(place: F64) -> tuple[Linear, Linear]:
    linear = place[:, :, :3]
    if np.array_equal(linear, np.eye(3)[None]):
        return lambda v: v, lambda g: g

    def pull(g: F64) -> F64:
        return np.asarray(np.einsum("kij,kni->nj", linear, g.reshape(len(linear), -1, 3), optimize=True))

    return lambda v: np.einsum("kij,nj->kni", linear, v).reshape(-1, 3), pull


def _placed_normals(place: F64, mesh: Mesh) -> tuple[Linear, Linear]:
    assert mesh.normals is not None
    count, total = smoothing_groups(mesh), len(mesh.normals)
    turn, turned, unit = _directions(place, _named_normals(mesh))

    def push(v: F64) -> F64:
        return unit(np.einsum("kij,nj->kni", turn, v[:count])).reshape(-1, 3)

    def pull(g: F64) -> F64:
        out = np.zeros((total, 3))
        out[:count] = np.einsum("kij,kni->nj", turn, unit(g.reshape(turned.shape)), optimize=True)
        return out

    return push, pull


def _placed_tangents(place: F64, values: F64) -> tuple[Linear, Linear]:
    """Derivative of the tangents and signs of all copies, (k, m, 3, 4), by those of the mesh."""
    tangent = values[..., :3].reshape(-1, 3)
    turn, turned, unit = _directions(place, tangent)
    length = np.linalg.norm(tangent, axis=1)[:, None]
    along = tangent / np.where(length > 0.0, length, 1.0)
    direction = turned / _lengths(turned)
    hand = np.where(mirrored(place), -1.0, 1.0)[:, None, None]
    shape = (len(place), *values.shape)

    def push(v: F64) -> F64:
        flat = v.reshape(-1, 4)
        longer = np.sum(along * flat[:, :3], axis=1)[:, None]
        change = direction * longer + length * unit(np.einsum("kij,nj->kni", turn, flat[:, :3]))
        return np.concatenate([change, hand * flat[None, :, 3:]], axis=2).reshape(shape)

    def pull(g: F64) -> F64:
        g = g.reshape(len(place), -1, 4)
        longer = np.sum(direction * g[..., :3], axis=(0, 2))[:, None]
        back = along * longer + np.einsum("kij,kni->nj", turn, unit(length * g[..., :3]), optimize=True)
        return np.concatenate([back, np.sum(hand * g[..., 3:], axis=0)], axis=1).reshape(values.shape)

    return push, pull


def _turned_corners(place: F64, shape: tuple[int, ...]) -> tuple[Linear, Linear]:
    """Reverse the order of the corners, (k, m, 3, c), in mirrored copies: their faces have the opposite winding."""
    mirror = mirrored(place)

    def turn(v: F64) -> F64:
        if not mirror.any():
            return v
        return np.asarray(np.where(mirror[:, None, None, None], v[:, :, ::-1], v))

    return lambda v: turn(v).reshape(-1), lambda g: turn(g.reshape(len(mirror), *shape))


def _repeated(shape: tuple[int, ...], times: int) -> tuple[Linear, Linear]:
    """Repeat each row, (k, c), for all corners of its copy."""
    return (lambda v: np.repeat(v, times, axis=0).reshape(-1),
            lambda g: g.reshape(shape[0], times, shape[1]).sum(axis=1))


def _directions(place: F64, vectors: F64) -> tuple[F64, F64, Linear]:
    """Return N (k, 3, 3), N n (k, n, 3), and the derivative of N n / |N n| by N n, which is symmetric."""
    turn = cofactors(place)
    turned = np.einsum("kij,nj->kni", turn, vectors)
    length = _lengths(turned)
    direction = turned / length

    def unit(v: F64) -> F64:
        return np.asarray((v - direction * np.sum(direction * v, axis=-1, keepdims=True)) / length)

    return turn, turned, unit


def _lengths(vectors: F64) -> F64:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.where(length > 0.0, length, 1.0))


def _named_normals(mesh: Mesh) -> F64:
    assert mesh.normals is not None
    return mesh.normals[: smoothing_groups(mesh)]


def _layer_places(tables: Tables, k: int, layer: str) -> Iterator[int]:
    """Yield the index of the first float of an attribute of mesh k in the table; nothing if no texture reads it."""
    textures = tables.textures
    if textures is None or layer not in textures.attribute_names:
        return
    at = textures.attribute_names.index(layer) * (len(tables.mesh_names) + len(tables.fields)) + k
    components = int(textures.attribute_components[at])
    first = 3 * int(tables.mesh_first_face[k])
    if components < 0:
        first = int(np.searchsorted(tables.instance_mesh, k))
    yield int(textures.attribute_offset[at]) + first * abs(components)

"""Meshes and their transforms, as the arrays of `tables.Tables` from which BVHs are built."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import RAYS
from ..geometry.mesh_batches import batches, corners
from ..scene.light import AreaLight
from ..scene.mesh import Mesh
from ..scene.placement import smoothing_groups
from ..scene.scene import Scene
from .fields import field_tables

# An elliptic light is a polygon of this many sides that has the area of the ellipse.
ELLIPSE_SIDES = 64
# Kernels number corners in 32 bits.
MAX_FACES = (1 << 31) // 3 - 1
# Bit of the first set of blockers (shadow linking) in the mask of a mesh; the lower bits are kinds of rays.
FIRST_BLOCKERS = len(RAYS)


def geometry(scene: Scene, placed: list[Mesh], origin: NDArray[np.float64] | None) -> dict[str, Any]:
    """Return the columns of `Tables` that describe the meshes of `placement.placed_meshes`."""
    material_index = {name: k for k, name in enumerate(scene.materials)}
    area_lights = [light for light in scene.lights.values() if isinstance(light, AreaLight)]
    meshes = list(placed)
    slots = []
    for mesh in meshes:
        if mesh.face_material is None:
            slots.append(np.full(len(mesh.faces), material_index[mesh.materials[0]], np.int32))
        else:
            numbers = np.array([material_index[name] for name in mesh.materials], np.int32)
            slots.append(np.take(numbers, mesh.face_material))
    for k, light in enumerate(area_lights):
        light_vertices, light_faces = area_light_mesh(light)
        meshes.append(Mesh(light_vertices, light_faces, ()))
        slots.append(np.full(len(light_faces), len(scene.materials) + k, np.int32))

    first_vertex = np.cumsum([0] + [len(m.vertices) for m in meshes])
    first_face = np.cumsum([0] + [len(m.faces) for m in meshes])
    if first_face[-1] > MAX_FACES:
        raise ValueError(f"scene: has {int(first_face[-1]):,} triangles; {MAX_FACES:,} are the most")
    if origin is None:
        origin = _centre(meshes)
    return {
        "origin": origin,
        "vertices": _vertices(meshes, first_vertex, origin),
        "faces": _faces(meshes, first_vertex, first_face),
        "face_material": np.concatenate(slots).astype(np.int32) if slots else np.zeros(0, np.int32),
        "mesh_first_vertex": first_vertex,
        "mesh_first_face": first_face,
        "mesh_names": tuple(scene.meshes),
        "fields": field_tables(scene, origin),
        "field_names": tuple(scene.fields),
        "visible": np.array([1] * len(placed) + [0] * len(area_lights), np.uint8),
        **_masks(scene, meshes),
        "mesh_terminator": np.array([m.terminator_offset for m in meshes], np.float32),
        "mesh_dimming": np.array([1.0 / (1.0 - 0.5 * m.terminator_shading) for m in meshes], np.float32),
        **_shading_normals(meshes, first_face),
        **_instances(meshes, origin),
    }


# Functions of numpy that go through buffers end the process where these cannot be allocated: an index of another type
# than numpy's own, arithmetic of two types, or of large arrays of two shapes. `take` and assignments raise MemoryError.
def _faces(meshes: list[Mesh], first_vertex: NDArray[np.int64], first_face: NDArray[np.int64]) -> NDArray[np.uint32]:
    out = np.empty((int(first_face[-1]), 3), np.uint32)
    for first, last in batches(np.diff(first_face)):
        rows = out[first_face[first] : first_face[last]]
        if last - first == 1:
            rows[:] = meshes[first].faces
            rows += np.uint32(first_vertex[first])
            continue
        rows[:] = np.concatenate([mesh.faces for mesh in meshes[first:last]])
        shift = np.repeat(first_vertex[first:last], 3 * np.diff(first_face[first : last + 1]))
        rows += shift.astype(np.uint32).reshape(-1, 3)
    return out


def _vertices(meshes: list[Mesh], first_vertex: NDArray[np.int64], origin: NDArray[np.float64]) -> NDArray[np.float32]:
    out = np.empty((int(first_vertex[-1]), 3), np.float32)
    # The vertices of an instanced mesh stay in its own space.
    shifts = np.where([[mesh.instances is not None] for mesh in meshes] or np.zeros((0, 1)), 0.0, origin)
    for first, last in batches(np.diff(first_vertex)):
        rows = out[first_vertex[first] : first_vertex[last]]
        if last - first == 1:
            rows[:] = meshes[first].vertices - shifts[first]
            continue
        positions = np.concatenate([mesh.vertices for mesh in meshes[first:last]])
        rows[:] = positions - np.repeat(shifts[first:last], np.diff(first_vertex[first : last + 1]), axis=0)
    return out


def ray_bits(kinds: Iterable[str]) -> int:
    """Encode a set of kinds of rays as bits, 1 << index in `RAYS`."""
    return sum(1 << RAYS.index(kind) for kind in kinds)


def link_sets(scene: Scene, field: str) -> list[tuple[str, ...]]:
    """Return the distinct sets of meshes that lights have as their "receivers" or "blockers".

    Raises ``ValueError`` if there are more sets than bits in a mask.
    """
    found = dict.fromkeys(
        tuple(sorted(names)) for light in scene.lights.values() if (names := getattr(light, field)) is not None
    )
    most = 32 - (FIRST_BLOCKERS if field == "blockers" else 0)
    if len(found) > most:
        raise ValueError(f"lights: have {len(found)} different sets of {field}; {most} are the most")
    return list(found)


def _masks(scene: Scene, meshes: list[Mesh]) -> dict[str, Any]:
    receivers, blockers = link_sets(scene, "receivers"), link_sets(scene, "blockers")
    bits = {kinds: ray_bits(kinds) for kinds in {mesh.visible_to for mesh in meshes}}
    mask = np.array([bits[mesh.visible_to] for mesh in meshes], np.uint32)
    received = np.zeros(len(meshes), np.uint32)
    shadow = np.uint32(ray_bits(["shadow"]))
    number = {name: k for k, name in enumerate((*scene.meshes, *scene.fields))} if receivers or blockers else {}
    for j, members in enumerate(receivers):
        received[[number[name] for name in members]] |= np.uint32(1 << j)
    for j, members in enumerate(blockers):
        rows = np.array([number[name] for name in members], np.int64)
        mask[rows[(mask[rows] & shadow) != 0]] |= np.uint32(1 << (FIRST_BLOCKERS + j))
    return {"mesh_mask": mask, "mesh_receivers": received}


def _centre(meshes: list[Mesh]) -> NDArray[np.float64]:
    """Centre of the bounding box of all meshes and of the origins of all instances."""
    if not meshes:
        return np.zeros(3)
    low, high = corners([mesh for mesh in meshes if mesh.instances is None])
    middles = [mesh.instances[:, :3, 3] for mesh in meshes if mesh.instances is not None]
    return 0.5 * (np.concatenate([low, *middles]).min(axis=0) + np.concatenate([high, *middles]).max(axis=0))


def _shading_normals(meshes: list[Mesh], first_face: NDArray[np.int64]) -> dict[str, Any]:
    counts = [smoothing_groups(mesh) for mesh in meshes]
    first = np.cumsum([0, *counts])
    custom = np.array([mesh.normals is not None for mesh in meshes], np.uint8)
    corner = np.full((int(first_face[-1]) if first[-1] else 0, 3), -1, np.int32)
    given = np.zeros((int(first[-1]) if custom.any() else 0, 3), np.float32)
    for k, mesh in enumerate(meshes):
        if mesh.smoothing is None or not counts[k]:
            continue
        rows = corner[first_face[k] : first_face[k + 1]]
        rows[:] = np.where(mesh.smoothing < 0, -1, mesh.smoothing + first[k])
        if mesh.normals is not None:
            normals = mesh.normals[: counts[k]]
            given[first[k] : first[k + 1]] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return {"corner_normal": corner, "mesh_first_normal": first, "mesh_custom": custom, "custom_normals": given}


def _instances(meshes: list[Mesh], origin: NDArray[np.float64]) -> dict[str, Any]:
    which: list[int] = []
    places = [np.zeros((0, 3, 4))]
    for k, mesh in enumerate(meshes):
        if mesh.instances is None:
            continue
        place = mesh.instances[:, :3].copy()
        place[:, :, 3] -= origin
        which += [k] * len(place)
        places.append(place)
    return {
        "instance_mesh": np.array(which, np.int32),
        "instance_to_world": np.ascontiguousarray(np.concatenate(places), np.float32),
    }


def area_light_mesh(light: AreaLight) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return vertices and faces of an area light, which emits along the -Z axis of its transform."""
    if light.shape == "RECTANGLE":
        flat = np.array([[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]])  # clockwise seen from +Z
    else:
        angle = -2.0 * np.pi * np.arange(ELLIPSE_SIDES) / ELLIPSE_SIDES
        # The area of the polygon, n/2 sin(2 pi/n) r^2, equals that of the ellipse for this radius.
        radius = 0.5 * np.sqrt(np.pi / (0.5 * ELLIPSE_SIDES * np.sin(2.0 * np.pi / ELLIPSE_SIDES)))
        flat = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    local = np.concatenate([flat * light.size, np.zeros((len(flat), 1))], axis=1)
    fan = np.arange(1, len(flat) - 1, dtype=np.int32)
    faces = np.stack([np.zeros_like(fan), fan, fan + 1], axis=1)
    return local @ light.to_world[:3, :3].T + light.to_world[:3, 3], faces

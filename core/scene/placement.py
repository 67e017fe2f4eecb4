"""Where meshes stand: a mesh's copies in the world, and meshes as the tables have them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .field import Field
from .material import Material
from .mesh import TANGENT, Mesh, leaves_in_place
from .scene import Scene

F64 = NDArray[np.float64]

# Rows that are computed together, so that intermediate results stay in the processor's cache.
_AT_ONCE = 1 << 13


def places(mesh: Mesh) -> F64:
    """(k, 3, 4) rows of the affine maps from the mesh's own space to the world, one for each time it is drawn."""
    if mesh.instances is None:
        return mesh.transform[None, :3].copy()
    return composed(mesh.transform[:3], mesh.instances[:, :3])


def composed(first: F64, then: F64) -> F64:
    """Rows (..., 3, 4) of the affine map x -> first(then(x))."""
    out = first[..., :3] @ then
    out[..., 3] += first[..., 3]
    return out


def stands_in_world(scene: Scene, mesh: Mesh) -> bool:
    """Whether the tables have the mesh's vertices in world space, else in its own, with transforms.

    Instanced meshes stay in their own space. So do meshes that are placed by a transform and whose shading has a
    tangent frame (a normal map, anisotropy): as in Cycles the frame is that of the mesh's own space, and its vectors
    are turned as normals are, which no frame of world-space vectors can express under uneven scale. Meshes that give
    light always stand in the world; their frames are `placed_tangents`.
    """
    if mesh.instances is None and not is_moved(mesh):
        return True
    closures = [closure for name in mesh.materials for closure in scene.closures(name)]
    if mesh.instances is None and not any(map(has_tangent_frame, closures)):
        return True
    return any(closure.emits for closure in closures)


def has_tangent_frame(closure: Material) -> bool:
    """Whether a closure's shading depends on tangents of the surface."""
    return "normal" in closure.textures or "anisotropy" in closure.textures or closure.anisotropy != 0.0


def has_uv_tangents(closure: Material) -> bool:
    """Whether a closure's shading depends on the tangents of its UV map (`Material.normal_uv`)."""
    mapped = "normal" in closure.textures and closure.normal_space == "TANGENT"
    return mapped or "anisotropy" in closure.textures or closure.anisotropy != 0.0


def placed_meshes(scene: Scene) -> list[Mesh]:
    """The scene's meshes as the tables have them, in order; what places them is in `instances`, or applied.

    Behind them stands a mesh for each field (`stand_in`).
    """
    meshes = [expanded(mesh) if stands_in_world(scene, mesh) else _instanced(mesh) for mesh in scene.meshes.values()]
    return [*meshes, *map(stand_in, scene.fields.values())]


def stand_in(one: Field) -> Mesh:
    """The mesh by which the tables number a field: the corners of its box, and one face without an area."""
    return Mesh(one.corners(), np.zeros((1, 3), np.int32), (one.material,), visible_to=one.visible_to)


def is_moved(mesh: Mesh) -> bool:
    """Whether the mesh has a transform that changes anything."""
    return not leaves_in_place(mesh.transform)


def _numbered(mesh: Mesh) -> Mesh:
    """The mesh with shading normals numbered from 0 on without gaps, where there are more numbers than corners.

    Tables have a row for each number. Those of custom normals are places in `normals`.
    """
    if mesh.normals is not None or mesh.smoothing is None or smoothing_groups(mesh) <= mesh.smoothing.size:
        return mesh
    named = mesh.smoothing >= 0
    smoothing = np.full_like(mesh.smoothing, -1)
    smoothing[named] = np.unique(mesh.smoothing[named], return_inverse=True)[1]
    return replace(mesh, smoothing=smoothing)


def _instanced(mesh: Mesh) -> Mesh:
    mesh = _numbered(mesh)
    if not is_moved(mesh):
        return mesh
    matrices = np.tile(np.eye(4), (len(places(mesh)), 1, 1))
    matrices[:, :3] = places(mesh)
    return replace(mesh, instances=matrices, transform=np.eye(4))


def mirrored(place: F64) -> NDArray[np.bool_]:
    """(k,) which of the maps (k, 3, 4) mirror, and so turn the winding."""
    return np.asarray(np.linalg.det(place[:, :, :3]) < 0.0)


def stretches(linear: F64) -> bool:
    """Whether a linear map (3, 3) scales unevenly, and so changes angles."""
    scale = float(linear[:, 0] @ linear[:, 0])
    # Blender's matrices have single precision, so axes that should be orthogonal are so within rounding.
    return not np.allclose(linear.T @ linear, np.eye(3) * scale, rtol=1e-5, atol=1e-5 * scale)


def cofactors(place: F64) -> F64:
    """(k, 3, 3) inverse transposes of the maps' linear parts, which turn normals."""
    # `numpy.linalg.inv` returns any numbers where it cannot allocate memory.
    rows = place[:, :, :3]
    across = np.stack([np.cross(rows[:, 1], rows[:, 2]), np.cross(rows[:, 2], rows[:, 0]),
                       np.cross(rows[:, 0], rows[:, 1])], axis=1)  # fmt: skip
    return np.asarray(across / np.sum(rows[:, 0] * across[:, 0], axis=1)[:, None, None])


def smoothing_groups(mesh: Mesh) -> int:
    """How many shading normals the mesh's corners name."""
    return 0 if mesh.smoothing is None else int(mesh.smoothing.max(initial=-1)) + 1


def expanded(mesh: Mesh) -> Mesh:
    """All copies of a mesh as one mesh in the world."""
    mesh = _numbered(mesh)
    if mesh.instances is None and not is_moved(mesh):
        return mesh
    place = places(mesh)
    count, copies = len(mesh.vertices), len(place)
    vertices = np.einsum("kij,nj->kni", place[:, :, :3], mesh.vertices) + place[:, None, :, 3]
    faces = np.concatenate([mesh.faces + k * count for k in range(copies)])
    # A mirrored copy is wound the other way round.
    turn = np.repeat(mirrored(place), len(mesh.faces))
    smoothing = normals = None
    if mesh.smoothing is not None:
        groups = smoothing_groups(mesh)
        smoothing = np.concatenate(
            [np.where(mesh.smoothing < 0, -1, mesh.smoothing + k * groups) for k in range(copies)]
        ).astype(np.int32)
        if mesh.normals is not None:
            normals = np.einsum("kij,nj->kni", cofactors(place), mesh.normals[:groups]).reshape(-1, 3)
    attributes = {
        key: placed_tangents(place, value) if is_tangent(key, value) else np.tile(value, (copies, 1, 1))
        for key, value in mesh.attributes.items()
    }
    for key, values in mesh.instance_attributes.items():
        attributes[key] = np.repeat(values, 3 * len(mesh.faces), axis=0).reshape(-1, 3, values.shape[1])
    for corners in (faces, smoothing, *attributes.values()):
        if corners is not None:
            corners[turn] = corners[turn][:, ::-1]
    return replace(
        mesh, vertices=vertices.reshape(-1, 3), faces=faces, smoothing=smoothing, normals=normals,
        attributes=attributes, instances=None, instance_attributes={}, transform=np.eye(4),
        face_material=None if mesh.face_material is None else np.tile(mesh.face_material, copies),
    )


def is_tangent(name: str, values: NDArray[np.float32]) -> bool:
    """Whether an attribute holds tangents, which turn with the mesh."""
    return name.endswith(TANGENT) and values.shape[2] == 4


def placed_tangents(place: F64, values: NDArray[np.float32]) -> NDArray[np.float32]:
    """(k m, 3, 4) tangents and signs (m, 3, 4) of all copies: turned as normals are, their lengths kept."""
    if len(place) == 1 and np.array_equal(place[0, :, :3], np.eye(3)):
        return values
    rows = values.reshape(-1, 4)
    out = np.empty((len(place), *rows.shape), np.float32)
    for copy, turn, hand in zip(out, cofactors(place), np.where(mirrored(place), -1.0, 1.0), strict=True):
        if not stretches(turn):  # all lengths change by one factor
            frame = np.diag([0.0, 0.0, 0.0, hand])
            frame[:3, :3] = turn.T / np.linalg.norm(turn[:, 0])
            np.matmul(rows, frame.astype(np.float32), out=copy)
            continue
        copy[:, 3] = hand * rows[:, 3]
        for at in range(0, len(rows), _AT_ONCE):  # by columns: numpy is slow along short axes
            tangent = rows[at:at + _AT_ONCE, :3].T.astype(np.float64, order="C")
            turned = turn @ tangent
            wanted, squared = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] for v in (tangent, turned))
            copy[at:at + _AT_ONCE, :3] = (turned * np.sqrt(wanted / np.where(squared > 0.0, squared, 1.0))).T
    return out.reshape(-1, 3, 4)

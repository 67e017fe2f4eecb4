"""Triangles of a scene that may lie exactly on others: the few that a search for coincident faces compares.

Large meshes stay cheap because what is stored for all triangles is small: whatever a box of another owner does not
meet, and no triangle of its own mesh repeats, is left out before its plane is computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import _native
from edgegrad.geometry.labels import rows_and_places
from edgegrad.scene.placement import places

from ..geometry.normals import CHUNK, bits

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Distance of planes that rounding can interchange, relative to the coordinates and the distance of the camera.
ROUNDING = 5e-7
# Widths of the classes of planes: of normals, and of distances relative to the size of the scene.
NORMAL_STEP, DISTANCE_STEP = 1e-4, 1e-5
# Distance of triangles that count as the same, relative to the size of the scene.
TWIN_STEP = 4e-6
# Of cells of such triangles: what lies on both sides of a border is in one cell if the borders are shifted.
SHIFTS = (0.0, 0.5)
MOST_BOXES = 32  # in one plane, or of owners, that are compared with each other
MOST_OWNERS = 4096  # whose boxes are compared


@dataclass
class Surface:
    """One place of a mesh: vertices relative to the middle of the scene, owners of its faces, number of the first."""

    mesh: str
    vertices: F64
    faces: NDArray[Any]
    owner: I64
    first: int


@dataclass
class Triangles:
    """The triangles of a scene, in world space, that may lie on others or on area lights.

    Attributes
    ----------
    corners
        (n, 3, 3) relative to `middle`.
    normal, distance
        Unit normal (n, 3), whose sign is the same for both sides, and distance (n,) from `middle` of the plane.
    low, high
        (n, 3) corners of the triangles' boxes, relative to `middle`.
    owner
        (n,) index in `owners` of the mesh and material; instances of a mesh have their own.
    doubled
        (n,) whether another triangle of the owner lies at the same place.
    number
        (n,) number among all triangles of the scene, ascending.
    """

    corners: F64
    normal: F64
    distance: F64
    low: F64
    high: F64
    owner: I64
    doubled: NDArray[np.bool_]
    number: I64
    surfaces: list[Surface]
    owners: list[tuple[str, str]]
    middle: F64
    size: float

    def at(self, numbers: I64) -> tuple[I64, NDArray[np.bool_]]:
        """Places of the triangles of these numbers, and which of them are there."""
        place = np.minimum(np.searchsorted(self.number, numbers), max(len(self.number) - 1, 0))
        known = self.number[place] == numbers if len(self.number) else np.zeros(len(numbers), bool)
        return place, known


def near_triangles(scene: edgegrad.Scene, names: Sequence[str], others: Sequence[F64]) -> Triangles:
    """Find the triangles whose boxes meet the box of another owner or of one of `others`, or that lie twice at a place.

    Parameters
    ----------
    names
        Meshes that are looked at.
    others
        (k, 3) points each: area lights.
    """
    surfaces, owners, middle, size = _surfaces(scene, names)
    slack = ROUNDING * size
    boxes = _owner_boxes(surfaces, len(owners))
    lights = np.array([(points.min(axis=0), points.max(axis=0)) for points in others]).reshape(-1, 2, 3) - middle
    doubled = np.concatenate([_doubled(surface, TWIN_STEP * size) for surface in surfaces])
    chosen = doubled.copy()
    for surface in surfaces:
        here = chosen[surface.first:surface.first + len(surface.faces)]
        if len(owners) > MOST_OWNERS:
            here[:] = True
            continue
        for owner in np.unique(surface.owner):
            own = boxes[owner]
            meeting = np.concatenate([np.delete(boxes, owner, axis=0), lights])
            meeting = meeting[((meeting[:, 0] <= own[1] + slack) & (own[0] <= meeting[:, 1] + slack)).all(axis=1)]
            if len(meeting):
                here |= (surface.owner == owner) & _meets(surface, meeting, slack)
    return _planes(surfaces, chosen, doubled, owners, middle, size)


def _surfaces(scene: edgegrad.Scene, names: Sequence[str]) -> tuple[list[Surface], list[tuple[str, str]], F64, float]:
    """All places of the meshes, their owners, and the middle and size of the scene."""
    surfaces: list[Surface] = []
    owners: list[tuple[str, str]] = []
    extent = np.array([[np.inf], [-np.inf]]) * np.ones(3)
    first = 0
    for name in names:
        mesh = scene.meshes[name]
        slots = np.zeros(len(mesh.faces), np.int64) if mesh.face_material is None else mesh.face_material
        used = np.zeros(len(mesh.vertices), bool)
        used[mesh.faces.reshape(-1)] = True
        for place in places(mesh):
            vertices = mesh.vertices @ place[:, :3].T + place[:, 3]
            if not used.all():
                vertices[~used] = vertices[mesh.faces[0, 0]] if len(mesh.faces) else 0.0
            if len(mesh.faces):
                low, high = _box(vertices)
                extent = np.array([np.minimum(extent[0], low), np.maximum(extent[1], high)])
            surfaces.append(Surface(name, vertices, mesh.faces, slots + len(owners), first))
            first += len(mesh.faces)
            owners += [(name, slot) for slot in mesh.materials]
    middle = extent.mean(axis=0)
    for surface in surfaces:
        surface.vertices -= middle
    return surfaces, owners, middle, max(float((extent[1] - extent[0]).max()), 1e-6)


def _box(points: F64) -> F64:
    """(2, 3) lowest and highest coordinates. By columns: numpy is slow along short axes."""
    return np.array([[points[:, k].min() for k in range(3)], [points[:, k].max() for k in range(3)]])


def _owner_boxes(surfaces: Sequence[Surface], count: int) -> F64:
    """(count, 2, 3) box of each owner's triangles; an owner without triangles has one that meets no other."""
    out = np.tile(np.array([[np.inf], [-np.inf]]) * np.ones(3), (count, 1, 1))
    for surface in surfaces:
        present = np.unique(surface.owner)
        for owner in present:
            faces = surface.faces if len(present) == 1 else surface.faces[surface.owner == owner]
            points = surface.vertices if len(present) == 1 else surface.vertices[faces.reshape(-1)]
            out[owner] = _box(points)
    return out


def _meets(surface: Surface, boxes: F64, slack: float) -> NDArray[np.bool_]:
    """Whether the box of each triangle meets one of these boxes; true if they are too many to look."""
    out = np.ones(len(surface.faces), bool)
    if len(boxes) > MOST_BOXES:
        return out
    for at in range(0, len(out), CHUNK):
        corners = [surface.vertices.take(surface.faces[at:at + CHUNK, k], axis=0) for k in range(3)]
        low, high = (choose(choose(*corners[:2]), corners[2]) for choose in (np.minimum, np.maximum))
        near = np.zeros(len(low), bool)
        for box in boxes:
            near |= ((low <= box[1] + slack) & (high >= box[0] - slack)).all(axis=1)
        out[at:at + CHUNK] = near
    return out


def _doubled(surface: Surface, step: float) -> NDArray[np.bool_]:
    """(n,) whether another triangle of the same owner has the same centre and area, but for rounding.

    Modifiers that mirror or copy a mesh onto itself round its vertices differently. Triangles too small to tell are not
    doubled. Nearly all triangles are alone in the cell of their centre, and areas are computed for the others.
    """
    out = np.zeros(len(surface.faces), bool)
    for centres, shift in zip(_centre_cells(surface, step), SHIFTS, strict=True):
        near = _native.repeated_keys(centres)
        a, b, c = surface.vertices.take(surface.faces[near].T, axis=0)
        normal = cross(b - a, c - a)
        width = np.sqrt(np.sqrt(np.einsum("nk,nk->n", normal, normal)))
        keys = bits(centres[near], np.floor(width / (3.0 * step) + shift).astype(np.int64), surface.owner[near])
        keys[width <= 4.0 * step] = 0
        out[near[_native.repeated_keys(keys)]] = True
    return out


def _centre_cells(surface: Surface, step: float) -> NDArray[np.uint64]:
    """(2, n) keys of the cells with the triangles' centres, for both `SHIFTS`; each cell has a key of its own.

    By columns, which numpy gathers faster than rows of three numbers.
    """
    out = np.zeros((2, len(surface.faces)), np.uint64)
    columns = np.ascontiguousarray(surface.vertices.T) / (3.0 * step) + 1.0 / (3.0 * TWIN_STEP)  # none is negative
    for at in range(0, len(surface.faces), CHUNK):
        corners = surface.faces[at:at + CHUNK].T.astype(np.intp)
        keys = out[:, at:at + CHUNK]
        for column in columns:
            place = column.take(corners[0])
            for corner in corners[1:]:
                place += column.take(corner)
            for key, shift in zip(keys, SHIFTS, strict=True):
                key <<= np.uint64(21)
                key |= (place + shift).astype(np.uint64)
        keys *= np.uint64(0xFF51AFD7ED558CCD)  # numbers of cells are regular, which hash tables do not like
        keys ^= keys >> np.uint64(32)
    return out


def _planes(surfaces: Sequence[Surface], chosen: NDArray[np.bool_], doubled: NDArray[np.bool_],
            owners: list[tuple[str, str]], middle: F64, size: float) -> Triangles:  # fmt: skip
    """The chosen triangles that have an area."""
    numbers = np.flatnonzero(chosen)
    corners, owner = np.empty((len(numbers), 3, 3)), np.empty(len(numbers), np.int64)
    for surface in surfaces:
        low, high = np.searchsorted(numbers, (surface.first, surface.first + len(surface.faces)))
        own = numbers[low:high] - surface.first
        corners[low:high], owner[low:high] = surface.vertices[surface.faces[own]], surface.owner[own]
    normal, whole = plane_normals(corners)
    corners, owner, numbers, normal = corners[whole], owner[whole], numbers[whole], normal[whole]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    distance = np.einsum("nk,nk->n", normal, a + b + c) / 3.0
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return Triangles(corners, normal, distance, low, high, owner, doubled[numbers], numbers, list(surfaces), owners,
                     middle, size)  # fmt: skip


def plane_normals(corners: F64) -> tuple[F64, NDArray[np.bool_]]:
    """Unit normals of triangles (n, 3, 3), of which both sides have the same, and whether each has an area."""
    normal = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt(np.einsum("nk,nk->n", normal, normal))
    whole = length > 0.0
    normal /= np.where(whole, length, 1.0)[:, None]
    # Any direction without a special relation to axes and diagonals tells the two sides of a plane apart.
    normal[normal @ (1.0, 0.7548, 0.5698) < 0.0] *= -1.0
    return normal, whole


def contains(corners: F64, normal: F64, points: F64, slack: F64) -> NDArray[np.bool_]:
    """Whether points in the planes of triangles lie in the triangles, or at most `slack` outside.

    With a negative slack, whether they lie so far from the borders inside.
    """
    inside = np.ones((2, len(points)), bool)
    for k in range(3):
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        edge = b - a
        side = np.einsum("nk,nk->n", cross(normal, edge), points - a)
        reach = slack * np.linalg.norm(edge, axis=1)
        inside &= np.stack([side >= -reach, side <= reach])
    return np.asarray(inside.any(axis=0))


def cross(a: F64, b: F64) -> F64:
    """(n, 3) cross products; faster than numpy's."""
    return np.stack([a[:, i] * b[:, j] - a[:, j] * b[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)


def shared_planes(found: Triangles) -> I64:
    """(n,) class of a triangle's plane, if triangles of other owners lie in it and their boxes meet; else -1."""
    out = np.full(len(found.owner), -1, np.int64)
    if not len(out):
        return out
    cell = np.column_stack([found.normal / NORMAL_STEP, found.distance / (DISTANCE_STEP * found.size)])
    # Planes on both sides of a border between classes are in one class if the borders are shifted.
    for shift in (0.5, 0.0):
        key = bits(np.floor(cell + shift).astype(np.int64))
        order = np.argsort(key)
        start = np.flatnonzero(np.r_[True, key[order[1:]] != key[order[:-1]]])
        owner = found.owner[order]
        shared = np.minimum.reduceat(owner, start) < np.maximum.reduceat(owner, start)
        plane = np.repeat(np.arange(len(start)), np.diff(np.r_[start, len(order)]))
        chosen = shared[plane]
        if not chosen.any():
            continue
        index, plane = order[chosen], plane[chosen]
        meets = _touches_others(found, plane, index)
        index, plane = index[meets], plane[meets]
        new = out[index] < 0
        out[index[new]] = plane[new] + (out.max() + 1)
    return out


def _touches_others(found: Triangles, plane: I64, index: I64) -> NDArray[np.bool_]:
    """Whether the box of an owner's triangles in a plane meets another owner's box in this plane."""
    keys = plane * len(found.owners) + found.owner[index]
    order = np.argsort(keys, kind="stable")
    start = np.flatnonzero(np.r_[True, keys[order[1:]] != keys[order[:-1]]])
    low = np.minimum.reduceat(found.low[index[order]], start)
    high = np.maximum.reduceat(found.high[index[order]], start)
    of_plane = plane[order][start]
    slack = ROUNDING * found.size
    first, last = (np.searchsorted(of_plane, of_plane, side) for side in ("left", "right"))
    number = last - first
    compared = np.flatnonzero(number <= MOST_BOXES)
    row, place = rows_and_places(number[compared])
    one, two = compared[row], first[compared][row] + place
    both = (one != two) & ((low[one] <= high[two] + slack) & (low[two] <= high[one] + slack)).all(axis=1)
    meets = number > MOST_BOXES
    meets |= np.bincount(one[both], minlength=len(start)) > 0
    out = np.empty(len(keys), bool)
    out[order] = np.repeat(meets, np.diff(np.r_[start, len(order)]))
    return out

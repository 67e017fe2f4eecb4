"""Faces that lie exactly on each other, and area lights that lie exactly on faces.

Which of two such faces a ray hits is decided by rounding, in Cycles as here, and not equally. In Cycles rounding also
decides whether they shadow each other, and whether a face blocks a light that lies on it. They are found on the
exported scene and reported, with their share of the picture.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import _native
from edgegrad.rendering.native_engine import embree_library
from edgegrad.scene.placement import places

from ..exported import Export
from .normals import bits

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Names = tuple[tuple[str, str], tuple[str, str]]  # of two meshes and their materials

# Triangles of a scene, with all instances, that are searched at most.
MOST_TRIANGLES = 2_000_000
# Distance of planes that rounding can interchange, relative to the coordinates and the distance of the camera.
ROUNDING = 5e-7
# Widths of the classes of planes: of normals, and of distances relative to the size of the scene.
NORMAL_STEP, DISTANCE_STEP = 1e-4, 1e-5
# Distance of triangles that count as the same, relative to the size of the scene.
TWIN_STEP = 4e-6
RAYS_ACROSS = 100  # rays across the picture
MOST_PAIRS = 1 << 22  # points and triangles that are compared at once
MOST_BOXES = 32  # in one plane that are compared with each other
LEAST_SHARE = 2e-4  # of the picture that is reported
SAMPLES = 2000  # faces of an emitter that are tested


@dataclass
class Triangles:
    """All triangles of a scene, in world space.

    Attributes
    ----------
    corners
        (n, 3, 3) relative to `middle`.
    normal, distance
        Unit normal (n, 3), whose sign is the same for both sides, and distance (n,) from `middle` of the plane.
    owner
        (n,) index in `owners` of the mesh and material; instances of a mesh have their own.
    doubled
        (n,) whether another triangle of the owner lies at the same place.
    """

    corners: F64
    normal: F64
    distance: F64
    owner: I64
    doubled: NDArray[np.bool_]
    owners: list[tuple[str, str]]
    middle: F64
    size: float


def warn_about_coincident(out: Export) -> None:
    """Report the faces and lights of an exported scene that lie exactly on faces of other materials."""
    scene = out.scene
    names = [name for name in scene.meshes if not out.meshes[name].part]  # hair never lies on faces
    count = sum(len(scene.meshes[name].faces) * len(places(scene.meshes[name])) for name in names)
    if count > MOST_TRIANGLES:
        out.report.tell("scene", f"has {count} triangles, so faces that lie exactly on each other aren't looked for")
        return
    finite = all(np.isfinite(scene.meshes[name].vertices).all() for name in names)
    if not count or not finite:  # a scene that is not finite is refused when it is rendered
        return
    found = _triangles(scene, names)
    _warn_about_lights(out, found)
    plane = _shared_planes(found)
    if not (plane >= 0).any() and not found.doubled.any():
        return
    shares: dict[Names, float] = {}
    for pair, share in _visible(out, found, plane).items():
        both = _named(found, pair)
        shares[both] = shares.get(both, 0.0) + share
    for both, share in sorted(shares.items(), key=lambda item: -item[1]):
        if share >= LEAST_SHARE:
            _warn_about_pair(out, both, f"on {share:.1%} of the picture")
    for both in sorted({_named(found, pair) for pair in _hidden_emitters(out, found, plane)}):
        if shares.get(both, 0.0) < LEAST_SHARE:
            _warn_about_pair(out, both, "where they emit light")


def _named(found: Triangles, pair: tuple[int, int]) -> Names:
    """Mesh and material of both owners."""
    first, second = sorted(found.owners[k] for k in pair)
    return first, second


def _warn_about_pair(out: Export, names: Names, where: str) -> None:
    (mesh, material), (other, below) = names
    if names[0] == names[1]:
        what = f"lie twice at the same place {where}"
    elif mesh == other:
        what = f"lie exactly on faces of material '{below}' {where}"
    else:
        what = f"lie exactly on faces of object '{out.meshes[other].object}', material '{below}', {where}"
    out.report.warn(f"faces of object '{out.meshes[mesh].object}', material '{material}'",
                    f"{what}; rounding decides which of them is seen and, in Cycles, whether they shadow each other; "
                    "move or remove one of them")  # fmt: skip


def _triangles(scene: edgegrad.Scene, names: list[str]) -> Triangles:
    owners: list[tuple[str, str]] = []
    corners, owner = [], []
    for name in names:
        mesh = scene.meshes[name]
        slots = np.zeros(len(mesh.faces), np.int64) if mesh.face_material is None else mesh.face_material
        for place in places(mesh):
            corners.append((mesh.vertices @ place[:, :3].T + place[:, 3])[mesh.faces])
            owner.append(slots + len(owners))
            owners += [(name, slot) for slot in mesh.materials]
    every = np.concatenate(corners)
    low, high = every.min(axis=(0, 1)), every.max(axis=(0, 1))
    middle = 0.5 * (low + high)
    every -= middle
    normal = _cross(every[:, 1] - every[:, 0], every[:, 2] - every[:, 0])
    length = np.sqrt(np.einsum("nk,nk->n", normal, normal))
    whole = length > 0.0
    every, normal, kept = every[whole], normal[whole] / length[whole, None], np.concatenate(owner)[whole]
    # Any direction without a special relation to axes and diagonals tells the two sides of a plane apart.
    normal[normal @ (1.0, 0.7548, 0.5698) < 0.0] *= -1.0
    distance = np.einsum("nk,nk->n", normal, every[:, 0] + every[:, 1] + every[:, 2]) / 3.0
    size = max(float((high - low).max()), 1e-6)
    return Triangles(every, normal, distance, kept, _doubled(every, length[whole], kept, size), owners, middle, size)


def _doubled(corners: F64, area: F64, owner: I64, size: float) -> NDArray[np.bool_]:
    """(n,) whether another triangle of the same owner has the same centre and area, but for rounding.

    Modifiers that mirror or copy a mesh onto itself round its vertices differently.
    """
    out = np.zeros(len(corners), bool)
    step = TWIN_STEP * size
    width = np.sqrt(area)
    large = width > 4.0 * step
    place = np.column_stack([corners[:, 0] + corners[:, 1] + corners[:, 2], width]) / (3.0 * step)
    for shift in (0.0, 0.5):  # values on both sides of a border between cells are in one cell if it is shifted
        key = bits(np.floor(place + shift).astype(np.int64), owner)
        order = np.argsort(key)
        same = (key[order[1:]] == key[order[:-1]]) & large[order[1:]] & large[order[:-1]]
        out[order[1:][same]] = out[order[:-1][same]] = True
    return out


def _cross(a: F64, b: F64) -> F64:
    return np.stack([a[:, i] * b[:, j] - a[:, j] * b[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)


def _shared_planes(found: Triangles) -> I64:
    """(n,) class of a triangle's plane, if triangles of other owners lie in it and their boxes meet; else -1."""
    out = np.full(len(found.owner), -1, np.int64)
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
    corners = found.corners[index[order]]
    low = np.minimum.reduceat(corners.min(axis=1), start)
    high = np.maximum.reduceat(corners.max(axis=1), start)
    of_plane = plane[order][start]
    slack = ROUNDING * found.size
    first, last = (np.searchsorted(of_plane, of_plane, side) for side in ("left", "right"))
    number = last - first
    compared = np.flatnonzero(number <= MOST_BOXES)
    one = np.repeat(compared, number[compared])
    two = np.arange(len(one)) - np.repeat(np.cumsum(number[compared]) - number[compared] - first[compared],
                                          number[compared])  # fmt: skip
    both = (one != two) & ((low[one] <= high[two] + slack) & (low[two] <= high[one] + slack)).all(axis=1)
    meets = number > MOST_BOXES
    meets |= np.bincount(one[both], minlength=len(start)) > 0
    out = np.empty(len(keys), bool)
    out[order] = np.repeat(meets, np.diff(np.r_[start, len(order)]))
    return out


def _visible(out: Export, found: Triangles, plane: I64) -> dict[tuple[int, int], float]:
    """Share of the picture in which two owners' faces lie on each other, by their indices in `owners`."""
    camera = out.scene.camera
    shown = np.array(["camera" in out.scene.meshes[name].visible_to for name, _ in found.owners])[found.owner]
    if not shown.any():
        return {}
    origin, direction = primary_rays(camera, RAYS_ACROSS)
    vertices = found.corners[shown].reshape(-1, 3).astype(np.float32)
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    traced = _native.RayScene(vertices, faces, 0, str(embree_library()))
    start = (origin - found.middle).astype(np.float32)
    _, face, distance = traced.trace(start, direction.astype(np.float32), np.float32(np.inf), False, True, False, "")
    hit = np.flatnonzero(face >= 0)
    index = np.flatnonzero(shown)[face[hit]]
    twice = Counter((k, k) for k in found.owner[index][found.doubled[index]].tolist())
    inside = plane[index] >= 0
    hit, index = hit[inside], index[inside]
    points = origin[hit] - found.middle + distance[hit, None].astype(np.float64) * direction[hit]
    pairs = _others(found, plane, points, index, distance[hit], np.flatnonzero((plane >= 0) & shown))
    return {pair: number / len(origin) for pair, number in (twice + Counter(pairs)).items()}


def _others(found: Triangles, plane: I64, points: F64, index: I64, far: NDArray[np.float32],
            among: I64) -> list[tuple[int, int]]:  # fmt: skip
    """Pairs of owners for the points that lie in a triangle of another owner: once for each point and pair.

    Parameters
    ----------
    index
        Triangle of each point.
    far
        Distance of each point from the camera.
    among
        Triangles that are compared.
    """
    out: list[tuple[int, int]] = []
    order = among[np.argsort(plane[among], kind="stable")]
    classes = plane[order]
    first, last = (np.searchsorted(classes, plane[index], side) for side in ("left", "right"))
    numbers = last - first
    low, high = found.corners.min(axis=1), found.corners.max(axis=1)
    reach = np.abs(points).max(axis=1, initial=0.0) + np.abs(found.middle).max() + far
    at = 0
    while at < len(points):
        end = max(at + 1, int(np.searchsorted(np.cumsum(numbers[at:]), MOST_PAIRS, "right")) + at)
        point = np.repeat(np.arange(at, end), numbers[at:end])
        within = np.arange(len(point)) - np.repeat(np.cumsum(numbers[at:end]) - numbers[at:end], numbers[at:end])
        triangle = order[first[point] + within]
        apart = found.owner[triangle] != found.owner[index[point]]
        point, triangle = point[apart], triangle[apart]
        for axis in range(3):
            x, slack = points[point, axis], ROUNDING * reach[point]
            near = (low[triangle, axis] <= x + slack) & (x <= high[triangle, axis] + slack)
            point, triangle = point[near], triangle[near]
        p, slack = points[point], ROUNDING * reach[point]
        # The point itself is rounded along its ray: its plane is that of its triangle.
        away = np.abs(np.einsum("nk,nk->n", found.normal[triangle], _in_plane(found, p, index[point]))
                      - found.distance[triangle])  # fmt: skip
        near = away <= slack
        point, triangle, p, slack = point[near], triangle[near], p[near], slack[near]
        contained = _contains(found.corners[triangle], found.normal[triangle], p, slack)
        seen = {(int(k), tuple(sorted((int(found.owner[index[k]]), int(found.owner[t])))))
                for k, t in zip(point[contained], triangle[contained], strict=True)}  # fmt: skip
        out += [(a, b) for _, (a, b) in seen]
        at = end
    return out


def _in_plane(found: Triangles, points: F64, index: I64) -> F64:
    """Nearest points in the planes of these triangles."""
    above = np.einsum("nk,nk->n", found.normal[index], points) - found.distance[index]
    return np.asarray(points - above[:, None] * found.normal[index])


def _contains(corners: F64, normal: F64, points: F64, slack: F64) -> NDArray[np.bool_]:
    """Whether points in the planes of triangles lie in the triangles."""
    inside = np.ones((2, len(points)), bool)
    for k in range(3):
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        edge = b - a
        side = np.einsum("nk,nk->n", _cross(normal, edge), points - a)
        reach = slack * np.linalg.norm(edge, axis=1)
        inside &= np.stack([side >= -reach, side <= reach])
    return np.asarray(inside.any(axis=0))


def _hidden_emitters(out: Export, found: Triangles, plane: I64) -> list[tuple[int, int]]:
    """Pairs of owners of which one emits light, and whose faces lie on each other, seen by the camera or not."""
    emits = np.array([_emits(out.scene, slot) for _, slot in found.owners])
    pairs: set[tuple[int, int]] = set()
    for owner in np.flatnonzero(emits):
        index = np.flatnonzero((found.owner == owner) & (plane >= 0))[:SAMPLES]
        points = found.corners[index].mean(axis=1)
        pairs |= set(_others(found, plane, points, index, np.zeros(len(index), np.float32),
                             np.flatnonzero(plane >= 0)))  # fmt: skip
    return sorted(pairs)


def _emits(scene: edgegrad.Scene, material: str) -> bool:
    return any(np.any(one.emission > 0.0) or "emission" in one.textures for one in scene.closures(material))


def _warn_about_lights(out: Export, found: Triangles) -> None:
    """Warn of area lights in the planes of faces, which block them or not by rounding."""
    for name, light in out.scene.lights.items():
        if not isinstance(light, edgegrad.AreaLight) or not light.power:
            continue
        place = light.to_world
        normal, centre = place[:3, 2], place[:3, 3] - found.middle
        slack = ROUNDING * (found.size + float(np.abs(found.middle).max()))
        turned = np.abs(found.normal @ normal) > 1.0 - 0.5 * NORMAL_STEP**2
        in_plane = turned & (np.abs(found.normal @ centre - found.distance) <= slack)
        index = np.flatnonzero(in_plane)
        steps = (np.arange(8) + 0.5) / 8.0 - 0.5
        u, v = (x.reshape(-1) for x in np.meshgrid(steps, steps))
        if light.shape == "ELLIPSE":
            round_ = u**2 + v**2 <= 0.25
            u, v = u[round_], v[round_]
        points = centre + (u * light.size[0])[:, None] * place[:3, 0] + (v * light.size[1])[:, None] * place[:3, 1]
        covered = np.zeros(len(points), bool)
        owners: Counter[int] = Counter()
        for k in index[: 1 << 16]:
            one = _contains(np.repeat(found.corners[None, k], len(points), axis=0),
                            np.repeat(found.normal[None, k], len(points), axis=0), points,
                            np.full(len(points), slack))  # fmt: skip
            covered |= one
            owners[int(found.owner[k])] += int(one.sum())
        if covered.any():
            mesh = found.owners[owners.most_common(1)[0][0]][0]
            where = f"lies exactly on object '{out.meshes[mesh].object}' with {covered.mean():.0%} of its area"
            out.report.warn(f"light '{out.lights[name].object}'", f"{where}; in Cycles rounding decides how much of "
                            "its light passes, here all does; move it a little to the side that it lights")  # fmt: skip


def primary_rays(camera: edgegrad.Camera, across: int) -> tuple[F64, F64]:
    """(n, 3) origins and unit directions of rays through a regular grid over the rendered picture."""
    x0, y0, x1, y1 = camera.window
    step = max((x1 - x0) / across, 1.0)
    columns, rows = np.arange(x0 + 0.5 * step, x1, step), np.arange(y0 + 0.5 * step, y1, step)
    x, y = (v.reshape(-1) for v in np.meshgrid(columns, rows))
    turn, origin = camera.to_world[:3, :3], np.tile(camera.to_world[:3, 3], (len(x), 1))
    if camera.kind == "EQUIRECTANGULAR":
        longitude = camera.longitude[0] + x / camera.width * np.diff(camera.longitude)
        latitude = camera.latitude[1] - y / camera.height * np.diff(camera.latitude)
        local = np.column_stack([np.sin(longitude) * np.cos(latitude), np.sin(latitude),
                                 -np.cos(longitude) * np.cos(latitude)])  # fmt: skip
        return origin, local @ turn.T
    aside = (x - camera.principal_point[0]) / camera.focal
    above = (camera.principal_point[1] - y) * camera.pixel_aspect / camera.focal
    local = np.column_stack([aside, above, -np.ones(len(x))])
    if camera.kind == "ORTHOGRAPHIC":
        return origin + np.column_stack([aside, above]) @ turn[:, :2].T, np.tile(-turn[:, 2], (len(x), 1))
    return origin, (local / np.linalg.norm(local, axis=1, keepdims=True)) @ turn.T

"""Faces that lie exactly on each other, and area lights that lie exactly on faces.

Which of two such faces a ray hits is decided by rounding, in Cycles as here, and not equally. In Cycles rounding also
decides whether they shadow each other, and whether a face blocks a light that lies on it. They are found on the
exported scene and reported, with their share of the picture.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import _native
from edgegrad.geometry.camera_view import panorama_rays
from edgegrad.geometry.labels import rows_and_places
from edgegrad.rendering.native_engine import embree_library
from edgegrad.scene.camera import PANORAMAS
from edgegrad.scene.placement import places

from ..exported import Export
from . import overlaps
from .near_triangles import F64, I64, NORMAL_STEP, ROUNDING, Triangles, contains, near_triangles, shared_planes

Names = tuple[tuple[str, str], tuple[str, str]]  # of two meshes and their materials

# Triangles of a scene, with all instances, that are searched at most.
MOST_TRIANGLES = 2_000_000
RAYS_ACROSS = 100  # rays across the picture
MOST_PAIRS = 1 << 22  # points and triangles that are compared at once
LEAST_SHARE = 2e-4  # of the picture that is reported
SAMPLES = 2000  # faces of an emitter that are tested


def warn_about_coincident(out: Export) -> None:
    """Report the faces and lights of an exported scene that lie exactly on other faces."""
    scene = out.scene
    names = [name for name in scene.meshes if not out.meshes[name].part]  # hair never lies on faces
    count = sum(len(scene.meshes[name].faces) * len(places(scene.meshes[name])) for name in names)
    if count > MOST_TRIANGLES:
        out.report.tell("scene", f"has {count} triangles, so faces that lie exactly on each other aren't looked for")
        return
    finite = all(np.isfinite(scene.meshes[name].vertices).all() for name in names)
    if not count or not finite:  # a scene that is not finite is refused when it is rendered
        return
    lights = [light for light in scene.lights.values() if isinstance(light, edgegrad.AreaLight) and light.power]
    found = near_triangles(scene, names, [_corners(light) for light in lights])
    _warn_about_lights(out, found)
    plane = shared_planes(found)
    if count > overlaps.MOST_TRIANGLES:
        out.report.tell("scene", f"has {count} triangles, so faces of one mesh and material that lie on each other in "
                                 "part aren't looked for")  # fmt: skip
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


def _visible(out: Export, found: Triangles, plane: I64) -> dict[tuple[int, int], float]:
    """Share of the picture in which two owners' faces lie on each other, by their indices in `owners`."""
    camera = out.scene.camera
    seen = [surface for surface in found.surfaces if "camera" in out.scene.meshes[surface.mesh].visible_to]
    if not seen:
        return {}
    origin, direction = primary_rays(camera, RAYS_ACROSS)
    first = np.cumsum([0] + [len(surface.vertices) for surface in seen])
    vertices = np.concatenate([surface.vertices for surface in seen]).astype(np.float32)
    faces = np.concatenate([surface.faces + at for surface, at in zip(seen, first[:-1], strict=True)])
    number = np.concatenate([surface.first + np.arange(len(surface.faces)) for surface in seen])
    traced = _native.RayScene(vertices, faces.astype(np.int32), 0, str(embree_library()))
    start = (origin - found.middle).astype(np.float32)
    _, face, distance = traced.trace(start, direction.astype(np.float32), np.float32(np.inf), False, True, False, "")
    hit = np.flatnonzero(face >= 0)
    whole = origin[hit] - found.middle + distance[hit, None].astype(np.float64) * direction[hit]
    index, known = found.at(number[face[hit]])
    alone = ~known
    alone[known] = ~found.doubled[index[known]]
    covered = overlaps.overlapped(seen, found.size, face[hit[alone]], whole[alone],
                                  _rounded(found, whole, distance[hit])[alone])  # fmt: skip
    partly = Counter((k, k) for k in covered)
    hit, index = hit[known], index[known]
    twice = Counter((k, k) for k in found.owner[index][found.doubled[index]].tolist())
    inside = plane[index] >= 0
    hit, index = hit[inside], index[inside]
    points = whole[known][inside]
    shown = np.isin(found.number, number)
    pairs = _others(found, plane, points, index, distance[hit], np.flatnonzero((plane >= 0) & shown))
    return {pair: number / len(origin) for pair, number in (twice + partly + Counter(pairs)).items()}


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
    rounded = _rounded(found, points, far)
    at = 0
    while at < len(points):
        end = max(at + 1, int(np.searchsorted(np.cumsum(numbers[at:]), MOST_PAIRS, "right")) + at)
        row, within = rows_and_places(numbers[at:end])
        point = at + row
        triangle = order[first[point] + within]
        apart = found.owner[triangle] != found.owner[index[point]]
        point, triangle = point[apart], triangle[apart]
        for axis in range(3):
            x, slack = points[point, axis], rounded[point]
            near = (found.low[triangle, axis] <= x + slack) & (x <= found.high[triangle, axis] + slack)
            point, triangle = point[near], triangle[near]
        p, slack = points[point], rounded[point]
        # The point itself is rounded along its ray: its plane is that of its triangle.
        away = np.abs(np.einsum("nk,nk->n", found.normal[triangle], _in_plane(found, p, index[point]))
                      - found.distance[triangle])  # fmt: skip
        near = away <= slack
        point, triangle, p, slack = point[near], triangle[near], p[near], slack[near]
        contained = contains(found.corners[triangle], found.normal[triangle], p, slack)
        seen = {(int(k), tuple(sorted((int(found.owner[index[k]]), int(found.owner[t])))))
                for k, t in zip(point[contained], triangle[contained], strict=True)}  # fmt: skip
        out += [(a, b) for _, (a, b) in seen]
        at = end
    return out


def _rounded(found: Triangles, points: F64, far: NDArray[np.float32]) -> F64:
    """Distance by which points may be rounded that are so far from the camera."""
    return np.asarray(ROUNDING * (np.abs(points).max(axis=1, initial=0.0) + np.abs(found.middle).max() + far))


def _in_plane(found: Triangles, points: F64, index: I64) -> F64:
    """Nearest points in the planes of these triangles."""
    above = np.einsum("nk,nk->n", found.normal[index], points) - found.distance[index]
    return np.asarray(points - above[:, None] * found.normal[index])


def _hidden_emitters(out: Export, found: Triangles, plane: I64) -> list[tuple[int, int]]:
    """Pairs of owners of which one emits light, and whose faces lie on each other, seen by the camera or not."""
    emits = np.array([any(one.emits for one in out.scene.closures(slot)) for _, slot in found.owners])
    pairs: set[tuple[int, int]] = set()
    for owner in np.flatnonzero(emits):
        index = np.flatnonzero((found.owner == owner) & (plane >= 0))[:SAMPLES]
        points = found.corners[index].mean(axis=1)
        pairs |= set(_others(found, plane, points, index, np.zeros(len(index), np.float32),
                             np.flatnonzero(plane >= 0)))  # fmt: skip
    return sorted(pairs)


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
            one = contains(np.repeat(found.corners[None, k], len(points), axis=0),
                            np.repeat(found.normal[None, k], len(points), axis=0), points,
                            np.full(len(points), slack))  # fmt: skip
            covered |= one
            owners[int(found.owner[k])] += int(one.sum())
        if covered.any():
            mesh = found.owners[owners.most_common(1)[0][0]][0]
            where = f"lies exactly on object '{out.meshes[mesh].object}' with {covered.mean():.0%} of its area"
            out.report.warn(f"light '{out.lights[name].object}'", f"{where}; in Cycles rounding decides how much of "
                            "its light passes, here all does; move it a little to the side that it lights")  # fmt: skip


def _corners(light: edgegrad.AreaLight) -> F64:
    """(4, 3) corners of an area light."""
    u, v = (light.size[k] * light.to_world[:3, k] for k in (0, 1))
    return np.array([light.to_world[:3, 3] + 0.5 * (a * u + b * v) for a in (-1, 1) for b in (-1, 1)])


def primary_rays(camera: edgegrad.Camera, across: int) -> tuple[F64, F64]:
    """(n, 3) origins and unit directions of rays through a regular grid over the rendered picture."""
    x0, y0, x1, y1 = camera.window
    step = max((x1 - x0) / across, 1.0)
    columns, rows = np.arange(x0 + 0.5 * step, x1, step), np.arange(y0 + 0.5 * step, y1, step)
    x, y = (v.reshape(-1) for v in np.meshgrid(columns, rows))
    turn, origin = camera.to_world[:3, :3], np.tile(camera.to_world[:3, 3], (len(x), 1))
    if camera.kind in PANORAMAS:
        local = panorama_rays(camera, np.column_stack([x, y]))
        seen = ~np.isnan(local[:, 2])
        return origin[seen], local[seen] @ turn.T
    aside = (x - camera.principal_point[0]) / camera.focal
    above = (camera.principal_point[1] - y) * camera.pixel_aspect / camera.focal
    local = np.column_stack([aside, above, -np.ones(len(x))])
    if camera.kind == "ORTHOGRAPHIC":
        return origin + np.column_stack([aside, above]) @ turn[:, :2].T, np.tile(-turn[:, 2], (len(x), 1))
    return origin, (local / np.linalg.norm(local, axis=1, keepdims=True)) @ turn.T

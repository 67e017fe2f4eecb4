"""Export of point clouds as one mesh of spheres."""

from __future__ import annotations

from typing import Any

import bmesh
import numpy as np
from numpy.typing import NDArray

from edgegrad import Camera
from edgegrad.scene.placement import stretches

from ...problem import Report
from .attributes import (
    GENERATED,
    OBJECT,
    OBJECT_NORMAL,
    PARAMETRIC,
    POINT_RADIUS,
    RANDOM_POINT,
    ObjectValues,
    is_of_object,
)
from .hair import MOST_TRIANGLES, pixel_size
from .hashes import hash_words
from .layers import layer_values
from .mesh import MeshArrays
from .normals import shading_normals

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

POINT_SIZE = 0.01  # radius of points without radii in Cycles
# Subdivisions of icospheres up to this width in pixels, and whether they are smooth shaded. The facets of small ones
# have a sphere's normals in the mean.
SUBDIVISIONS = ((2.0, 1, False), (12.0, 2, True), (60.0, 3, True), (np.inf, 4, True))


def build_points(ob: Any, camera: Camera, values: ObjectValues, names: set[str], translucent: bool,
                 report: Report) -> tuple[MeshArrays, dict[str, F32]] | None:  # fmt: skip
    """Return the spheres of an evaluated point cloud and their attributes of these names; None: there are none."""
    where = f"object '{ob.original.name}'"
    read = {name: layer_values(ob.data.attributes.get(name)) for name in {"position", "radius", *names}}
    centres = read["position"]
    if centres is None or not len(centres):
        report.warn(where, "has no points; it is left out")
        return None
    linear = np.asarray(values.matrix[:3, :3], np.float64)
    volume = float(np.linalg.det(linear))
    if abs(volume) < 1e-30:
        report.warn(where, "is scaled to nothing; it is left out")
        return None
    sized = read["radius"]
    radius = np.full(len(centres), POINT_SIZE) if sized is None else sized[:, 0]
    scale = abs(volume) ** (1.0 / 3.0)
    read |= {RANDOM_POINT: (hash_words(np.arange(len(centres)), 0) / 0xFFFFFFFF)[:, None],
             POINT_RADIUS: (1.0 if stretches(linear) else scale) * radius[:, None]}  # fmt: skip
    kept = np.flatnonzero(np.isfinite(centres).all(axis=1) & (radius > 0.0))
    pixel = pixel_size(camera, centres[kept] @ linear.T + values.matrix[:3, 3])
    width = 2.0 * scale * float(np.quantile(radius[kept], 0.9)) / pixel if len(kept) else 0.0
    level, smooth = next((level, smooth) for most, level, smooth in SUBDIVISIONS if width <= most)
    smooth = smooth or stretches(linear)  # the facets have an ellipsoid's normals in the mean, and Cycles a sphere's
    if translucent:
        report.warn(where, "light that passes through its points meets their surface twice, not once as in Cycles")
    while level > 0 and len(kept) * 20 * 4**level > MOST_TRIANGLES:
        level -= 1
    if len(kept) * 20 > MOST_TRIANGLES:
        count = len(kept)
        kept = kept[np.linspace(0, count - 1, MOST_TRIANGLES // 20).astype(np.int64)]
        radius = radius * np.sqrt(count / len(kept))
        report.warn(where, f"only {len(kept)} of its {count} points are rendered, with "
                    f"{np.sqrt(count / len(kept)):.2g} times their radii, since a point cloud may have "
                    f"{MOST_TRIANGLES} triangles")  # fmt: skip
    ball, faces = _ball(level)
    positions = centres[kept][:, None] + radius[kept][:, None, None] * ball
    every = (faces + len(ball) * np.arange(len(kept), dtype=np.int32)[:, None, None]).reshape(-1, 3)
    corners = np.arange(3 * len(every), dtype=np.int32).reshape(-1, 3)
    arrays = MeshArrays(positions.reshape(-1, 3).astype(np.float32), every, corners,
                        np.arange(len(every), dtype=np.int32), np.zeros(len(every), np.int32))  # fmt: skip
    if smooth:
        arrays.smoothing = every
        # Cycles' normals point away from the centre in world space, also where the scale makes points ellipsoids.
        away = ball @ (linear.T @ linear) if stretches(linear) else ball
        away = away / np.linalg.norm(away, axis=1, keepdims=True)
        arrays.normals = np.tile(away, (len(kept), 1)).astype(np.float32)
    point = kept[every // len(ball)]
    out: dict[str, F64 | F32] = {}
    for name in names:
        own = values.value(name) if is_of_object(name) else None
        found = read.get(name)
        if own is not None:
            out[name] = np.broadcast_to(np.array(own), (*every.shape, len(own)))
        elif name in (OBJECT, GENERATED):  # Cycles has no others for points
            out[name] = arrays.positions[every]
        elif name == PARAMETRIC:
            out[name] = np.broadcast_to(np.array((1.0, 0.0, 0.0)), (*every.shape, 3))
        elif name == OBJECT_NORMAL:
            out[name] = shading_normals(arrays.positions, every, arrays.smoothing, arrays.normals)
        elif found is not None:
            out[name] = found[point]
    return arrays, {name: np.ascontiguousarray(value, np.float32) for name, value in out.items()}


def _ball(level: int) -> tuple[F64, NDArray[np.int32]]:
    """Vertices and faces of an icosphere with the area of the unit sphere, and so its mean width."""
    body = bmesh.new()
    try:
        bmesh.ops.create_icosphere(body, subdivisions=level + 1, radius=1.0)
        body.verts.index_update()
        vertices = np.array([tuple(v.co) for v in body.verts])
        faces = np.array([[v.index for v in face.verts] for face in body.faces], np.int32)
    finally:
        body.free()
    p = vertices[faces]
    area = 0.5 * float(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum())
    return vertices * np.sqrt(4.0 * np.pi / area), faces

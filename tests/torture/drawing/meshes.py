"""Meshes: solids, soups of hard triangles, surfaces upon and through each other, instances, normals, attributes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import Mesh
from tests.stability.soups import FACES, triangles
from tests.support import shapes as solids
from tests.support.rich_scene import pose
from tests.torture.drawing.draw import Draw
from tests.torture.drawing.textures import LAYERS

F64 = NDArray[np.float64]
Arrays = tuple[F64, NDArray[np.int32]]
SHAPES = ("cube", "cube", "ball", "sheet", "floor", "floor", "soup", "soup", "split cube", "triangle", "doubled",
          "interpenetrating", "point", "unused vertices", "repeated index", "three on an edge")  # fmt: skip
SURFACES = ("flat", "flat", "smooth", "custom", "some corners")


def shape(draw: Draw, kind: str) -> Arrays:
    """Vertices and faces in a cube of about the size 1."""
    if kind == "ball":
        return solids.ball(draw.whole(0, 2), 0.7)
    if kind == "sheet":
        vertices, faces = solids.sheet(draw.whole(2, 4), 1.5)
        return vertices + draw.one((0.0, 1e-6, 0.1)) * draw.rng.normal(size=vertices.shape), faces
    if kind == "floor":
        vertices, faces = solids.sheet(2, 6.0)
        return vertices - [0.0, 0.0, draw.one((0.5, 0.5, 0.7))], faces
    if kind == "soup":
        kinds = [draw.one(FACES) for _ in range(draw.whole(1, 8))]
        return triangles(draw.rng, kinds, 1.0).reshape(-1, 3), np.arange(3 * len(kinds), dtype=np.int32).reshape(-1, 3)
    if kind == "triangle":
        return draw.rng.normal(size=(3, 3)), np.array([[0, 1, 2]], np.int32)
    if kind == "three on an edge":
        return draw.rng.normal(size=(5, 3)), np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]], np.int32)
    vertices, faces = solids.cube(1.0)
    if kind == "split cube":
        return solids.split(vertices, faces)
    if kind == "doubled":  # on itself, or so near that float32 hardly tells
        lift = draw.one((0.0, 0.0, 1e-7, 1e-4))
        return np.concatenate([vertices, vertices * (1.0 + lift)]), np.concatenate([faces, faces + 8])
    if kind == "interpenetrating":
        return np.concatenate([vertices, 0.8 * vertices @ draw.rotation().T + 0.2]), np.concatenate([faces, faces + 8])
    if kind == "point":
        return np.tile(draw.rng.normal(size=3), (3, 1)), np.array([[0, 1, 2]], np.int32)
    if kind == "unused vertices":
        return np.concatenate([vertices, 3.0 * draw.rng.normal(size=(3, 3))]), faces
    if kind == "repeated index":
        return vertices, np.concatenate([faces, [[0, 0, 1], [2, 2, 2]]]).astype(np.int32)
    return vertices, faces


def affine(draw: Draw, scale: float) -> F64:
    """A transform: rigid, mirrored, or with axes of very different lengths."""
    lengths = draw.one(((1.0, 1.0, 1.0), (1.0, -0.7, 1.2), (0.05, 1.0, 1.0), (0.5, 0.5, 0.5)))
    linear = draw.rotation() @ np.diag(lengths)
    if draw.chance(0.2):
        linear = linear + 0.3 * draw.rng.normal(size=(3, 3))
    return pose(linear, *(scale * draw.rng.normal(scale=0.7, size=3)))


def mesh(draw: Draw, materials: tuple[str, ...], scale: float) -> Mesh:
    """Any mesh, in a world of the size `scale` about the origin."""
    vertices, faces = shape(draw, draw.one(SHAPES))
    count = len(faces)
    if draw.chance(0.5):
        vertices = vertices @ draw.rotation().T + draw.rng.normal(scale=0.5, size=3)
    if draw.chance(0.15):
        vertices = vertices * draw.one((1e-3, 0.1, 20.0))
    slots = tuple(draw.one(materials) for _ in range(draw.whole(1, 2)))
    extras: dict[str, Any] = {}
    if draw.chance(0.25):
        extras["instances"] = np.stack([affine(draw, scale) for _ in range(draw.whole(1, 3))])
    if draw.chance(0.2):
        extras["transform"] = affine(draw, scale)
    if draw.chance(0.5):
        extras["face_material"] = draw.rng.integers(0, len(slots), count).astype(np.int32)
    layers = dict(LAYERS) | ({"UVMap.tangent": 4} if draw.chance(0.3) else {})
    spread = draw.one((1.0, 1.0, 0.0, 100.0))
    attributes = {
        name: (spread * draw.rng.uniform(-0.2, 1.2, (count, 3, size))).astype(np.float32)
        for name, size in layers.items() if draw.chance(0.7)
    }  # fmt: skip
    # From a stream of its own, so that all else in a seed's scene stays.
    shading = float(draw.rng.spawn(1)[0].choice((0.0, 0.0, 0.1, 1.0)))
    return Mesh(
        scale * vertices, faces, slots, attributes=attributes, visible_to=draw.rays(0.15), terminator_shading=shading,
        terminator_offset=draw.one((0.0, 0.0, 0.1, 1.0)), **_normals(draw, faces), **extras,
    )  # fmt: skip


def _normals(draw: Draw, faces: NDArray[np.int32]) -> dict[str, Any]:
    surface = draw.one(SURFACES)
    if surface == "flat":
        return {}
    if surface == "some corners":
        return {"smoothing": np.where(draw.rng.random(faces.shape) < 0.5, faces, -1).astype(np.int32)}
    normals = draw.rng.normal(size=(int(faces.max()) + 1, 3)) if surface == "custom" else None
    return {"smoothing": faces.copy(), "normals": normals}

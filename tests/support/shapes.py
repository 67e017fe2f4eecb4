"""Small meshes and scenes that several tests share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edgegrad import Camera, Material, Mesh, PointLight, Scene, World

Arrays = tuple[NDArray[np.float64], NDArray[np.int32]]


def cube(size: float = 2.0) -> Arrays:
    """A closed cube about the origin, 8 shared vertices, 12 faces seen counter-clockwise from outside."""
    vertices = 0.5 * size * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return vertices, np.array(faces, np.int32)


def sheet(n: int, size: float = 2.0) -> Arrays:
    """A flat square of n x n vertices in the plane z = 0, facing up."""
    line = np.linspace(-0.5 * size, 0.5 * size, n)
    x, y = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    return np.stack([x, y, np.zeros_like(x)], axis=1), faces


def ball(divisions: int, radius: float = 1.0) -> Arrays:
    """A cube of divided faces blown up to a sphere, with shared vertices."""
    vertices, faces = cube()
    for _ in range(divisions):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        distinct, which = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = len(vertices) + which.reshape(3, -1)
        vertices = np.concatenate([vertices, vertices[distinct].mean(axis=1)])
        a, b, c = faces.T
        faces = np.concatenate([np.stack(f, 1) for f in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    vertices = radius * vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, faces.astype(np.int32)


def octahedral_ball(divisions: int) -> Arrays:
    """An octahedron of divided faces blown up to a sphere: all of its edges are convex."""
    corners = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    triangles = corners[faces]
    for _ in range(divisions):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = ((p + q) / np.linalg.norm(p + q, axis=1, keepdims=True) for p, q in ((a, b), (b, c), (c, a)))
        parts = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        triangles = np.concatenate([np.stack(p, axis=1) for p in parts])
    vertices, faces = np.unique(triangles.reshape(-1, 3).round(12), axis=0, return_inverse=True)
    return vertices, faces.reshape(-1, 3).astype(np.int32)


def split(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Arrays:
    """The same mesh with one vertex per corner."""
    return vertices[faces].reshape(-1, 3), np.arange(faces.size, dtype=np.int32).reshape(-1, 3)


def camera(eye: ArrayLike = (0.0, -6.0, 1.0), *, size: tuple[int, int] = (32, 24), fov_x: float = 0.6) -> Camera:
    """A camera at `eye` that looks at the origin; size is width, height."""
    back = np.asarray(eye, np.float64) / np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    to_world = np.eye(4)
    to_world[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    to_world[:3, 3] = eye
    return Camera(to_world, fov_x, size[0], size[1])


def scene(vertices: NDArray[np.float64], faces: NDArray[np.int32], *, world: float = 0.2) -> Scene:
    """A grey object, "object" of the material "clay", in a grey world, lit by the point light "lamp"."""
    return Scene(
        camera(),
        {"object": Mesh(vertices, faces, ("clay",))},
        {"clay": Material(np.array([0.6, 0.5, 0.4]))},
        {"lamp": PointLight(np.array([2.0, -3.0, 4.0]), 600.0)},
        World(np.full(3, world)),
    )


def displaced_sphere(cuts: int, bump: float) -> dict[str, Any]:
    """Unit sphere of 20 cuts² triangles (a subdivided icosahedron), its radius modulated by up to about 1.25 bump."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0],
                        [0, -1, golden], [0, 1, golden], [0, -1, -golden], [0, 1, -golden],
                        [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1]])
    faces = np.array([[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
                      [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8],
                      [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]])
    # Grid nodes (i, j), i + j <= cuts, of one face, row by row.
    i, j = (k.ravel() for k in np.meshgrid(np.arange(cuts + 1), np.arange(cuts + 1), indexing="ij"))
    i, j = i[i + j <= cuts], j[i + j <= cuts]

    def node(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
        return a * (cuts + 1) - a * (a - 1) // 2 + b

    up, down = i + j < cuts, i + j < cuts - 1
    cells = np.concatenate([
        np.stack([node(i, j), node(i + 1, j), node(i, j + 1)], axis=1)[up],
        np.stack([node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)], axis=1)[down],
    ])
    weights = np.stack([cuts - i - j, i, j], axis=1) / cuts
    points = np.einsum("kc,fcd->fkd", weights, corners[faces]).reshape(-1, 3)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    triangles = (cells[None] + (np.arange(20) * len(weights))[:, None, None]).reshape(-1, 3)
    # Neighbouring icosahedron faces share the nodes on their common edge: weld by position on a fine grid.
    key = np.round((points + 2.0) * 2.0**18).astype(np.int64) @ np.array([1, 1 << 21, 1 << 42])
    _, first, welded = np.unique(key, return_index=True, return_inverse=True)
    points, triangles = points[first], welded.reshape(-1)[triangles]
    x, y, z = points.T
    coarse = np.sin(7 * x) * np.sin(6 * y + 1) * np.sin(5 * z + 2)
    fine = np.sin(31 * x) * np.sin(29 * y) * np.sin(27 * z)
    return {"vertices": points * (1 + bump * (coarse + 0.25 * fine))[:, None], "faces": triangles}

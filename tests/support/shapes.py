"""Small meshes and scenes that several tests share."""

from __future__ import annotations

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

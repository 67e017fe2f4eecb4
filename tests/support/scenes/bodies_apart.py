"""The same bodies twice: as one mesh without, and with T-junctions, or as meshes whose edges lie on each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from edgegrad import AreaLight, Material, Mesh, PointLight, Scene, World
from edgegrad.scene.light import Light
from tests.support import shapes
from tests.support.rich_scene import turn
from tests.support.small_scenes import box, camera, matte, rectangle

F64 = NDArray[np.float64]
Faces = NDArray[np.int32]


def cube_above_a_floor(light: str) -> Scene:
    """A turned cube in one piece above a floor, or above a mirror."""
    vertices, faces = shapes.cube(1.0)
    vertices = vertices @ turn(0.3, 0.2, 0.5).T + [0.0, 0.9, 0.0]
    mirror = Material(np.ones(3), kind="GLOSSY", roughness=0.0)
    down = np.array([[1.0, 0, 0, 0], [0, 0, 1, 4.0], [0, -1, 0, 0], [0, 0, 0, 1]])
    lights: dict[str, dict[str, Light]] = {
        "sphere": {"lamp": PointLight(np.array([1.0, 3.0, 1.0]), 100.0, radius=0.3, sphere=True)},
        "point": {"lamp": PointLight(np.array([1.0, 3.0, 1.0]), 100.0)},
        "mirror": {"lamp": AreaLight(down, np.ones(2), power=100.0)}, "sky": {}}
    floor = rectangle((0, 0, 0), (0, 0, 3), (3, 0, 0), "floor")
    return Scene(camera((1.5, 2.5, 3), (0, 0.5, 0), 24, 0.9),
                 {"cube": Mesh(vertices, faces, ("clay",)), "floor": floor},
                 {"clay": matte(0.6, 0.5, 0.4), "floor": mirror if light == "mirror" else matte(0.7, 0.7, 0.7)},
                 lights[light], World(np.full(3, 1.0 if light == "sky" else 0.1)))


def with_junctions(vertices: F64, faces: Faces, closed: bool) -> tuple[F64, Faces]:
    """The same surface, but one side of each face is divided.

    If it is `closed`, a triangle without area joins the two parts to the neighbour, else they are open borders.
    """
    points, halved = list(vertices), set()
    out: list[tuple[int, ...]] = []
    for one, other, third in faces:
        k = next((k for k in range(3)
                  if frozenset(np.roll((one, other, third), -k)[:2].tolist()) not in halved), None)
        if k is None:
            out.append((one, other, third))
            continue
        a, b, c = np.roll((one, other, third), -k).tolist()
        halved.add(frozenset((a, b)))
        middle = len(points)
        points.append(0.37 * vertices[a] + 0.63 * vertices[b])
        out += [(a, middle, c), (middle, b, c)] + [(a, b, middle)] * closed
    return np.array(points), np.array(out, np.int32)


def divided(made: Scene, closed: bool) -> Scene:
    """The scene with T-junctions on its cube."""
    cube = made.meshes["cube"]
    made.meshes["cube"] = Mesh(*with_junctions(cube.vertices, cube.faces, closed), ("clay",))
    return made


def in_pieces(scene: Scene, name: str) -> Scene:
    """The scene with a mesh as one mesh for each of its planes, named by numbers."""
    meshes = dict(scene.meshes)
    mesh = meshes.pop(name)
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    planes = np.unique(np.round(normal, 4), axis=0, return_inverse=True)[1].ravel()
    for plane in range(planes.max() + 1):
        faces = mesh.faces[planes == plane]
        used, numbers = np.unique(faces, return_inverse=True)
        meshes[str(plane)] = Mesh(mesh.vertices[used], numbers.reshape(-1, 3).astype(np.int32), mesh.materials)
    scene.meshes = meshes
    return scene


def room(apart: bool) -> Scene:
    """A room of five walls, lit by a lamp and from outside, as its camera sees it."""
    walls = {"floor": rectangle((0, 0, 0), (0, 0, 2), (2, 0, 0), "a"),
             "back": rectangle((0, 1, -2), (2, 0, 0), (0, 1, 0), "b"),
             "left": rectangle((-2, 1, 0), (0, 0, 2), (0, 1, 0), "c"),
             "right": rectangle((2, 1, 0), (0, 0, 2), (0, 1, 0), "c"),
             "top": rectangle((0, 2, 0), (2, 0, 0), (0, 0, 2), "a")}
    if not apart:
        faces, first = [], 0
        for wall in walls.values():
            faces.append(wall.faces + first)
            first += len(wall.vertices)
        material = np.repeat(["abc".index(wall.materials[0]) for wall in walls.values()], 2).astype(np.int32)
        walls = {"room": Mesh(np.concatenate([wall.vertices for wall in walls.values()]),
                              np.concatenate(faces).astype(np.int32), ("a", "b", "c"), face_material=material)}
    return Scene(camera((0.1, 1.1, 1.9), (0, 0.9, -1), 24, 1.2), walls,
                 {"a": matte(0.7, 0.7, 0.7), "b": matte(0.2, 0.4, 0.8), "c": matte(0.8, 0.3, 0.2)},
                 {"lamp": PointLight(np.array([0.3, 1.5, 0.2]), 60.0)}, World(np.full(3, 0.3)))


def bricks(courses: int, length: int, turned: F64) -> list[Mesh]:
    """Boxes of two colours in running bond: each course is shifted by half a brick."""
    out: list[Mesh] = []
    for course in range(courses):
        for k in range(length - course % 2):
            one = box((k + 0.5 + 0.5 * (course % 2) - 0.5 * length, 0.2 + 0.4 * course, 0), (0.5, 0.2, 0.3),
                      "ab"[len(out) % 2])  # fmt: skip
            out.append(Mesh(0.7 * one.vertices @ turned.T, one.faces, one.materials))
    return out


def joined_meshes(meshes: list[Mesh]) -> Mesh:
    """Meshes of the materials "a" and "b" as one."""
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]),
                np.concatenate([mesh.faces + k for mesh, k in zip(meshes, first, strict=False)]).astype(np.int32),
                ("a", "b"), face_material=np.repeat(["ab".index(mesh.materials[0]) for mesh in meshes],
                                                    [len(mesh.faces) for mesh in meshes]).astype(np.int32))  # fmt: skip


def brick_wall(apart: bool, light: str) -> Scene:
    """A wall of bricks above a floor, each a mesh of its own if they are `apart`."""
    parts = bricks(3, 3, turn(0.0, 0.35, 0.0))
    meshes = {f"brick {k}": part for k, part in enumerate(parts)} if apart else {"wall": joined_meshes(parts)}
    meshes["floor"] = rectangle((0, -0.15, 0), (0, 0, 3), (3, 0, 0), "floor")
    lamp: dict[str, Light] = {"lamp": PointLight(np.array([1.0, 2.5, 2.0]), 100.0, radius=0.3, sphere=True)}
    return Scene(camera((0.8, 1.3, 2.6), (0, 0.4, 0), 24, 0.8), meshes,
                 {"a": matte(0.7, 0.3, 0.2), "b": matte(0.2, 0.5, 0.7), "floor": matte(0.6, 0.6, 0.6)},
                 {} if light == "sky" else lamp, World(np.full(3, 1.0 if light == "sky" else 0.1)))

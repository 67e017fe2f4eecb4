"""Small scenes for tests, and their central differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import edgegrad
from edgegrad.rendering.engine import engine_class
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene import parameters

Floats = NDArray[np.float64]
Make = Callable[[float], edgegrad.Scene]
Moving = Callable[[float], tuple[edgegrad.Scene, Mapping[str, Floats]]]


def need(engine: str) -> None:
    """Skip the test where the engine can't be loaded."""
    try:
        engine_class(engine)
    except ImportError as error:
        pytest.skip(str(error))


def camera(origin: ArrayLike = (0, 0, 4), target: ArrayLike = (0, 0, 0), size: int = 32, fov: float = 0.7,
           up: ArrayLike = (0, 1, 0)) -> edgegrad.Camera:
    """A camera at `origin` that looks at `target`."""
    o, t = np.asarray(origin, float), np.asarray(target, float)
    z = (o - t) / np.linalg.norm(o - t)
    x = np.cross(np.asarray(up, float), z)
    x /= np.linalg.norm(x)
    to_world = np.eye(4)
    to_world[:3] = np.stack([x, np.cross(z, x), z, o], axis=1)
    return edgegrad.Camera(to_world, fov, size, size)


def pixel_at(origin: ArrayLike, target: ArrayLike, up: ArrayLike = (0, 1, 0)) -> edgegrad.Camera:
    """A camera of one pixel, so narrow that it sees one point: its picture is the radiance there."""
    return camera(origin, target, 1, 1e-4, up)


def rectangle(center: ArrayLike, half_u: ArrayLike, half_v: ArrayLike, material: str) -> edgegrad.Mesh:
    """A quad with the normal half_u x half_v."""
    c, u, v = (np.asarray(a, float) for a in (center, half_u, half_v))
    return edgegrad.Mesh(
        np.stack([c - u - v, c + u - v, c + u + v, c - u + v]), np.array([[0, 1, 2], [0, 2, 3]], np.int32), (material,)
    )


def box(center: ArrayLike, half: ArrayLike, material: str, angle: float = 0.0) -> edgegrad.Mesh:
    """A box with outward normals, turned by `angle` (radians) about +Y."""
    corner = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float) * np.asarray(half)
    c, s = np.cos(angle), np.sin(angle)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [t for a, b, k, d in quads for t in ([a, b, k], [a, k, d])]
    turned = corner @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + np.asarray(center, float)
    return edgegrad.Mesh(turned, np.array(faces, np.int32), (material,))


def split(mesh: edgegrad.Mesh) -> edgegrad.Mesh:
    """The same mesh with a vertex of its own for every corner."""
    return edgegrad.Mesh(
        mesh.vertices[mesh.faces.reshape(-1)],
        np.arange(mesh.faces.size, dtype=np.int32).reshape(-1, 3),
        mesh.materials,
        mesh.face_material,
    )


def matte(*color: float) -> edgegrad.Material:
    """A diffuse material."""
    return edgegrad.Material(np.array(color or (0.5, 0.5, 0.5), float))


def glowing(radiance: float, two_sided: bool = False) -> edgegrad.Material:
    """A black emitter."""
    return edgegrad.Material(np.zeros(3), np.full(3, radiance), two_sided)


def white_world(strength: float = 1.0) -> edgegrad.World:
    """A constant white environment."""
    return edgegrad.World(np.ones(3), strength)


FLOOR = {"center": (0, 0, 0), "half_u": (0, 0, 3), "half_v": (3, 0, 0)}
ABOVE = camera((0, 3.2, 2.4), (0, 0, 0.1))


def moved(scene: edgegrad.Scene, theta: float, name: str, direction: ArrayLike) -> edgegrad.Scene:
    """The scene with a mesh moved along a direction."""
    mesh = scene.meshes[name]
    mesh.vertices = mesh.vertices + theta * np.asarray(direction)
    return scene


def mesh_drifts(make: Callable[[], edgegrad.Scene], mesh: str) -> tuple[Make, list[str]]:
    """A scene whose mesh moves along all three axes, and the path of what moves."""
    return lambda t: moved(make(), t, mesh, (0.3, 0.4, 0.2)), [f"meshes.{mesh}.vertices"]


def translated(make: Callable[[], edgegrad.Scene], mesh: str, direction: ArrayLike) -> Moving:
    """A scene whose mesh moves along `direction`."""

    def at(theta: float) -> tuple[edgegrad.Scene, dict[str, Floats]]:
        scene = make()
        rate = np.broadcast_to(np.asarray(direction, float), scene.meshes[mesh].vertices.shape).copy()
        return moved(scene, theta, mesh, rate), {f"meshes.{mesh}.vertices": rate}

    return at


def crease_sheet() -> edgegrad.Scene:
    """An open sheet folded to a concave L that moves under a light: leaks without rule A4."""
    sheet = edgegrad.Mesh(
        np.array([[-0.8, 0, 0.1], [0.8, 0, -0.1], [0.8, 0, 1.0], [-0.8, 0, 1.0], [0.8, 1.0, -0.3], [-0.8, 1.0, 0.1]]),
        np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [0, 4, 5]], np.int32),
        ("clay",),
    )
    return edgegrad.Scene(
        camera((0.5, 1.6, 3.2), (0, 0.3, 0.2), 32, 0.8),
        {"sheet": sheet, "lamp": rectangle((0.5, 3.2, -1.5), (0.4, 0, 0), (0, 0.2, 0.3), "lamp")},
        {"clay": matte(0.7, 0.5, 0.3), "lamp": glowing(20.0, True)},
    )


def three_sheets() -> edgegrad.Scene:
    """Three faces on one edge in a constant environment."""
    a, b = [0.1, -0.8, 0.0], [-0.1, 0.8, 0.2]
    sheet = edgegrad.Mesh(
        np.array([a, b, [1.0, 0.0, 0.5], [-0.9, 0.1, 0.6], [-0.2, 0.2, -0.9]]),
        np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]], np.int32),
        ("clay",),
    )
    return edgegrad.Scene(camera(size=32), {"sheet": sheet}, {"clay": matte(0.7, 0.6, 0.2)}, world=white_world())


def floating_box() -> edgegrad.Scene:
    """A box over a floor under an emissive quad, an area light, a point light and a sun, before a dim sky."""
    lamp_to_world = np.eye(4)
    lamp_to_world[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # shines down: its -Z is -Y
    lamp_to_world[:3, 3] = (-1.0, 2.6, 0.2)
    return edgegrad.Scene(
        replace(ABOVE),
        {
            "floor": rectangle(**FLOOR, material="floor"),
            "box": box((0.2, 0.8, 0.0), (0.4, 0.3, 0.35), "clay", 0.5),
            "lamp": rectangle((1.6, 3.2, -1.2), (0.45, 0, 0), (0, 0.15, 0.45), "lamp"),
        },
        {"floor": matte(), "clay": matte(0.7, 0.3, 0.2), "lamp": glowing(9.0)},
        {
            "area": edgegrad.AreaLight(
                lamp_to_world, np.array([0.5, 0.4]), "RECTANGLE", 12.0, color=np.array([1.0, 0.8, 0.6])
            ),
            "point": edgegrad.PointLight(np.array([0.9, 2.6, -0.3]), 60.0),
            "sun": edgegrad.SunLight(np.array([-0.3, -1.0, 0.2]), 2.0, color=np.array([0.9, 1.0, 0.8])),
        },
        edgegrad.World(np.array([0.2, 0.3, 0.4]), 0.5),
    )


def standing_box() -> edgegrad.Scene:
    """A box that stands on a floor under sun and sky: its lower edges lie in the floor."""
    return edgegrad.Scene(
        camera((0, 0.6, 2.2), (0, 0, 0), fov=1.0),
        {
            "floor": rectangle((0, -0.5, 0), (0, 0, 2), (2, 0, 0), "floor"),
            "box": split(box((-0.3, 0.0, 0.0), (0.2, 0.5, 0.2), "clay", 0.3)),
        },
        {"floor": matte(0.3, 0.5, 0.4), "clay": matte(0.7, 0.6, 0.5)},
        lights={"sun": edgegrad.SunLight(np.array([0.7, -1.0, 0.4]), 4.0)},
        world=white_world(0.3),
    )


# scene and motion, each with all its terms
MOTIONS: dict[str, Moving] = {
    "concave sheet moves": translated(crease_sheet, "sheet", (0.3, 0.4, 1.0)),
    "lamp behind the sheet moves": translated(crease_sheet, "lamp", (1.0, 0.0, 0.3)),
    "three sheets on one edge": translated(three_sheets, "sheet", (1.0, 0.3, 0.2)),
    "box moves": translated(floating_box, "box", (1.0, 0.3, 0.2)),
    "floor rises": translated(floating_box, "floor", (0.0, 1.0, 0.0)),
    "standing box slides": translated(standing_box, "box", (1.0, 0.0, 0.3)),
    "lamp moves": translated(floating_box, "lamp", (1.0, -0.5, 0.3)),
}


def along(make: Make, paths: list[str]) -> Moving:
    """`make` with the rate of change of its parameters beside it."""

    def at(theta: float) -> tuple[edgegrad.Scene, dict[str, Floats]]:
        h = 1e-5
        ahead, behind = make(theta + h), make(theta - h)
        rate = {
            p: (np.asarray(parameters.get(ahead, p), float) - np.asarray(parameters.get(behind, p), float)) / (2 * h)
            for p in paths
        }
        return make(theta), rate

    return at


def central_difference(
    make: Moving, eps: float, spp: int, seeds: int, engine: str, first_seed: int = 0, **depths: Any
) -> tuple[Floats, Floats]:
    """(H, W, 3) mean over seeds of (I(eps/2) - I(-eps/2))/eps with common random numbers, and its standard error."""
    renderers = [Renderer(make(theta)[0], engine=engine) for theta in (0.5 * eps, -0.5 * eps)]
    found = []
    for seed in range(first_seed + 1000, first_seed + 1000 + seeds):
        ahead, behind = (r.render(spp=spp, seed=seed, **depths).astype(np.float64) for r in renderers)
        found.append((ahead - behind) / eps)
    return np.mean(found, axis=0), np.std(found, axis=0, ddof=1) / np.sqrt(seeds)

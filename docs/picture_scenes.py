"""The small scenes of the pictures in the documentation, each with the motion by which it is differentiated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

import edgegrad

F64 = NDArray[np.float64]
WIDTH, HEIGHT = 160, 120


@dataclass
class Case:
    """A scene and a motion in it.

    Attributes
    ----------
    title
        What the row of pictures shows.
    scene, tangent, max_depth
        What is rendered, and along which tangent it is differentiated.
    step
        Length of the finite difference, in units of the tangent.
    terms
        The terms that have a picture of their own.
    """

    title: str
    scene: edgegrad.Scene
    tangent: dict[str, F64]
    max_depth: int
    step: float
    terms: tuple[str, ...] = edgegrad.TERMS


def camera(eye: ArrayLike, target: ArrayLike, fov_x: float = 0.6) -> edgegrad.Camera:
    """A camera at `eye` that looks at `target`, +Z up."""
    back = np.subtract(eye, target)
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    to_world = np.eye(4)
    to_world[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    to_world[:3, 3] = eye
    return edgegrad.Camera(to_world, fov_x, WIDTH, HEIGHT)


def plane(corner: ArrayLike, along: ArrayLike, across: ArrayLike, material: str) -> edgegrad.Mesh:
    """A parallelogram whose front is the side of along x across."""
    c, a, b = (np.asarray(v, np.float64) for v in (corner, along, across))
    return edgegrad.Mesh(np.stack([c, c + a, c + a + b, c + b]), np.array([[0, 1, 2], [0, 2, 3]]), (material,))


def box(centre: ArrayLike, size: ArrayLike, turn: float, material: str) -> edgegrad.Mesh:
    """A box that is turned about the vertical by `turn` radians."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    c, s = np.cos(turn), np.sin(turn)
    vertices = (corners * np.asarray(size)) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return edgegrad.Mesh(vertices + np.asarray(centre), faces, (material,))


def ball(centre: ArrayLike, radius: float, divisions: int, material: str, *, smooth: bool) -> edgegrad.Mesh:
    """An octahedron whose faces are divided `divisions` times and blown up to a sphere."""
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    signs = [(a, b, c) for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    faces = np.array([(a, b, c) if (a + b + c) % 2 else (a, c, b) for a, b, c in signs])
    for _ in range(divisions):
        corners = vertices[faces]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
        a, b, c, ab, bc, ca = (*np.moveaxis(corners, 1, 0), *np.moveaxis(middles, 1, 0))
        parts = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
        vertices, faces = np.unique(parts.round(12), axis=0, return_inverse=True)
        faces = faces.reshape(-1, 3)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    vertices, faces = radius * vertices + np.asarray(centre), faces.astype(np.int32)
    return edgegrad.Mesh(vertices, faces, (material,), smoothing=faces if smooth else None)


def lamp(eye: ArrayLike, target: ArrayLike, size: float, power: float) -> edgegrad.AreaLight:
    """A square area light at `eye` that shines at `target`; only diffuse surfaces are lit by it: it has no caustics."""
    seen_by = frozenset(("diffuse", "shadow"))
    return edgegrad.AreaLight(camera(eye, target).to_world, np.array([size, size]), power=power, visible_to=seen_by)


MATERIALS = {
    "floor": edgegrad.Material(base_color=np.array([0.6, 0.6, 0.6])),
    "wall": edgegrad.Material(base_color=np.array([0.3, 0.4, 0.5])),
    "clay": edgegrad.Material(base_color=np.array([0.75, 0.45, 0.25])),
    "metal": edgegrad.Material(base_color=np.array([0.9, 0.9, 0.9]), metallic=1.0, roughness=0.35),
    "mirror": edgegrad.Material(base_color=np.array([0.9, 0.9, 0.9]), metallic=1.0, roughness=0.0),
    "glass": edgegrad.Material(kind="GLASS", base_color=np.array([0.95, 0.95, 0.95]), roughness=0.0, ior=1.4),
}
FLOOR = plane([-6.0, -4.0, 0.0], [12.0, 0.0, 0.0], [0.0, 8.0, 0.0], "floor")


def _scene(view: edgegrad.Camera, meshes: dict[str, edgegrad.Mesh], lights: dict[str, edgegrad.AreaLight],
           world: float = 0.0) -> edgegrad.Scene:  # fmt: skip
    used = {name for mesh in meshes.values() for name in mesh.materials}
    materials = {name: material for name, material in MATERIALS.items() if name in used}
    return edgegrad.Scene(view, meshes, materials, lights, edgegrad.World(np.full(3, world)))


def _shift(scene: edgegrad.Scene, name: str, by: ArrayLike) -> dict[str, F64]:
    vertices = scene.meshes[name].vertices
    return {f"meshes.{name}.vertices": np.broadcast_to(np.asarray(by, np.float64), vertices.shape).copy()}


def silhouette() -> Case:
    """A grey face that moves before a bright world: only its border changes the picture."""
    triangle = edgegrad.Mesh(
        np.array([[-0.9, 0.0, -0.7], [0.8, 0.2, -0.9], [0.2, -0.2, 1.0]]), np.array([[0, 1, 2]]), ("clay",)
    )
    scene = _scene(camera([0.0, -6.0, 0.0], [0.0, 0.0, 0.0]), {"triangle": triangle}, {}, world=1.0)
    return Case("A triangle moves to the right", scene, _shift(scene, "triangle", [1.0, 0.0, 0.0]), 2, 0.01,
                ("interior", "primary"))


def all_terms() -> Case:
    """A turning box before a wall, above a floor of rough metal: every term has something."""
    return _turning_box("metal", "A box turns above a floor of rough metal", edgegrad.TERMS)


def mirror() -> Case:
    """The same box above a mirror."""
    return _turning_box("mirror", "The same box above a mirror", ("interior", "primary", "shadow"))


def _turning_box(floor: str, title: str, terms: tuple[str, ...]) -> Case:
    centre = np.array([0.0, 0.0, 0.8])
    block = box(centre, [0.9, 0.9, 0.9], 0.5, "clay")
    scene = _scene(
        camera([0.9, -5.2, 2.2], [0.25, 0.1, 0.62], 0.62),
        {"block": block, "wall": plane([-6.0, 1.1, 0.0], [12.0, 0.0, 0.0], [0.0, 0.0, 5.0], "wall"),
         "floor": plane([-6.0, -4.0, 0.0], [12.0, 0.0, 0.0], [0.0, 5.1, 0.0], floor)},
        {"lamp": lamp([-2.4, -3.0, 3.0], centre, 0.6, 300.0)},
    )  # fmt: skip
    about = block.vertices - centre
    turning = np.stack([-about[:, 1], about[:, 0], np.zeros(len(about))], axis=1)
    return Case(title, scene, {"meshes.block.vertices": turning}, 3, 0.02, terms)


def horizon() -> Case:
    """A ball of few faces that is shaded smoothly, under a large lamp."""
    scene = _scene(
        camera([0.1, -5.0, 1.2], [0.0, 0.0, 0.0], 0.5),
        {"ball": ball([0.0, 0.0, 0.0], 1.0, 2, "clay", smooth=True)},
        {"lamp": lamp([-3.0, -0.6, 1.6], [0.0, 0.0, 0.0], 2.5, 250.0)},
    )
    about = scene.meshes["ball"].vertices
    turning = np.stack([-about[:, 1], about[:, 0], np.zeros(len(about))], axis=1)
    return Case("A coarse, smooth-shaded ball turns under a lamp", scene, {"meshes.ball.vertices": turning}, 2, 0.02,
                ("interior", "primary", "shadow"))


def intersection() -> Case:
    """A ball that rises through a floor."""
    scene = _scene(
        camera([0.0, -5.0, 2.6], [0.0, 0.0, 0.2], 0.62),
        {"ball": ball([0.0, 0.0, 0.1], 1.0, 4, "clay", smooth=False), "floor": FLOOR},
        {"lamp": lamp([-3.0, -1.5, 4.0], [0.0, 0.0, 0.0], 0.6, 250.0)},
    )
    return Case("A ball rises through a floor", scene, _shift(scene, "ball", [0.0, 0.0, 1.0]), 2, 0.015,
                ("interior", "primary", "shadow"))


def shadow_only() -> Case:
    """A box outside of the frame whose shadow alone is seen."""
    scene = _scene(
        camera([0.0, -5.2, 3.2], [0.0, 0.0, 0.0], 0.5),
        {"block": box([-1.1, 0.0, 2.6], [0.8, 0.8, 0.8], 0.4, "clay"), "floor": FLOOR},
        {"lamp": lamp([-2.6, 0.0, 5.6], [0.0, 0.0, 0.0], 0.6, 400.0)},
    )
    return Case("A box above the frame moves to the right", scene, _shift(scene, "block", [1.0, 0.0, 0.0]), 2, 0.02,
                ("interior", "primary", "shadow"))


def caustic() -> Case:
    """A ball of glass above the frame, which focuses a lamp on the floor."""
    shining = edgegrad.AreaLight(camera([-0.8, 0.0, 5.0], [0.0, 0.0, 0.0]).to_world, np.array([1.0, 0.7]), power=300.0)
    scene = _scene(
        camera([0.0, -3.6, 1.0], [0.0, 0.0, -0.25], 0.55),
        {"ball": ball([0.1, 0.3, 1.9], 0.6, 8, "glass", smooth=True), "floor": FLOOR},
        {"lamp": shining},
    )
    return Case("A ball of glass above the frame moves to the right", scene, _shift(scene, "ball", [1.0, 0.0, 0.0]), 4,
                0.04, ("interior", "indirect"))


CASES = {f.__name__: f for f in (silhouette, all_terms, mirror, horizon, intersection, shadow_only, caustic)}

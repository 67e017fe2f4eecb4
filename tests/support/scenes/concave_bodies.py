"""Bodies with concave corners that move as one mesh, and others whose interior term is noisy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edgegrad import AreaLight, Image, Material, Mesh, Scene
from edgegrad import expression as e
from tests.support import shapes
from tests.support.rich_scene import pose, turn
from tests.support.scenes.box_under_lights import DOWN
from tests.support.small_scenes import box, camera, matte, rectangle, white_world

SIZE = 32
CLAY = matte(0.8, 0.7, 0.6)


def joined(*meshes: Mesh) -> Mesh:
    """All meshes as one, as Blender joins objects: vertices at one place stay apart."""
    first = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    faces = np.concatenate([m.faces + np.int32(k) for m, k in zip(meshes, first, strict=False)])
    return Mesh(np.concatenate([m.vertices for m in meshes]), faces.astype(np.int32), ("body",))


def patch(corner: ArrayLike, u: ArrayLike, v: ArrayLike, cuts: int = 1) -> Mesh:
    """A parallelogram of cuts x cuts quads with the normal u x v."""
    at = np.linspace(0.0, 1.0, cuts + 1)
    b, a = np.meshgrid(at, at, indexing="ij")
    points = np.asarray(corner, float) + a.reshape(-1, 1) * np.asarray(u) + b.reshape(-1, 1) * np.asarray(v)
    k = (np.arange(cuts)[:, None] * (cuts + 1) + np.arange(cuts)).reshape(-1)
    n = cuts + 1
    faces = np.concatenate([np.stack([k, k + 1, k + n + 1], 1), np.stack([k, k + n + 1, k + n], 1)])
    return Mesh(points, faces.astype(np.int32), ("body",))


def room_corner(cuts: int = 1) -> Mesh:
    """A floor and two walls that meet in one corner."""
    x, y, z = np.eye(3) * 1.2
    return joined(patch((-0.6, 0, -0.6), z, x, cuts), patch((-0.6, 0, -0.6), x, y, cuts),
                  patch((-0.6, 0, -0.6), y, z, cuts))  # fmt: skip


def lit(body: Mesh, material: Material = CLAY, *, eye: ArrayLike = (1.2, 1.5, 2.0), fov: float = 0.7) -> Scene:
    """The body under a lamp and a dim sky."""
    lamp = AreaLight(pose(turn(0.1, 0.0, -0.25) @ DOWN, 0.7, 1.9, 0.9), np.array([0.4, 0.3]), "RECTANGLE", 30.0)
    return Scene(camera(eye, (0.0, 0.2, 0.0), SIZE, fov), {"body": body}, {"body": material}, lights={"lamp": lamp},
                 world=white_world(0.2))  # fmt: skip


def chair() -> Mesh:
    """Seat, back and legs, joined where they touch."""
    legs = [box((x, 0.2, z), (0.04, 0.2, 0.04), "body") for x in (-0.3, 0.3) for z in (-0.3, 0.3)]
    return joined(box((0, 0.43, 0), (0.35, 0.03, 0.35), "body"), box((0, 0.75, -0.32), (0.35, 0.29, 0.03), "body"),
                  *legs)  # fmt: skip


def prop_on_floor() -> Mesh:
    """An L-shaped prop and its floor as one mesh."""
    floor = patch((-1, 0, -1), (0, 0, 2), (2, 0, 0))
    return joined(floor, box((0, 0.15, 0), (0.4, 0.15, 0.3), "body"), box((-0.25, 0.5, 0), (0.15, 0.2, 0.3), "body"))


def smooth_bowl(divisions: int = 3) -> Mesh:
    """The lower half of a ball, seen from above, smooth-shaded."""
    vertices, faces = shapes.ball(divisions, 0.6)
    faces = faces[np.all(vertices[faces][:, :, 1] <= 1e-6, axis=1)][:, ::-1].copy()
    return Mesh(vertices + [0.0, 0.5, 0.0], faces, ("body",), smoothing=faces)


def bevelled(smooth: bool) -> Mesh:
    """A corner with a rounded crease of four strips, flat or smooth-shaded."""
    turn_of = np.linspace(0.0, 0.5 * np.pi, 5)
    radius = 0.1
    profile = np.array([[0.6, 0.0]] + [[radius * (1 - np.sin(t)), radius * (1 - np.cos(t))] for t in turn_of]
                       + [[0.0, 0.8]])  # fmt: skip
    points = np.array([[x, p[1], p[0] - 0.4] for x in (-0.6, 0.6) for p in profile])
    n = len(profile)
    k = np.arange(n - 1)
    faces = np.concatenate([np.stack([k, k + n + 1, k + n], 1), np.stack([k, k + 1, k + n + 1], 1)]).astype(np.int32)
    return Mesh(points, faces[:, ::-1].copy(), ("body",), smoothing=faces[:, ::-1].copy() if smooth else None)


def furnished(*, move_room: bool = False) -> Scene:
    """A closed room with a cabinet on its floor and against its wall, seen from within."""
    room = box((0, 0, 0), (1.0, 1.0, 1.0), "room")
    room.faces = room.faces[:, ::-1].copy()
    meshes = {"body": room if move_room else box((-0.4, -0.6, -0.7), (0.3, 0.4, 0.3), "room"),
              "other": box((-0.4, -0.6, -0.7), (0.3, 0.4, 0.3), "room") if move_room else room}  # fmt: skip
    lamp = AreaLight(pose(DOWN, 0.2, 0.95, 0.2), np.array([0.4, 0.4]), "RECTANGLE", 6.0)
    return Scene(camera((0.5, 0.2, 0.9), (-0.3, -0.5, -0.6), SIZE, 0.9), meshes, {"room": CLAY}, lights={"lamp": lamp})


def normal_mapped_ball(texels: int, *, floor: bool = True) -> Scene:
    """A ball with a normal map of noise on a floor."""
    vertices, faces = shapes.ball(4, 0.5)
    body = Mesh(vertices + [0.0, 0.5, 0.0], faces, ("body",), smoothing=faces)
    uv = np.stack([np.arctan2(vertices[:, 0], vertices[:, 2]) / (2 * np.pi) + 0.5,
                   np.arccos(np.clip(vertices[:, 1] / 0.5, -1, 1)) / np.pi], 1)  # fmt: skip
    corner = uv[faces]
    wraps = corner[..., 0].max(1) - corner[..., 0].min(1) > 0.5
    corner[wraps, :, 0] += corner[wraps, :, 0] < 0.5
    body.attributes["UVMap"] = corner.astype(np.float32)
    scene = lit(body)
    rng = np.random.default_rng(0)
    slope = rng.normal(0.0, 0.25, (texels // 2, texels, 2))
    bent = np.concatenate([slope, np.ones((*slope.shape[:2], 1))], 2)
    bent /= np.linalg.norm(bent, axis=2, keepdims=True)
    scene.images["bumps"] = Image((0.5 * bent + 0.5).astype(np.float32))
    scene.materials["body"] = Material(
        np.array([0.8, 0.7, 0.6]), kind="DIFFUSE",
        textures={"normal": e.ImageTexture("bumps", e.Attribute("UVMap"))},
    )  # fmt: skip
    if floor:
        scene.meshes["floor"] = rectangle((0, 0, 0), (0, 0, 2), (2, 0, 0), "floor")
        scene.materials["floor"] = matte(0.5, 0.5, 0.5)
    return scene


GLOSS = Material(np.array([0.8, 0.7, 0.6]), roughness=0.5, specular_ior_level=0.5)
SATIN = Material(np.array([0.8, 0.7, 0.6]), roughness=0.25, specular_ior_level=0.5)
METAL = Material(np.array([0.8, 0.7, 0.6]), metallic=1.0, roughness=0.4)


def with_glass(body: Mesh) -> Scene:
    """The same body with a small pane of glass in the scene."""
    scene = lit(body)
    scene.meshes["pane"] = rectangle((0.9, 0.3, 0.9), (0.1, 0, -0.1), (0, 0.1, 0), "pane")
    scene.materials["pane"] = Material(np.ones(3), kind="GLASS", roughness=0.0)
    return scene


def with_alpha(body: Mesh) -> Scene:
    """The same body with a small half-transparent leaf in the scene."""
    scene = lit(body)
    scene.meshes["pane"] = rectangle((0.9, 0.3, 0.9), (0.1, 0, -0.1), (0, 0.1, 0), "pane")
    scene.materials["pane"] = Material(np.full(3, 0.5), kind="PRINCIPLED", alpha=0.5)
    return scene


def with_window(body: Mesh) -> Scene:
    """The body has a half-transparent sheet before its corner, through which its faces light each other."""
    scene = with_alpha(body)
    scene.meshes["pane"] = rectangle((-0.3, 0.25, -0.3), (0.15, 0, -0.15), (0, 0.2, 0), "pane")
    return scene


SCENES: dict[str, Callable[[], Scene]] = {
    "room corner": lambda: lit(room_corner()),
    "room corner, 8 cuts": lambda: lit(room_corner(8)),
    "room corner, 64 cuts": lambda: lit(room_corner(64)),
    "prop on floor": lambda: lit(prop_on_floor()),
    "chair": lambda: lit(chair(), eye=(1.2, 1.3, 2.0), fov=0.6),
    "corner, gloss": lambda: lit(room_corner(), GLOSS),
    "corner, satin": lambda: lit(room_corner(), SATIN),
    "corner, metal": lambda: lit(room_corner(), METAL),
    "corner and glass": lambda: with_glass(room_corner()),
    "corner and alpha": lambda: with_alpha(room_corner()),
    "bowl": lambda: lit(smooth_bowl()),
    "bevel, flat": lambda: lit(bevelled(False)),
    "bevel, smooth": lambda: lit(bevelled(True)),
    "cabinet in room": furnished,
    "room about cabinet": lambda: furnished(move_room=True),
    "normal map, 64": lambda: normal_mapped_ball(64),
    "normal map, 1024": lambda: normal_mapped_ball(1024),
    "normal map, alone": lambda: normal_mapped_ball(1024, floor=False),
}
RATE: NDArray[np.float64] = np.array([1.0, 0.25, 0.4])

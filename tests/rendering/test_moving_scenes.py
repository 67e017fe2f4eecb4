"""Whole derivatives of scenes as users have them against central differences: all terms together.

Each scene moves something; the tests of single terms are elsewhere (test_primary_boundary, test_shadow_boundary, ...).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Image, Material, Mesh, Scene, World
from edgegrad import expression as e
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.block_statistics import check, compare
from tests.support.picture_differences import check_agreement
from tests.support.scenes.cornell_box import cornell
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import (
    ABOVE,
    Make,
    along,
    box,
    camera,
    floating_box,
    glowing,
    matte,
    moved,
    need,
    rectangle,
    white_world,
)

EPS = 0.01
SMALL = replace(ABOVE, width=24, height=24)


# ---------------------------------------------------------------- cameras before a lit scene
def lit_view(**rates: Any) -> Make:
    """Numbers of the camera change before a box that floats over a floor, its shadows and a lamp."""

    def make(theta: float) -> Scene:
        scene = floating_box()
        fields = {name: getattr(SMALL, name) + theta * np.asarray(rate) for name, rate in rates.items()}
        scene.camera = replace(SMALL, **fields)
        return scene

    return make


def turning_view(theta: float) -> Scene:
    """The camera turns and moves."""
    scene = floating_box()
    c, s = np.cos(0.3 * theta), np.sin(0.3 * theta)
    to_world = SMALL.to_world.copy()
    to_world[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ to_world[:3, :3]
    to_world[:3, 3] += theta * np.array([0.4, 0.2, -0.3])
    scene.camera = replace(SMALL, to_world=to_world)
    return scene


def through_a_lens(theta: float) -> Scene:
    """The box moves, out of focus."""
    scene = moved(floating_box(), theta, "box", (1.0, 0.3, 0.2))
    scene.camera = replace(SMALL, aperture_radius=0.1, focus_distance=3.0)
    return scene


# ---------------------------------------------------------------- contact
def sliding_wall(material: Material) -> Make:
    """A wall that slides over the floor on which it stands, and approaches the camera."""

    def make(theta: float) -> Scene:
        floor = rectangle((0, 0, 0), (0, 0, 2), (2, 0, 0), "floor")
        wall = rectangle((0.2, 0.5, -0.5), (0.8, 0, 0.1), (0, 0.5, 0), "wall")
        to_world = np.eye(4)
        to_world[:3, 3] = (0.3, 1.0, 3.0)
        scene = Scene(replace(SMALL, width=16, height=16), {"floor": floor, "wall": wall},
                      {"floor": matte(), "wall": material},
                      {"lamp": edgegrad.AreaLight(to_world, np.array([1.0, 0.6]), "RECTANGLE", 20.0)})  # fmt: skip
        return moved(scene, theta, "wall", (1.0, 0.0, 0.3))

    return make


# ---------------------------------------------------------------- textures
def unwrapped_cube() -> Mesh:
    """A turned cube whose faces have islands of their own in the UV map, so that all its edges are seams."""
    mesh = box((0, 0, 0), (0.6, 0.5, 0.55), "painted", 0.6)
    quarter = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    islands = [0.3 * (quarter + [k % 3, k // 3]) + 0.05 for k in range(6)]
    return replace(mesh, attributes={"UVMap": np.concatenate(islands).astype(np.float32)})


def texture(seed: int, channels: int = 3, size: int = 6) -> Image:
    return Image(np.random.default_rng(seed).uniform(0.1, 0.9, (size, size, channels)).astype(np.float32))


def seams(theta: float) -> Scene:
    """A painted cube under an area light that moves and turns."""
    scene = shapes.scene(*shapes.cube())
    c, s = np.cos(0.5 * theta), np.sin(0.5 * theta)
    cube = unwrapped_cube()
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    cube.vertices = cube.vertices @ turn.T + theta * np.array([0.5, 0.3, 0.4])
    painted = Material(textures={"base_color": e.ImageTexture("colors", e.Attribute("UVMap"))})
    return replace(scene, camera=camera((0.5, 1.0, 3.0), size=24), meshes={"cube": cube},
                   materials={"painted": painted}, images={"colors": texture(1)},
                   lights={"lamp": edgegrad.PointLight(np.array([1.0, 2.0, 3.0]), 300.0)})  # fmt: skip


def card(material: Material, theta: float, bent: bool = False) -> Scene:
    """A card with a material before a glowing wall, on which it casts no shadow."""
    leaf = rectangle((0, 0, 0), (0.7, 0.05, 0.1), (-0.05, 0.6, 0.15), "leaf")
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    leaf = replace(leaf, attributes={"UVMap": corners[leaf.faces]})
    leaf.vertices = leaf.vertices + theta * np.array([0.6, 0.3, 0.5])
    if bent:
        leaf.vertices[2] += theta * np.array([0.1, 0.2, 0.7])
    wall = rectangle((0, 0, -1.0), (2, 0, 0), (0, 2, 0), "wall")
    return Scene(
        camera((0.2, 0.1, 3.0), size=24), {"leaf": leaf, "wall": wall},
        {"leaf": material, "wall": glowing(0.4)},
        {"lamp": edgegrad.PointLight(np.array([1.0, 1.5, 3.0]), 200.0)}, World(np.full(3, 0.1)),
        {"mask": texture(2, 1), "bumps": bumps(), "colors": texture(3)},
    )  # fmt: skip


def bumps() -> Image:
    """A normal map of low bumps."""
    tilt = np.random.default_rng(5).uniform(0.35, 0.65, (6, 6, 2))
    return Image(np.concatenate([tilt, np.full((6, 6, 1), 0.95)], axis=2).astype(np.float32))


def cut_out(interpolation: str) -> Make:
    alpha = e.ImageTexture("mask", e.Attribute("UVMap"), interpolation=interpolation)
    return lambda theta: card(Material(np.array([0.8, 0.3, 0.2]), textures={"alpha": alpha}), theta)


def normal_mapped(theta: float) -> Scene:
    bumpy = Material(np.array([0.8, 0.3, 0.2]), textures={"normal": e.ImageTexture("bumps", e.Attribute("UVMap"))})
    return card(bumpy, theta, bent=True)


# ---------------------------------------------------------------- mirrors and glass: chains without edges in them
def before_a_mirror(theta: float) -> Scene:
    """A painted wall that fills a mirror, which turns."""
    wall = rectangle((0, 0, 3.5), (0, 9, 0), (9, 0, 0), "wall")
    wall = replace(wall, attributes={"UVMap": np.array([[0, 0], [9, 0], [9, 9], [0, 9]], np.float32)[wall.faces]})
    mirror = rectangle((0, 0, -1.0), (3, 0, 0.2), (0, 3, 0.1), "mirror")
    mirror.vertices = mirror.vertices + theta * np.array([[0.0, 0.0, 0.4], [0, 0, -0.2], [0, 0, 0.5], [0, 0, 0.1]])
    painted = Material(np.zeros(3), textures={"emission": e.ImageTexture("colors", e.Attribute("UVMap"))})
    mirror_like = Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0)
    return Scene(camera((0.2, 0.1, 1.5), size=24), {"wall": wall, "mirror": mirror},
                 {"wall": painted, "mirror": mirror_like}, images={"colors": texture(4)})  # fmt: skip


def behind_glass(theta: float) -> Scene:
    """A glass slab with curved normals that fills the picture moves before a painted wall."""
    vertices, faces = shapes.sheet(9, 6.0)
    vertices[:, 2] = 0.15 * np.cos(1.5 * vertices[:, 0]) * np.cos(1.2 * vertices[:, 1])
    pane = Mesh(vertices + theta * np.array([0.4, 0.3, 0.2]), faces, ("glass",), smoothing=faces)
    wall = rectangle((0, 0, -2.0), (9, 0, 0), (0, 9, 0), "wall")
    wall = replace(wall, attributes={"UVMap": np.array([[0, 0], [5, 0], [5, 5], [0, 5]], np.float32)[wall.faces]})
    painted = Material(np.zeros(3), textures={"emission": e.ImageTexture("colors", e.Attribute("UVMap"))})
    glass = Material(np.ones(3), kind="REFRACTION", roughness=0.0, ior=1.3)
    return Scene(camera((0.1, 0.1, 3.0), size=24, fov=0.6), {"pane": pane, "wall": wall},
                 {"wall": painted, "glass": glass}, images={"colors": texture(4)})  # fmt: skip


# ---------------------------------------------------------------- in the style of the reference scenes
HIGH = camera((0, 3.2, 2.4), (0, 0, 0.1), 24, 0.7)
FLOOR = {"center": (0, 0, 0), "half_u": (0, 0, 3), "half_v": (3, 0, 0), "material": "floor"}


def receiver_rises(theta: float) -> Scene:
    """A floor that rises under the shadow of a card that isn't seen."""
    meshes = {
        "floor": rectangle(**FLOOR), "card": box((0.5, 2.3, -0.6), (0.35, 0.02, 0.35), "floor", 0.35),
        "lamp": rectangle((1.6, 5.2, -2.2), (0.45, 0, 0), (0, 0.15, 0.45), "lamp"),
    }  # fmt: skip
    scene = Scene(HIGH, meshes, {"floor": matte(), "lamp": glowing(25.0)})
    return moved(scene, theta, "floor", (0.0, 1.0, 0.0))


def ball_over_floor(theta: float, light: edgegrad.PointLight | edgegrad.SunLight, ball: bool = True) -> Scene:
    vertices, faces = shapes.ball(2, 0.35)
    body = Mesh(vertices + [0.2, 0.9, 0.0], faces, ("clay",), smoothing=faces)
    materials = {"floor": matte(), "clay": matte(0.7, 0.3, 0.2)}
    scene = Scene(HIGH, {"floor": rectangle(**FLOOR), "ball": body}, materials, {"light": light})
    return moved(scene, theta, "ball", (1.0, 0.2, 0.0)) if ball else scene


def sun_shadow(theta: float) -> Scene:
    return ball_over_floor(theta, edgegrad.SunLight(np.array([0.3, -1.0, 0.2]), 3.0))


def light_moves(theta: float) -> Scene:
    position = np.array([0.9, 2.6, -0.3]) + theta * np.array([1.0, 0.2, 0.4])
    return ball_over_floor(theta, edgegrad.PointLight(position, 100.0), ball=False)


def self_shadow(theta: float) -> Scene:
    """A step that shades itself as it moves."""
    tread, riser = np.array([[-1.0, 0, 0.8], [1, 0, 0.8], [1, 0, 0], [-1, 0, 0]]), np.array([0.0, 0.8, 0.0])
    vertices = np.concatenate([tread, tread[2:] + riser, tread[2:] + riser + [0, 0, -0.8]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5], [5, 4, 6], [5, 6, 7]])
    step = Mesh(vertices + theta * np.array([0.3, 0.5, 1.0]), faces, ("floor",))
    lamp = rectangle((0.5, 3.0, -2.5), (0.5, 0, 0), (0, 0.3, 0.4), "lamp")
    return Scene(HIGH, {"step": step, "lamp": lamp}, {"floor": matte(), "lamp": glowing(20.0, True)})


def clipped_triangle(theta: float) -> Scene:
    """A triangle that reaches over the picture's border and behind the camera."""
    vertices = np.array([[-0.9, -0.7, 0.0], [2.8, -0.9, 0.2], [0.2, 1.0, 5.0]])
    leaf = Mesh(vertices + theta * np.array([1.0, 0.4, 0.1]), np.array([[0, 1, 2]]), ("clay",))
    return Scene(camera(size=24), {"leaf": leaf}, {"clay": matte(0.7, 0.5, 0.3)}, world=white_world())


def visible_emitter(theta: float) -> Scene:
    """A glowing box over the floor that it lights."""
    body = box((0.1, 0.7, 0.0), (0.3, 0.25, 0.3), "lamp", 0.4)
    scene = Scene(HIGH, {"floor": rectangle(**FLOOR), "lamp": body}, {"floor": matte(), "lamp": glowing(4.0)})
    return moved(scene, theta, "lamp", (1.0, 0.3, 0.2))


def blob(theta: float) -> Scene:
    """A bumpy smooth-shaded body under an area light."""
    vertices, faces = shapes.ball(3)
    vertices = vertices * (1.0 + 0.2 * np.sin(7 * vertices[:, :1]) * np.sin(6 * vertices[:, 1:2] + 1))
    body = Mesh(vertices + theta * np.array([1.0, 0.3, 0.0]), faces, ("clay",), smoothing=faces)
    lamp = rectangle((-3, 3, 3), (0.3, 0.3, 0), (0.15, 0, 0.15), "lamp")
    return Scene(camera(size=24), {"body": body, "lamp": lamp}, {"clay": matte(), "lamp": glowing(60.0, True)})


BOX, LEAF = ["meshes.box.vertices"], ["meshes.leaf.vertices"]
# scene, parameters, and options of the comparison
CASES: dict[str, tuple[Make, list[str], dict[str, Any]]] = {
    "camera turns": (turning_view, ["camera.to_world"], {}),
    "focal length": (lit_view(fov_x=0.5), ["camera.fov_x"], {}),
    "lens shift": (lit_view(shift=[0.2, -0.1]), ["camera.shift"], {}),
    "box out of focus": (through_a_lens, BOX, {"eps": 0.05}),
    "wall slides along a floor": (sliding_wall(matte(0.7, 0.6, 0.3)), ["meshes.wall.vertices"], {}),
    "glowing wall slides along a floor": (sliding_wall(glowing(2.0, True)), ["meshes.wall.vertices"], {}),
    "UV seams": (seams, ["meshes.cube.vertices"], {}),
    "cut-out with soft borders": (cut_out("LINEAR"), LEAF, {}),
    "normal map": (normal_mapped, LEAF, {}),
    "mirror turns": (before_a_mirror, ["meshes.mirror.vertices"], {}),
    "glass moves": (behind_glass, ["meshes.pane.vertices"], {}),
    "floor rises under a shadow": (receiver_rises, ["meshes.floor.vertices"], {}),
    "shadow of the sun": (sun_shadow, ["meshes.ball.vertices"], {}),
    "point light moves": (light_moves, ["lights.light.position"], {}),
    "step shades itself": (self_shadow, ["meshes.step.vertices"], {}),
    "Cornell box, direct light": (cornell, ["meshes.tall.vertices"], {}),
    "clipped triangle": (clipped_triangle, LEAF, {}),
    # Few samples meet the lamp from the floor: their spread needs many seeds to be known.
    "visible emitter": (visible_emitter, ["meshes.lamp.vertices"], {"seeds": 64, "reference_spp": 512}),
    "smooth blob": (blob, ["meshes.body.vertices"], {}),
}
# The others run with the slow tests.
QUICK = ("camera turns", "UV seams", "cut-out with soft borders", "normal map", "mirror turns", "glass moves",
         "clipped triangle", "step shades itself")  # fmt: skip


@pytest.mark.parametrize("name", slow_but(CASES, QUICK))
def test_motion_agrees_with_central_differences(name: str) -> None:
    need("native")
    make, paths, options = CASES[name]
    check_agreement(along(make, paths), **{"eps": EPS, "reference_spp": 256, **options})


def test_moving_the_room_is_moving_the_camera_back() -> None:
    """The same samples: all surfaces and lights move one way, or the camera the other."""
    need("native")
    scene = floating_box()
    scene.camera = SMALL
    direction = np.array([0.7, 0.3, -0.4])
    room = {f"meshes.{name}.vertices": np.broadcast_to(direction, mesh.vertices.shape)
            for name, mesh in scene.meshes.items()}  # fmt: skip
    back = np.zeros((4, 4))
    back[:3, 3] = -direction
    room["lights.point.position"], room["lights.area.to_world"] = direction, -back
    renderer = Renderer(scene)
    one = np.array([renderer.render_forward(room, spp=64, seed=k) for k in range(4)], np.float64)
    other = np.array([renderer.render_forward({"camera.to_world": back}, spp=64, seed=k + 4) for k in range(4)])
    check(compare(one - other.mean(axis=0), np.zeros(one.shape[1:]), other.std(axis=0, ddof=1) / 2.0))
    together = renderer.render_forward({**room, "camera.to_world": -back}, spp=16)
    assert np.linalg.norm(together) < 1e-4 * np.linalg.norm(one[0])

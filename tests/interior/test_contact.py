"""Light between surfaces that nearly touch and move along each other, sampled in fixed directions near the contact."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from edgegrad import AreaLight, Image, Material, Mesh, PointLight, Renderer, Scene
from edgegrad import expression as e
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.rich_scene import pose, turn
from tests.support.scenes.box_under_lights import DOWN
from tests.support.small_scenes import Make, along, box, camera, glowing, matte, moved, rectangle

PALE, RED = matte(0.8, 0.7, 0.6), matte(0.8, 0.4, 0.3)


def corner(*, glow: float = 0.0) -> Scene:
    """A wall that stands on a floor; it glows, or lamps light both."""
    scene = Scene(camera((0.3, 1.0, 2.2), (0.1, 0.2, 0.0), 16, 0.7),
                  {"floor": rectangle((0, 0, 0.5), (0, 0, 1), (1, 0, 0), "floor"),
                   "wall": rectangle((0.1, 0.4, -0.2), (0.6, 0, 0.1), (0, 0.4, 0), "wall")},
                  {"floor": PALE, "wall": glowing(glow, True) if glow else RED})  # fmt: skip
    if not glow:
        scene.lights["lamp"] = PointLight(np.array([0.6, 1.6, 1.2]), 120.0)
    return scene


def sunk_wall(*, flat: bool = True) -> Scene:
    """A wall that is sunk in the floor a little, as things are that stand on uneven ground; the floor may be bumpy."""
    scene = corner()
    scene.meshes["wall"].vertices[:2, 1] -= 4e-4
    if not flat:
        bump = e.Bump(e.Noise(e.Attribute("UVMap"), scale=30.0, detail=6.0), strength=0.3)
        mesh = scene.meshes["floor"]
        mesh.attributes["UVMap"] = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)[mesh.faces]
        scene.materials["floor"] = Material(kind="DIFFUSE", base_color=PALE.base_color, roughness=0.0,
                                            textures={"normal": bump})  # fmt: skip
    return scene


def painted() -> Scene:
    """The same, painted and glossy."""
    scene = corner()
    scene.images["paint"] = Image(np.random.default_rng(3).uniform(0.1, 0.9, (6, 6, 3)).astype(np.float32))
    paint = e.ImageTexture("paint", e.Attribute("UVMap"))
    for name in ("floor", "wall"):
        mesh = scene.meshes[name]
        mesh.attributes["UVMap"] = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)[mesh.faces]
        scene.materials[name] = Material(kind="PRINCIPLED", roughness=0.5, textures={"base_color": paint})
    return scene


def beside_a_column() -> Scene:
    """A smooth-shaded column of six sides on a floor."""
    scene = corner()
    turn_of = np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False)
    ring = 0.2 * np.stack([np.cos(turn_of), np.zeros(6), np.sin(turn_of)], axis=1)
    k, n = np.arange(6), (np.arange(6) + 1) % 6
    faces = np.concatenate([np.stack([k, k + 6, n + 6], 1), np.stack([k, n + 6, n], 1)]).astype(np.int32)
    column = Mesh(np.concatenate([ring, ring + [0.0, 0.5, 0.0]]), faces, ("wall",), smoothing=faces)
    scene.meshes = {"floor": scene.meshes["floor"], "wall": column}
    scene.camera = camera((0.0, 1.2, 0.6), (0.0, 0.0, 0.3), 16, 0.3)
    return scene


def with_block() -> Scene:
    """A block that stands on a floor, beside another one that is sunk in it and a board over both."""
    scene = corner()
    scene.meshes["wall"] = box((0.0, 0.25, 0.0), (0.25, 0.25, 0.2), "wall", 0.3)
    scene.meshes["sunk"] = box((0.5, 0.1, 0.15), (0.15, 0.2, 0.2), "sunk", 0.8)
    scene.meshes["board"] = rectangle((0.2, 0.75, 0.35), (0.12, 0, 0.05), (0.0, 0.05, -0.1), "sunk")
    scene.materials["sunk"] = matte(0.4, 0.7, 0.8)
    scene.lights = {"lamp": AreaLight(pose(turn(0.1, 0.0, -0.25) @ DOWN, 0.4, 1.8, 0.6), np.array([0.4, 0.3]),
                                      "RECTANGLE", 20.0)}  # fmt: skip
    return scene


def behind_bar() -> Scene:
    """A glowing wall on a floor, a bar close before it, and a block sunk into both; the camera sees the floor."""
    scene = corner(glow=3.0)
    scene.camera = camera((0.2, 1.2, 0.7), (0.15, 0.0, 0.0), 16, 0.35)
    scene.meshes["wall"].vertices[:2, 1] -= 0.1
    scene.meshes["bar"] = rectangle((0.0, 0.09, -0.05), (0.12, 0.01, 0.02), (0.0, 0.05, 0.01), "black")
    scene.meshes["block"] = box((0.35, 0.0, -0.15), (0.07, 0.15, 0.08), "black", 0.4)
    scene.materials["black"] = matte(0.0, 0.0, 0.0)
    return scene


def with_posts() -> Scene:
    """A glowing wall on a floor, and posts that are sunk into both; the camera sees the floor."""
    scene = behind_bar()
    del scene.meshes["bar"]
    for k, x in enumerate((0.0, 0.12, 0.24)):
        scene.meshes[f"post {k}"] = box((x, 0.05, -0.2), (0.03, 0.2, 0.06), "black", 0.2)
    return scene


def striped() -> Scene:
    """A wall that shadows of a bar fall on, seen by the light that it passes on to the floor."""
    scene = behind_bar()
    scene.materials["wall"] = matte(0.9, 0.8, 0.7)
    scene.meshes["bar"] = rectangle((0.1, 0.25, 0.4), (0.2, 0.05, 0.0), (-0.03, 0.06, 0.05), "black")
    scene.lights["lamp"] = PointLight(np.array([0.2, 0.5, 1.2]), 120.0, receivers=("wall",))
    return scene


def pixelated(checkered: bool = False) -> Scene:
    """A wall with sharp texels or a checkerboard, seen by the light that it passes on to the floor."""
    scene = striped()
    del scene.meshes["bar"], scene.meshes["block"], scene.materials["black"]
    odd = (np.add.outer(np.arange(3), np.arange(7)) % 2)[..., None]
    pixels = np.where(odd, [[[0.9, 0.3, 0.8]]], [[[0.05, 0.7, 0.1]]])
    scene.images["paint"] = Image(pixels.astype(np.float32))
    place = e.VectorMath("MULTIPLY_ADD", e.Attribute("UVMap"), (1.0, 0.8, 1.0), (0.2, 0.1, 0.0))
    mesh = scene.meshes["wall"]
    mesh.attributes["UVMap"] = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)[mesh.faces]
    # Black for the camera, since moving borders of texels that it sees have no derivative
    unseen = e.Math("SUBTRACT", 1.0, e.LightPath("CAMERA"))
    paint: e.Expression = e.ImageTexture("paint", place, "CLOSEST")
    if checkered:
        paint = e.Checker(place, (0.9, 0.3, 0.8), (0.05, 0.7, 0.1), 6.0)
    paint = e.VectorMath("SCALE", paint, scale=unseen)
    scene.materials["wall"] = Material(kind="DIFFUSE", roughness=0.0, textures={"base_color": paint})
    return scene


def moves(make: Callable[[], Scene], *rate: float, name: str = "wall") -> Make:
    return lambda theta: moved(make(), theta, name, rate)


def camera_moves(make: Callable[[], Scene], *rate: float) -> Make:
    def moved(theta: float) -> Scene:
        scene = make()
        scene.camera.to_world[:3, 3] += theta * np.array(rate)
        return scene

    return moved


WALL, FLOOR, VIEW = ["meshes.wall.vertices"], ["meshes.floor.vertices"], ["camera.to_world"]
CASES: dict[str, tuple[Make, list[str], dict[str, Any]]] = {
    "glowing wall slides": (moves(lambda: corner(glow=3.0), 1.0, 0.0, 0.15), WALL, {"max_depth": 2}),
    "wall slides": (moves(corner, 1.0, 0.0, 0.15), WALL, {"max_depth": 5}),
    "painted wall slides": (moves(painted, 1.0, 0.0, 0.15), WALL, {"max_depth": 4}),
    "sunk wall slides": (moves(sunk_wall, 1.0, 0.0, 0.15), WALL, {"max_depth": 4}),
    "sunk wall slides over bumps": (moves(lambda: sunk_wall(flat=False), 1.0, 0.0, 0.15), WALL, {"max_depth": 3}),
    "smooth column slides": (moves(beside_a_column, 1.0, 0.0, 0.4), WALL, {"max_depth": 4}),
    "floor slides": (moves(corner, 0.5, 0.0, -1.0, name="floor"), FLOOR, {"max_depth": 4}),
    "block moves": (moves(with_block, 1.0, 0.0, 0.4), WALL, {"max_depth": 4}),
    "floor slides behind a bar": (moves(behind_bar, 0.6, 0.2, -0.5, name="floor"), FLOOR, {"max_depth": 2}),
    "floor slides beside posts": (moves(with_posts, 0.6, 0.2, -0.5, name="floor"), FLOOR, {"max_depth": 2}),
    "wall slides behind a bar": (moves(behind_bar, 1.0, 0.0, 0.15), WALL, {"max_depth": 2}),
    "wall slides in a shadow": (moves(striped, 1.0, 0.0, 0.15), WALL, {"max_depth": 3}),
    "floor slides in a shadow": (moves(striped, 0.6, 0.2, -0.5, name="floor"), FLOOR, {"max_depth": 3}),
    "pixelated wall slides": (moves(pixelated, 1.0, 0.0, 0.15), WALL, {"max_depth": 3}),
    "checkered wall slides": (moves(lambda: pixelated(True), 1.0, 0.0, 0.15), WALL, {"max_depth": 3}),
    "floor slides before a pixelated wall": (moves(pixelated, 0.6, 0.2, -0.5, name="floor"), FLOOR, {"max_depth": 3}),
    "camera moves": (camera_moves(with_block, 0.4, 0.2, -0.3), VIEW, {"max_depth": 4}),
}


# These need more samples: horizons of bodies with few faces, and light that passes bars after the floor scattered it.
MORE: dict[str, dict[str, int]] = {
    "smooth column slides": {"spp": 128, "seeds": 64},
    "wall slides in a shadow": {"seeds": 32},
}


@pytest.mark.parametrize("name", CASES)
def test_motion_at_contact_agrees_with_central_differences(name: str) -> None:
    need_every_table()
    make, paths, options = CASES[name]
    check_agreement(along(make, paths), **options, **MORE.get(name, {}))


@pytest.mark.parametrize("name", CASES)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    make, paths, options = CASES[name]
    check_transpose(make, paths, spp=8, **options)


def test_bits_are_equal() -> None:
    need_every_table()
    check_equal_bits(CASES["block moves"][0], WALL, spp=4, max_depth=5)


@pytest.mark.parametrize(
    "name", ["glowing wall slides", "wall slides", "sunk wall slides", "painted wall slides", "pixelated wall slides",
             "checkered wall slides", "smooth column slides", "camera moves"])  # fmt: skip
def test_more_samples_bring_less_noise(name: str) -> None:
    """Rates of 1/r have no variance: sampled in the material form, 16 times the samples have errors as large."""
    need_every_table()
    make, paths, options = CASES[name]
    scene, rate = along(make, paths)(0.0)
    renderer = Renderer(scene)

    def error(spp: int) -> float:
        """The median over seeds of the derivative picture's error."""
        pictures = np.array([renderer.render_forward(rate, spp=spp, seed=k, **options) for k in range(24)])
        return float(np.median(np.sum((pictures - np.median(pictures, axis=0)) ** 2, axis=(1, 2, 3)))) ** 0.5

    # With a variance errors fall to a quarter, without one they stay: half is in the middle.
    assert error(128) < 0.5 * error(8)

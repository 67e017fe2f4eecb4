"""Edges seen in perfect mirrors and through smooth glass, and all that moves them."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np

import edgegrad
from tests.support import shapes
from tests.support.small_scenes import Floats, Make, box, camera, glowing, rectangle

DEPTH = 7
OPTIONS: dict[str, Any] = {"eps": 0.01, "seeds": 8, "thetas": 4, "reference_spp": 256, "max_depth": DEPTH}
MIRROR = edgegrad.Material(np.array([0.9, 0.8, 0.7]), kind="GLOSSY", roughness=0.0, multiscatter=False)
GLASS = edgegrad.Material(np.ones(3), kind="GLASS", roughness=0.0, ior=1.5, multiscatter=False)
WARM = edgegrad.Material(np.zeros(3), np.array([2.0, 1.2, 0.5]), True)
MATERIALS = {"mirror": MIRROR, "glass": GLASS, "warm": WARM, "cold": glowing(0.8, True)}


def ball(center: tuple[float, float, float], radius: float, material: str, divisions: int = 3) -> edgegrad.Mesh:
    """A smooth-shaded ball."""
    vertices, faces = shapes.ball(divisions, radius)
    return edgegrad.Mesh(vertices + np.asarray(center), faces, (material,), smoothing=faces.copy())


def scene(view: edgegrad.Camera, meshes: dict[str, edgegrad.Mesh]) -> edgegrad.Scene:
    return edgegrad.Scene(deepcopy(view), meshes, deepcopy(MATERIALS), world=edgegrad.World(np.ones(3), 0.3))


def shifted(mesh: edgegrad.Mesh, by: Floats) -> edgegrad.Mesh:
    return replace(mesh, vertices=mesh.vertices + by)


def before_mirror(moving: str) -> Make:
    """A box, out of sight, before a flat mirror; the box, the mirror or the camera moves."""

    def make(theta: float) -> edgegrad.Scene:
        mirror = rectangle((0, 0, -1), (1.6, 0, 0), (0, 1.6, 0), "mirror")
        shown = box((0.2, 0.1, 1.0), (0.35, 0.3, 0.25), "warm", 0.5)
        origin, target = np.array([0.6, 1.6, 2.2]), np.array([0.1, 0.0, -1.2])
        match moving:
            case "box":
                shown = shifted(shown, theta * np.array([1.0, 0.4, -0.3]))
            case "mirror":
                mirror = shifted(mirror, theta * np.array([[0, 0, 1.3], [0, 0, 0.7], [0, 0, 0.7], [0, 0, 1.3]]))
            case "camera":
                origin = origin + theta * np.array([1.0, -0.5, 0.2])
        return scene(camera(origin, target, 32, 0.9), {"mirror": mirror, "box": shown})

    return make


def thin_rods(theta: float) -> edgegrad.Scene:
    """Rods before a mirror, in which each is half a pixel wide: most places beside them show what is behind them."""
    made = before_mirror("nothing")(0.0)
    del made.meshes["box"]
    for k, turned in enumerate((0.1, 0.9, 1.7)):
        rod = box((0.5 * k - 0.3, 0.1, 0.8), (0.03, 0.03, 0.8), "warm", turned)
        made.meshes[f"rod {k}"] = shifted(rod, theta * np.array([1.0, 0.5, 0.0])) if k != 1 else rod
    return made


def round_mirror(moving: str) -> Make:
    """A box beside a mirroring ball."""

    def make(theta: float) -> edgegrad.Scene:
        step = theta * np.array([0.7, 0.5, 0.4])
        meshes = {
            "ball": ball((0, 0, 0), 1.0, "mirror"),
            "box": box((1.0, 1.2, 1.6), (0.6, 0.4, 0.5), "warm", 0.4),
        }
        meshes[moving] = shifted(meshes[moving], step)
        return scene(camera((0, 0, 4.5), (0, 0, 0), 32, 0.6), meshes)

    return make


def behind_glass(moving: str) -> Make:
    """A box and a card behind a ball of glass."""

    def make(theta: float) -> edgegrad.Scene:
        glass = ball((0, 0, 0), 1.0, "glass")
        shown = box((0.3, 0.2, -3.0), (0.7, 0.5, 0.4), "warm", 0.4)
        card = rectangle((-0.9, -0.6, -2.2), (0.6, 0.1, 0), (-0.1, 0.5, 0.2), "cold")
        view = camera((0, 0, 4.5), (0, 0, 0), 32, 0.6)
        materials = deepcopy(MATERIALS)
        match moving:
            case "box":
                shown = shifted(shown, theta * np.array([1.0, 0.4, -0.3]))
            case "glass":
                glass = shifted(glass, theta * np.array([0.6, -0.4, 0.3]))
            case "camera":
                view = camera((theta, -0.5 * theta, 4.5), (0, 0, 0), 32, 0.6)
            case "ior":
                materials["glass"] = replace(GLASS, ior=1.5 + theta)
        made = scene(view, {"glass": glass, "box": shown, "card": card})
        return replace(made, materials=materials)

    return make


def before_sky(theta: float) -> edgegrad.Scene:
    """A ball of glass alone under a smooth sky: no edge moves, but where its rays go does."""
    made = scene(camera((0, 0, 4.5), (0, 0, 0), 32, 0.6), {"glass": ball((0, 0, 0), 1.0, "glass")})
    height, width = 32, 64
    y, x = np.mgrid[:height, :width]
    sky = 1.0 + 0.8 * np.stack([np.sin(2.0 * np.pi * (k + 1) * x / width + k) * np.sin(np.pi * (y + 0.5) / height)
                                for k in range(3)], axis=-1)
    return replace(made, materials={**MATERIALS, "glass": replace(GLASS, ior=1.5 + theta)},
                   world=edgegrad.World(np.ones(3), image="sky"), images={"sky": edgegrad.Image(sky)})


def two_mirrors(theta: float) -> edgegrad.Scene:
    """A box seen by two mirrors, one of which turns, with a lens and a wide filter."""
    first = rectangle((0, 0, -1), (1.2, 0, 0), (0, 1.2, 0), "mirror")
    second = rectangle((0, 0, 4.0), (-2.5, 0, 0), (0, 2.5, 0.3), "mirror")
    second = shifted(second, theta * np.array([[0.0, 0, 0.8], [0, 0, -0.8], [0, 0, -0.8], [0, 0, 0.8]]))
    shown = box((0.5, 1.1, 0.6), (0.3, 0.2, 0.25), "warm", 0.5)
    view = replace(camera((0.5, 0.3, 2.2), (0, 0, -1), 32, 0.8), aperture_radius=0.02, focus_distance=5.0,
                   filter="BLACKMAN_HARRIS", filter_width=2.0)
    return scene(view, {"first": first, "second": second, "box": shown})


def block_of_glass(theta: float) -> edgegrad.Scene:
    """A card seen through a block with flat faces, whose edges are seen through each other, and which turns."""
    block = box((0, 0, 0), (0.8, 0.6, 0.5), "glass", 0.5 + theta)
    card = rectangle((0.2, 0.1, -1.5), (0.9, 0.1, 0), (-0.1, 0.6, 0.2), "warm")
    return scene(camera((0.4, 1.0, 3.5), (0, 0, 0), 32, 0.6), {"block": block, "card": card})


def ball_in_mirror(theta: float) -> edgegrad.Scene:
    """A smooth ball that comes before another one in a mirror, under a sun."""
    meshes = {
        "mirror": rectangle((0, 0, -1), (1.6, 0, 0), (0, 1.6, 0), "mirror"),
        "near": ball((0.3 + theta, 0.1, 0.8), 0.45, "clay", 2),
        "far": ball((0.0, -0.1, 1.9), 0.6, "clay", 2),
    }
    made = scene(camera((0.4, 2.2, 1.8), (0.1, 0.0, -1.2), 32, 0.7), meshes)
    return replace(made, materials={**MATERIALS, "clay": edgegrad.Material(np.array([0.8, 0.6, 0.5]))},
                   lights={"sun": edgegrad.SunLight(np.array([0.3, -0.5, 1.0]), 2.0, casts_shadow=False)},
                   world=edgegrad.World(np.zeros(3)))


def copies(theta: float) -> edgegrad.Scene:
    """Two instances of a box, one of them mirrored, move before a flat mirror."""
    made = before_mirror("nothing")(0.0)
    places = np.tile(np.eye(4), (2, 1, 1))
    places[0, :3, 3] = [-0.4 + theta, -0.1, 0.5 * theta]
    places[1, :3] = [[-1.0, 0.2 + theta, 0, 0.9], [0, 0.8, 0, 0.2], [theta, 0, 0.9, 0.1]]
    made.meshes["box"].instances = places
    return made


def small_mirror(kind: str) -> Make:
    """A box before a mirror in a part of the picture, blurred by a lens; the mirror is an instance."""

    def make(theta: float) -> edgegrad.Scene:
        made = before_mirror("box")(theta)
        place = np.diag([0.4, 0.35, 1.0, 1.0])
        place[:3, 3] = [0.05, 0.1, 0.02]
        made.meshes["mirror"].instances = place[None]
        view = replace(made.camera, kind=kind, ortho_width=2.4, aperture_radius=0.05, focus_distance=2.2)
        return replace(made, camera=view)

    return make


CASES: dict[str, tuple[Make, list[str]]] = {
    "small mirror: box moves": (small_mirror("PERSPECTIVE"), ["meshes.box.vertices"]),
    "small mirror: box moves, orthographic": (small_mirror("ORTHOGRAPHIC"), ["meshes.box.vertices"]),
    "flat mirror: box moves": (before_mirror("box"), ["meshes.box.vertices"]),
    "flat mirror: thin rods move": (thin_rods, ["meshes.rod 0.vertices", "meshes.rod 2.vertices"]),
    "flat mirror: mirror moves": (before_mirror("mirror"), ["meshes.mirror.vertices"]),
    "flat mirror: camera moves": (before_mirror("camera"), ["camera.to_world"]),
    "round mirror: box moves": (round_mirror("box"), ["meshes.box.vertices"]),
    "round mirror: mirror moves": (round_mirror("ball"), ["meshes.ball.vertices"]),
    "glass: box moves": (behind_glass("box"), ["meshes.box.vertices"]),
    "glass: glass moves": (behind_glass("glass"), ["meshes.glass.vertices"]),
    "glass: camera moves": (behind_glass("camera"), ["camera.to_world"]),
    "glass: its index grows": (behind_glass("ior"), ["materials.glass.ior"]),
    "glass: its index grows before a sky": (before_sky, ["materials.glass.ior"]),
    "glass: a block turns": (block_of_glass, ["meshes.block.vertices"]),
    "flat mirror: ball before ball": (ball_in_mirror, ["meshes.near.vertices"]),
    "flat mirror: instances move": (copies, ["meshes.box.instances"]),
    "two mirrors: one turns": (two_mirrors, ["meshes.second.vertices"]),
}

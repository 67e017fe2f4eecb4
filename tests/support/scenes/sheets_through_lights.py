"""Sheets that pass through lamps, or through other surfaces that light a floor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import edgegrad
from tests.support.rich_scene import pose, turn
from tests.support.scenes.box_under_lights import DOWN
from tests.support.small_scenes import Make, camera, glowing, matte, rectangle

TILTED = turn(0.1, 0.0, -0.25) @ DOWN


def sheet_through(light: str) -> edgegrad.Scene:
    """A floor under a light that an upright sheet passes through: an emissive quad ("mesh"), or one of the table.

    The sheet's own border is so far away that what it hides is hidden on the floor outside of the picture.
    """
    scene = edgegrad.Scene(
        camera((0, 2.6, 3.0), (0, 0, 0.1), 24, 0.6),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 4), (4, 0, 0), "floor"),
            "sheet": rectangle((0.15, 1.6, 0.0), (0.3, 1.0, 0.1), (0.0, 0.0, 2.5), "sheet"),
        },
        {"floor": matte(0.6, 0.7, 0.5), "sheet": matte(0.7, 0.3, 0.2)},
    )
    if light == "mesh":
        scene.meshes["lamp"] = rectangle((0.1, 1.5, 0.0), (0.0, 0.1, -0.5), (-0.6, 0.15, 0.0), "lamp")
        scene.materials["lamp"] = glowing(15.0, True)
    else:
        shape = "RECTANGLE" if light == "rectangle" else "ELLIPSE"
        scene.lights["lamp"] = edgegrad.AreaLight(pose(TILTED, 0.1, 1.5, 0.0), np.array([1.2, 1.0]), shape, 60.0)
    return scene


def moves(make: Callable[[], edgegrad.Scene], name: str, rate: tuple[float, float, float]) -> Make:
    def moved(theta: float) -> edgegrad.Scene:
        scene = make()
        mesh = scene.meshes[name]
        around = mesh.vertices - mesh.vertices.mean(axis=0)
        mesh.vertices = mesh.vertices + theta * (np.array(rate) + 0.2 * around[:, [1, 2, 0]])
        return scene

    return moved


def light_moves(light: str) -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = sheet_through(light)
        lamp = scene.lights["lamp"]
        assert isinstance(lamp, edgegrad.AreaLight)
        to_world = np.array(lamp.to_world)
        to_world[:3, :3] = turn(0.4 * theta, 0.3 * theta, -0.2 * theta) @ to_world[:3, :3]
        to_world[:3, 3] += theta * np.array([0.6, -0.4, 0.3])
        scene.lights["lamp"] = replace(lamp, to_world=to_world)
        return scene

    return make


def veiled(theta: float) -> edgegrad.Scene:
    """A sheet that lets a part of the light pass."""
    scene = moves(lambda: sheet_through("mesh"), "sheet", (1.0, 0.2, 0.3))(theta)
    scene.materials["sheet"] = edgegrad.Material(np.array([0.7, 0.3, 0.2]), alpha=0.6)
    return scene


def shining(theta: float) -> edgegrad.Scene:
    """A sheet that gives light by itself, which the lamp doesn't hide."""
    scene = moves(lambda: sheet_through("rectangle"), "sheet", (1.0, 0.2, 0.3))(theta)
    scene.materials["sheet"] = glowing(0.5, True)
    return scene


def sheet_through_board() -> edgegrad.Scene:
    """The same with a board for the lamp, which passes on the light of a lamp that shines on nothing else."""
    scene = sheet_through("mesh")
    scene.materials["lamp"] = matte(0.9, 0.8, 0.6)
    scene.lights["key"] = edgegrad.PointLight(np.array([0.1, 0.5, 0.3]), 60.0, casts_shadow=False, receivers=("lamp",))
    return scene


SHEET, LAMP, POSE = ["meshes.sheet.vertices"], ["meshes.lamp.vertices"], ["lights.lamp.to_world"]
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}: sheet moves": (moves(lambda light=light: sheet_through(light), "sheet", (1.0, 0.2, 0.3)), SHEET)
       for light in ("mesh", "rectangle", "ellipse")},
    "mesh: light moves": (moves(lambda: sheet_through("mesh"), "lamp", (0.6, 0.8, 0.3)), LAMP),
    "rectangle: light moves": (light_moves("rectangle"), POSE),
    "ellipse: light moves": (light_moves("ellipse"), POSE),
    "veiled: sheet moves": (veiled, SHEET),
    "rectangle: sheet that shines moves": (shining, SHEET),
}
DEEP: dict[str, tuple[Make, list[str]]] = {
    "sheet moves in a board": (moves(sheet_through_board, "sheet", (1.0, 0.2, 0.3)), SHEET),
    "board moves about a sheet": (moves(sheet_through_board, "lamp", (0.6, 0.8, 0.3)), LAMP),
}

"""Emissive meshes whose outline moves over what they light."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np

import edgegrad
from edgegrad.scene.mesh import Mesh
from tests.support import shapes
from tests.support.rich_scene import turn
from tests.support.small_scenes import Make, box, camera, glowing, matte, rectangle

VIEW = camera((0, 2.2, 3.0), (0, 0.2, 0.1), 24, 0.7)
GLOSS = edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=0.4)
MIRROR = edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=0.0)


def lamp_ball() -> Mesh:
    """192 faces."""
    vertices, faces = shapes.ball(2, 0.4)
    return Mesh(vertices + [0.2, 1.0, -0.2], faces, ("lamp",))


def lamp_sheet() -> Mesh:
    """An open sheet of 50 faces, bent, in bands of two colours and black, over the floor."""
    vertices, faces = shapes.sheet(6, 1.4)
    x, y, _ = vertices.T
    bent = np.stack([x, 1.0 + 0.3 * np.abs(y) + 0.1 * x, y], axis=1)
    band = np.clip(((vertices[faces].mean(axis=1)[:, 0] + 0.7) / 0.47).astype(np.int32), 0, 2)
    return Mesh(bent, faces, ("lamp", "other", "black"), band)


def floor_under(lamp: Mesh, floor: edgegrad.Material) -> edgegrad.Scene:
    return edgegrad.Scene(
        deepcopy(VIEW),
        {"floor": rectangle((0, 0, 0), (0, 0, 3), (3, 0, 0), "floor"), "lamp": lamp},
        {"floor": deepcopy(floor), "lamp": glowing(6.0, True),
         "other": edgegrad.Material(np.zeros(3), np.array([1.0, 5.0, 9.0]), True), "black": matte(0.0, 0.0, 0.0)},
    )


def over(floor: edgegrad.Material, lamp: Callable[[], Mesh] = lamp_ball) -> Callable[[], edgegrad.Scene]:
    return lambda: floor_under(lamp(), floor)


def occluded() -> edgegrad.Scene:
    scene = floor_under(lamp_ball(), GLOSS)
    scene.meshes["box"] = box((0.3, 0.35, 0.0), (0.25, 0.1, 0.2), "clay", 0.4)
    scene.materials["clay"] = matte(0.5, 0.4, 0.3)
    return scene


def intersected() -> edgegrad.Scene:
    """A sheet through the lamp."""
    scene = floor_under(lamp_ball(), GLOSS)
    scene.meshes["sheet"] = rectangle((0.25, 1.0, -0.2), (0.1, 0.9, 0.05), (0.0, 0.0, 1.5), "black")
    return scene


def pair() -> edgegrad.Scene:
    """A mesh of two balls, one of which hides a part of the other."""
    ball = lamp_ball()
    both = np.concatenate([ball.vertices, 0.7 * ball.vertices + [0.5, 0.1, 0.5]])
    lamp = Mesh(both, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]), ("lamp",))
    return floor_under(lamp, GLOSS)


def reflecting() -> edgegrad.Scene:
    """A lamp that reflects as well, and a wall."""
    scene = floor_under(lamp_ball(), GLOSS)
    scene.materials["lamp"] = edgegrad.Material(np.full(3, 0.7), np.full(3, 6.0), True)
    scene.meshes["wall"] = rectangle((0, 0.8, -1.0), (1.5, 0, 0), (0, 0.8, 0.2), "wall")
    scene.materials["wall"] = matte(0.8, 0.5, 0.3)
    return scene


def smooth() -> edgegrad.Scene:
    """A smooth body of few faces, whose horizons cut off light."""
    scene = floor_under(lamp_ball(), matte(0.3, 0.3, 0.3))
    vertices, faces = shapes.ball(1, 0.6)
    scene.meshes["body"] = Mesh(vertices + [-0.3, 0.3, 0.4], faces, ("body",), smoothing=faces)
    scene.materials["body"] = replace(GLOSS, roughness=0.5)
    return scene


def mirrored() -> edgegrad.Scene:
    """A glossy wall that the camera sees in a mirror, which itself shows the wall nothing of the lamp."""
    scene = floor_under(lamp_ball(), MIRROR)
    scene.meshes["floor"] = rectangle((0, 0, 1.0), (0, 0, 0.4), (1.0, 0, 0), "floor")
    scene.meshes["wall"] = rectangle((0, 2.4, -1.2), (2.5, 0, 0), (0, 0.8, 0.0), "wall")
    scene.materials["wall"] = deepcopy(GLOSS)
    return scene


def moves(make: Callable[[], edgegrad.Scene], *names: str, camera_too: bool = False) -> tuple[Make, list[str]]:
    """Each mesh moves, turns and is bent in its own way."""
    def moved(theta: float) -> edgegrad.Scene:
        scene = make()
        for k, name in enumerate(names):
            mesh = scene.meshes[name]
            middle = mesh.vertices.mean(axis=0)
            around = mesh.vertices - middle
            rate = np.array([(0.8, 0.2, 0.3), (-0.4, 0.3, 0.2)][k]) + 0.4 * around[:, [1, 2, 0]] + around**2
            mesh.vertices = mesh.vertices + theta * rate
        if camera_too:
            to_world = np.array(scene.camera.to_world)
            to_world[:3, :3] = turn(0.1 * theta, 0.2 * theta, 0.1 * theta) @ to_world[:3, :3]
            to_world[:3, 3] += theta * np.array([0.5, 0.2, -0.3])
            scene.camera = replace(scene.camera, to_world=to_world)
        return scene

    return moved, [*(f"meshes.{name}.vertices" for name in names), *(["camera.to_world"] if camera_too else [])]


CASES: dict[str, tuple[Make, list[str]]] = {
    "ball over metal": moves(over(GLOSS), "lamp"),
    "ball over a matte floor": moves(over(matte(0.6, 0.7, 0.5)), "lamp"),
    "sheet over metal": moves(over(GLOSS, lamp_sheet), "lamp"),
    "floor moves": moves(over(GLOSS), "floor", "lamp"),
    "camera moves": moves(over(GLOSS), "lamp", camera_too=True),
    "box before the lamp": moves(occluded, "box", "lamp"),
    "sheet through the lamp": moves(intersected, "sheet", "lamp"),
    "two balls": moves(pair, "lamp"),
    "horizons": moves(smooth, "body", "lamp"),
}
DEEP: dict[str, tuple[Make, list[str]]] = {
    "lamp that reflects": moves(reflecting, "lamp"),
    "seen in a mirror": moves(mirrored, "lamp"),
}

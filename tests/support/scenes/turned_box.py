"""A turned box over a floor, stored, cut, wound and placed in different ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import edgegrad
from tests.support.small_scenes import camera

Floats = NDArray[np.float64]


def geometry() -> tuple[Floats, NDArray[np.int32], Floats, NDArray[np.int32]]:
    """A turned box over a floor: vertices and faces of both."""
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])], np.int32)
    c, s = np.cos(0.6), np.sin(0.6)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    floor = np.array([[-2, -0.9, -2], [-2, -0.9, 2], [2, -0.9, 2], [2, -0.9, -2]], float)
    return cube @ turn.T * [0.5, 0.4, 0.45], faces, floor, np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def build(
    box: tuple[Floats, NDArray[np.int32]],
    floor: tuple[Floats, NDArray[np.int32]],
    *,
    rotation: Floats | None = None,
    scale: float = 1.0,
    shift: float = 0.0,
) -> edgegrad.Scene:
    """The scene in a world that is turned, scaled and shifted as a whole, its lights' powers with it."""
    turn = np.eye(3) if rotation is None else rotation
    place = lambda x: np.asarray(x, float) @ turn.T * scale + shift  # noqa: E731
    view = camera((0.4, 1.6, 3.2), (0, -0.2, 0), 32)
    view.to_world[:3, :3] = turn @ view.to_world[:3, :3]
    view.to_world[:3, 3] = place(view.to_world[:3, 3])
    view.clip_start *= scale
    lamp = np.eye(4)
    lamp[:3, :3] = turn @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)  # its -Z looks down
    lamp[:3, 3] = place([0.8, 2.2, 0.5])
    return edgegrad.Scene(
        view,
        {
            "box": edgegrad.Mesh(place(box[0]), box[1], ("clay",)),
            "floor": edgegrad.Mesh(place(floor[0]), floor[1], ("grey",)),
        },
        {"clay": edgegrad.Material(np.array([0.8, 0.4, 0.2])), "grey": edgegrad.Material(np.full(3, 0.6))},
        {
            "key": edgegrad.AreaLight(lamp, np.array([0.5, 0.5]) * scale, power=40.0 * scale**2),
            "point": edgegrad.PointLight(place([-1.2, 1.5, 1.0]), 30.0 * scale**2),
            "sun": edgegrad.SunLight(turn @ [0.2, -1.0, -0.3], 0.5),
        },
        edgegrad.World(np.full(3, 0.3)),
    )

"""The native engine against central differences of its own pictures, with common random numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from tests.support import shapes
from tests.support.block_statistics import check_noticed
from tests.support.picture_differences import agreement, check_agreement
from tests.support.slow_cases import slow
from tests.support.small_scenes import MOTIONS, Floats, Moving, box, camera, matte, need, rectangle, translated

FLOOR = {"center": (0, 0, 0), "half_u": (0, 0, 3), "half_v": (3, 0, 0), "material": "floor"}
ABOVE = camera((0, 3.2, 2.4), (0, 0, 0.1), 32)
MATERIALS = {"floor": matte(), "clay": matte(0.7, 0.3, 0.2)}


def ball(center: Floats, radius: float) -> edgegrad.Mesh:
    vertices, faces = shapes.ball(2, radius)
    return edgegrad.Mesh(vertices + center, faces, ("clay",))


def ball_under(light: edgegrad.PointLight | edgegrad.SunLight) -> edgegrad.Scene:
    """A faceted ball that casts a hard shadow on a floor."""
    meshes = {"floor": rectangle(**FLOOR), "ball": ball(np.array([0.2, 0.9, 0.0]), 0.4)}  # type: ignore[arg-type]
    return edgegrad.Scene(ABOVE, meshes, MATERIALS, {"light": light})


def entering_ball() -> edgegrad.Scene:
    """A ball half outside of the picture."""
    lights = {"light": edgegrad.PointLight(np.array([0.9, 2.6, 2.3]), 100.0)}
    meshes = {"ball": ball(np.array([1.4, 0.2, 0.0]), 0.6)}
    return edgegrad.Scene(camera(size=32), meshes, MATERIALS, lights, edgegrad.World(np.full(3, 0.5)))


def strip(theta: float) -> tuple[edgegrad.Scene, dict[str, Floats]]:
    """A strip from before the scene to behind the camera, one of whose far vertices moves."""
    vertices = np.array([[-0.3, -0.5, 5.0], [0.3, -0.5, 5.0], [0.4, -0.2, -2.0], [-0.4, -0.2, -2.0]])
    motion = np.zeros((4, 3))
    motion[2] = [0.3, 1.0, 0.5]
    mesh = edgegrad.Mesh(vertices + theta * motion, np.array([[0, 1, 2], [0, 2, 3]]), ("clay",))
    scene = edgegrad.Scene(camera(size=32), {"strip": mesh}, MATERIALS, world=edgegrad.World(np.ones(3)))
    return scene, {"meshes.strip.vertices": motion}


def sunk_box() -> edgegrad.Scene:
    """A lit box that stands half in a floor, with another through it."""
    scene = ball_under(edgegrad.PointLight(np.array([0.9, 2.6, 1.3]), 100.0))
    scene.meshes = {
        "floor": scene.meshes["floor"],
        "ball": box((0.1, 0.1, 0.2), (0.4, 0.35, 0.3), "clay", 0.4),
        "post": box((-0.2, 0.3, 0.4), (0.12, 0.6, 0.12), "floor", 0.9),
    }
    return scene


CASES: dict[str, Moving] = MOTIONS | {
    "box sunk into a floor": translated(sunk_box, "ball", (1.0, 0.7, 0.2)),
    "hard shadow of a point light": translated(
        lambda: ball_under(edgegrad.PointLight(np.array([0.9, 2.6, -0.3]), 100.0)), "ball", (1.0, 0.0, 0.0)
    ),
    "hard shadow of the sun": translated(
        lambda: ball_under(edgegrad.SunLight(np.array([0.3, -1.0, 0.2]), 3.0)), "ball", (1.0, 0.2, 0.0)
    ),
    "shape entering the frame": translated(entering_ball, "ball", (1.0, 0.2, 0.0)),
    "strip through the near plane": strip,
}
OPTIONS: dict[str, Any] = {"eps": 0.01, "seeds": 24, "spp": 128, "reference_spp": 1024}
SLOW = ("lamp moves", "floor rises", "hard shadow of the sun")


@pytest.mark.parametrize("name", slow(CASES, SLOW))
def test_motion_agrees_with_central_differences(name: str) -> None:
    need("native")
    check_agreement(CASES[name], **OPTIONS)


def test_a_missing_term_is_noticed() -> None:
    need("native")
    outcome = agreement(CASES["hard shadow of a point light"], terms=("interior", "primary"), **OPTIONS)
    check_noticed(outcome)

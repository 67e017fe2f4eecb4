"""A light without size reaches all of a face or none of it. The plan names these jumps of smooth meshes."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import PointLight, Scene, SunLight, render
from edgegrad.planning.scene_plan import plan
from tests.support import shapes

LAMP, OBJECT = "lights.lamp.position", "meshes.object.vertices"


def lit_ball(radius: float, smooth: bool = True) -> Scene:
    """A coarse ball under a lamp."""
    scene = shapes.scene(*shapes.ball(1))
    mesh = scene.meshes["object"]
    mesh.smoothing = mesh.faces.copy() if smooth else None
    scene.world.color = np.zeros(3)
    scene.lights = {"lamp": PointLight(np.array([0.0, 0.0, 3.0]), 100.0, radius, radius > 0.0)}
    return scene


def named(scene: Scene, *wrt: str) -> list[str]:
    return [words for words in plan(scene, wrt).missing if "passes the plane of a face" in words]


@pytest.mark.parametrize("path", [LAMP, OBJECT, "meshes.object.transform"])
def test_jumps_are_named(path: str) -> None:
    words = named(lit_ball(0.0), path)
    assert len(words) == 1 and "lamp" in words[0] and "object" in words[0]


def test_suns_without_angle_jump_too() -> None:
    scene = lit_ball(0.0)
    scene.lights = {"lamp": SunLight(np.array([0.3, 0.1, -1.0]), 3.0, 0.0)}
    assert named(scene, "lights.lamp.direction")


@pytest.mark.parametrize("path", ["lights.lamp.power", "lights.lamp.color", "materials.clay.base_color",
                                  "camera.to_world"])  # fmt: skip
def test_what_moves_no_light_over_a_face_has_no_jump(path: str) -> None:
    assert not named(lit_ball(0.0), path)


def test_flat_meshes_and_lights_with_a_size_have_no_jump() -> None:
    assert not named(lit_ball(0.0, smooth=False), LAMP, OBJECT)
    assert not named(lit_ball(0.05), LAMP, OBJECT)


def test_the_picture_jumps() -> None:
    """Pictures with a light on both sides of a face's plane differ far more than two with it on one side."""
    scene = lit_ball(0.0)
    mesh = scene.meshes["object"]
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Heights at which a lamp above the centre lies in the planes of faces.
    upright = normals[:, 2] > 0.05 * np.linalg.norm(normals, axis=1)
    heights = np.einsum("fk,fk->f", normals, corners[:, 0])[upright] / normals[upright, 2]
    height = float(heights.max())

    def picture(z: float) -> np.ndarray:
        scene.lights = {"lamp": PointLight(np.array([0.0, 0.0, z]), 100.0)}
        return render(scene, 64, seed=1).astype(np.float64)

    step = 1e-4 * height
    across = np.abs(picture(height + step) - picture(height - step)).max()
    beside = np.abs(picture(height + 3.0 * step) - picture(height + step)).max()
    assert across > 20.0 * beside

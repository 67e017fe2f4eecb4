"""Fits of lights, cameras, objects and textures find what they should."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from edgegrad import Image, Material, PointLight, Renderer, Scene
from edgegrad import expression as e
from edgegrad.fitting.scene_fit import fit
from edgegrad.fitting.targets import Target
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.picture_differences import need_every_table


def textured_ball() -> Scene:
    vertices, faces = shapes.ball(2)
    scene = shapes.scene(vertices, faces, world=0.5)
    scene.images = {"paint": Image(np.full((6, 6, 3), 0.5, np.float32))}
    uv = np.random.default_rng(0).random((len(faces), 3, 2)).astype(np.float32)
    scene.meshes["object"].attributes = {"UVMap": uv}
    scene.materials["clay"] = Material(
        textures={"base_color": e.ImageTexture("paint", e.Attribute("UVMap"))}, specular_ior_level=0.4
    )
    scene.lights = {"lamp": PointLight(np.array([2.0, -4.0, 3.0]), 500.0, 0.2)}
    return scene


def shifted(pose: Any) -> Any:
    out = np.array(pose)
    out[:3, 3] += [0.3, 0.0, -0.2]
    return out


# What is to be found, and the part of the way to it that may be left.
TRUTH: dict[str, tuple[Callable[[Any], Any], float]] = {
    "lights.lamp.position": (lambda v: v + np.array([1.0, 0.5, -0.5]), 0.15),
    "world.color": (lambda v: v * np.array([1.5, 1.0, 0.5]), 0.15),
    "meshes.object.transform": (shifted, 0.2),
    "camera.fov_x": (lambda v: 1.15 * v, 0.1),
    "images.paint.pixels": (lambda v: np.random.default_rng(2).uniform(0.1, 0.9, v.shape), 0.6),
}


@pytest.mark.parametrize("path", TRUTH)
def test_fits_find_every_kind_of_parameter(path: str) -> None:
    need_every_table()
    change, left = TRUTH[path]
    truth, scene = textured_ball(), textured_ball()
    start = np.array(parameters.get(scene, path), np.float64)
    goal = np.asarray(change(parameters.get(truth, path)), np.float64)
    parameters.put(truth, path, goal)
    target = Target(Renderer(truth).render(spp=128, seed=99, max_depth=3))
    # That a ball has turned hardly shows: with fewer samples, noise turns it.
    fit(scene, target, [path], iterations=60, spp=32, max_depth=3)
    found = np.asarray(parameters.get(scene, path), np.float64)
    assert np.linalg.norm(found - goal) < left * np.linalg.norm(start - goal)

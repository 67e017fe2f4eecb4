"""Fits of lights, cameras, objects and textures find what they should."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

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


# The values that the fit must recover.
TRUTH: dict[str, Callable[[Any], Any]] = {
    "lights.lamp.position": lambda v: v + np.array([1.0, 0.5, -0.5]),
    "world.color": lambda v: v * np.array([1.5, 1.0, 0.5]),
    "meshes.object.transform": shifted,
    "camera.fov_x": lambda v: 1.15 * v,
    "images.paint.pixels": lambda v: np.random.default_rng(2).uniform(0.1, 0.9, v.shape),
}
SPP = 32


def root_mean_square(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("path", TRUTH)
def test_fits_find_every_kind_of_parameter(path: str) -> None:
    """Judged by the picture: texels that it hardly shows may be far off.

    Pictures of found and true values have common random numbers, so that they differ by the values alone.
    """
    need_every_table()

    def picture(value: ArrayLike, spp: int = 128, seed: int = 7) -> NDArray[np.float64]:
        scene = textured_ball()
        parameters.put(scene, path, np.asarray(value))
        return Renderer(scene).render(spp=spp, seed=seed, max_depth=3).astype(np.float64)

    scene = textured_ball()
    start = np.array(parameters.get(scene, path), np.float64)
    goal = np.asarray(TRUTH[path](start), np.float64)
    target = Target(picture(goal, seed=99).astype(np.float32))
    # That a ball has turned hardly shows: with fewer samples, noise turns it.
    fit(scene, target, [path], iterations=60, spp=SPP, max_depth=3)
    noise = root_mean_square(picture(goal, SPP, 1) - picture(goal, SPP, 2)) / np.sqrt(2.0)
    before, after = (root_mean_square(picture(value) - picture(goal)) for value in (start, parameters.get(scene, path)))
    assert before > 4.0 * noise, "or there is nothing to be found"
    # A fit finds what the noise of its pictures does not hide; sixty steps leave less than a tenth of it.
    assert after < noise + 0.1 * before

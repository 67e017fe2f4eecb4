"""The plan of a picture: the facts of both engines, and their words."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import AreaLight, Material, Mesh, PointLight, Renderer, Scene, SunLight, World, plan
from tests.support import shapes
from tests.support.small_scenes import need


def lamps() -> Scene:
    """A box that glows over a floor, with a sun, and with a lamp that is switched off."""
    scene = shapes.scene(*shapes.cube(), world=0.5)
    vertices, faces = shapes.sheet(3, 10.0)
    scene.meshes["floor"] = Mesh(vertices - [0.0, 0.0, 1.0], faces, ("clay",))
    scene.materials["glow"] = Material(np.zeros(3), emission=np.ones(3))
    scene.meshes["object"].materials = ("glow",)
    scene.lights = {"off": PointLight(np.zeros(3), 0.0), "sun": SunLight(np.array([0.0, 0.0, -1.0]))}
    return scene


def test_engines_have_the_same_facts() -> None:
    need("native")
    facts = [Renderer(lamps(), engine=engine).picture_facts() for engine in ("native", "reference")]
    assert facts[0] == facts[1]
    assert facts[0].emissive_triangles == 12 and facts[0].sampled_rows == (1,)
    assert facts[0].material_rows == (0, 1)


def test_words_follow_the_facts() -> None:
    need("native")
    scene = lamps()
    scene.materials["unused"] = Material(kind="TRANSLUCENT")
    scene.lights["area"] = AreaLight(np.eye(4), power=0.0)
    said = plan(scene, max_depth=3).picture
    for sentence in ("light is sampled from 1 sun, 12 emissive triangles", "without power, left out: off, area",
                     "all is shaded flat: no normals are interpolated",
                     "no surface is transparent: shadow rays stop at the first hit",
                     "up to 3 segments; the last is traced only where it can see the environment"):
        assert sentence in said
    scene.materials["clay"] = Material(kind="GLASS", alpha=1.0)
    scene.materials["glow"].alpha = 0.5
    scene.world = World()
    said = plan(scene, max_depth=1).picture
    for sentence in ("shaders Glass, Principled, with reflection and refraction",
                     "shadow rays multiply the transmittances of surfaces",
                     "the world is dark: rays that leave the scene find no light",
                     "one segment: only light seen directly, no surface is shaded"):
        assert sentence in said


def test_a_scene_without_a_camera_is_refused() -> None:
    with pytest.raises(ValueError, match="no camera"):
        plan(Scene(None, {}, {}, {}, World(np.ones(3))))  # type: ignore[arg-type]

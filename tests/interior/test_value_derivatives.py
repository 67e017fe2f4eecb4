"""Derivatives by strengths of lights and colours of surfaces, in which a picture is a sum of products."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import AreaLight, Image, Material, Mixture, PointLight, Scene, SpotLight, SunLight, World
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene import parameters
from tests.support import small_scenes
from tests.support.picture_differences import seed_of_picture

DOWN = np.array([[1.0, 0, 0, 0], [0, 0, 1, 3], [0, -1, 0, 0], [0, 0, 0, 1]])
LIGHTS: dict[str, Any] = {
    "point": PointLight(np.array([1.0, 2.5, 1.0]), 50.0),
    "ball": PointLight(np.array([1.0, 2.5, 1.0]), 50.0, 0.4, True),
    "facing": PointLight(np.array([1.0, 2.5, 1.0]), 50.0, 0.4),
    "spot": SpotLight(np.array([1.0, 2.5, 1.0]), np.array([-0.4, -1.0, -0.4]), 50.0, 1.0, 0.5),
    "sun": SunLight(np.array([0.3, -1.0, -0.4]), 2.0),
    "wide sun": SunLight(np.array([0.3, -1.0, -0.4]), 2.0, 0.5),
    "area": AreaLight(DOWN, np.array([1.5, 1.0]), "RECTANGLE", 40.0, 2.0),
    "ellipse": AreaLight(DOWN, np.array([1.5, 1.0]), "ELLIPSE", 40.0),
}
WORLDS = {
    "sky": World(np.array([0.6, 0.7, 0.9]), 0.8),
    "image": World(np.array([0.6, 0.7, 0.9]), 0.8, "sky"),
    "red": World(np.array([0.6, 0.0, 0.0]), 0.8),
}
SOURCES = [*LIGHTS, *WORLDS, "mesh"]


def scene(*sources: str) -> Scene:
    """A room of all that light may meet, lit by some sources."""
    rng = np.random.default_rng(4)
    glow = np.array([6.0, 5.0, 4.0]) if "mesh" in sources else np.zeros(3)
    meshes = {
        "floor": small_scenes.rectangle((0, -0.7, 0), (2.5, 0, 0), (0, 0, -2.5), "floor"),
        "wall": small_scenes.rectangle((0, 0.8, -1.8), (2.5, 0, 0), (0, 1.5, 0), "mixed"),
        "veil": small_scenes.rectangle((-1.0, 0.2, 0.5), (0.4, 0, 0), (0, 0.5, 0), "veil"),
        "box": small_scenes.box((0.7, -0.2, 0), (0.4, 0.5, 0.4), "metal", 0.4),
        "lamp": small_scenes.rectangle((-0.5, 2.5, 0), (0.4, 0, 0), (0, 0, 0.4), "lamp"),
    }
    materials: dict[str, Any] = {
        "floor": Material(np.array([0.7, 0.5, 0.3])),
        "chalk": Material(np.array([0.4, 0.6, 0.8])),
        "satin": Material(np.array([0.9, 0.8, 0.7]), metallic=0.6, specular_ior_level=0.5, roughness=0.3),
        "mixed": Mixture(("chalk", "satin"), np.array([0.6, 0.4])),
        "veil": Material(np.array([0.3, 0.8, 0.4]), alpha=0.6),
        "metal": Material(np.array([0.9, 0.7, 0.5]), metallic=1.0, specular_ior_level=0.5, roughness=0.2),
        "lamp": Material(np.zeros(3), glow),
    }
    world = next((WORLDS[name] for name in sources if name in WORLDS), World(np.zeros(3)))
    lights = {name: replace(LIGHTS[name]) for name in sources if name in LIGHTS}  # tests change them
    image = Image(rng.uniform(0.1, 1.0, (6, 12, 3)).astype(np.float32) ** 3)
    return Scene(small_scenes.camera((0, 1, 4), size=24), meshes, materials, lights, world, {"sky": image})


def strengths(of: Scene, *sources: str) -> dict[str, NDArray[np.float64]]:
    """The sources' strengths by parameter path."""
    def path(name: str) -> str:
        if name in WORLDS:
            return "world.strength" if name == "red" else "world.color"
        if name == "mesh":
            return "materials.lamp.emission"
        return f"lights.{name}." + ("strength" if isinstance(LIGHTS[name], SunLight) else "power")

    return {path(name): np.asarray(parameters.get(of, path(name)), float) for name in sources}


@pytest.mark.parametrize("source", SOURCES)
def test_the_derivative_along_a_lone_strength_is_the_picture(source: str) -> None:
    """Each sample is linear in the emission, also if rays hit lights that emitter samples find."""
    small_scenes.need("native")
    lit = scene(source)
    renderer = Renderer(lit, threads=1)
    options = {"spp": 8, "max_depth": 4, "seed": seed_of_picture(2)}
    tangent = strengths(lit, source)
    picture = renderer.render(**options | {"seed": 2})
    derivative = renderer.render_forward(tangent, **options)
    assert picture.mean() > 0.01
    np.testing.assert_allclose(derivative, picture, rtol=2e-4, atol=1e-4 * picture.max())
    adjoint = np.random.default_rng(5).normal(size=picture.shape)
    gradient = renderer.render_backward(adjoint, list(tangent), **options)
    pulled = sum(np.sum(gradient[path] * tangent[path]) for path in tangent)
    assert abs(pulled - np.sum(adjoint * derivative)) <= 1e-4 * np.sum(np.abs(adjoint * derivative))


@pytest.mark.parametrize("source", ["spot", "wide sun", "area"])
def test_a_lone_strength_takes_all_samples(source: str) -> None:
    """Among others, a light's derivative is the picture that it would light by itself, with the same samples."""
    small_scenes.need("native")
    options = {"spp": 8, "max_depth": 4, "seed": 2}
    alone = scene(source)
    picture = Renderer(alone, threads=1).render(**options | {"seed": seed_of_picture(2)})
    among = Renderer(scene(*LIGHTS, "image", "mesh"), threads=1)
    derivative = among.render_forward(strengths(alone, source), **options)
    np.testing.assert_allclose(derivative, picture, rtol=2e-4, atol=1e-4 * picture.max())


@pytest.mark.parametrize("paths", [
    ["lights.point.power", "materials.lamp.emission", "world.color"],
    ["materials.floor.base_color", "materials.chalk.base_color"],
    ["materials.floor.base_color", "lights.spot.color", "lights.sun.strength", "world.strength"],
])
def test_values_have_the_derivatives_of_the_tape(paths: list[str]) -> None:
    """Asked for beside what isn't linear, the same paths' vertices are computed once more with a tape."""
    small_scenes.need("native")
    sources = ("point", "spot", "sun", "image", "mesh")
    renderer = Renderer(scene(*sources), threads=1)
    options = {"spp": 8, "max_depth": 4, "seed": 3}
    adjoint = np.random.default_rng(5).normal(size=(24, 24, 3))
    # Roulette ends paths later where derivatives by colours are requested.
    beside = "materials.chalk.base_color" if "materials.floor.base_color" not in paths else None
    alone = renderer.render_backward(adjoint, [*paths, *([beside] if beside else [])], **options)
    taped = renderer.render_backward(adjoint, [*paths, "materials.metal.roughness"], **options)
    for path in paths:
        assert np.any(taped[path])
        np.testing.assert_allclose(alone[path], taped[path], rtol=1e-3, atol=1e-4 * np.abs(taped[path]).max())


def test_black_surfaces_and_dark_lights_have_derivatives() -> None:
    """A colour and a power of zero: the picture is linear in each, so a difference over any step is the derivative."""
    small_scenes.need("native")
    options = {"spp": 8, "max_depth": 2, "seed": 3}
    lit = scene("point")
    lit.materials["floor"].base_color = np.zeros(3)
    color = {"materials.floor.base_color": np.array([0.5, 0.3, 0.2])}
    common = options | {"seed": seed_of_picture(3)}
    derivative = Renderer(lit, threads=1).render_forward(color, **common)
    black = Renderer(lit, threads=1).render(**options)
    lit.materials["floor"].base_color = color["materials.floor.base_color"]
    colored = Renderer(lit, threads=1).render(**options)
    assert derivative.mean() > 0.01
    np.testing.assert_allclose(derivative, colored - black, rtol=1e-3, atol=1e-4 * colored.max())

    lit.lights["point"].power = 0.0
    derivative = Renderer(lit, threads=1).render_forward({"lights.point.power": np.array(50.0)}, **common)
    np.testing.assert_allclose(derivative, colored, rtol=1e-3, atol=1e-4 * colored.max())

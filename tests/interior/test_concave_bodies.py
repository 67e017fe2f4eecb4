"""Bodies with concave corners that move as one mesh: points that pixels see slide along them, light between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from edgegrad import Image, Material, Mesh, PointLight, Renderer, Scene
from edgegrad import expression as e
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.scenes.concave_bodies import (
    GLOSS,
    METAL,
    RATE,
    bevelled,
    lit,
    patch,
    room_corner,
    smooth_bowl,
    with_alpha,
    with_window,
)
from tests.support.small_scenes import Floats, Make, along, camera

BODY = ["meshes.body.vertices"]


def small(scene: Scene, size: int = 16) -> Scene:
    """The scene in a smaller picture."""
    scene.camera.width = scene.camera.height = size
    return scene


def under_a_bulb() -> Scene:
    """A smooth-shaded bowl under a lamp that turns with its receivers."""
    scene = lit(smooth_bowl(1))
    scene.lights = {"bulb": PointLight(np.array([0.5, 1.6, 0.8]), 120.0, radius=0.3)}
    return scene


def with_roughness_map() -> Scene:
    """A metal corner whose roughness is an image of values above zero."""
    scene = lit(room_corner(), METAL)
    body = scene.meshes["body"]
    body.attributes["UVMap"] = (body.vertices @ [[1, 0], [0, 1], [1, 0]])[body.faces].astype(np.float32)
    values = np.random.default_rng(5).uniform(0.4, 0.7, (6, 6, 1)).astype(np.float32)
    scene.images["roughness"] = Image(values)
    roughness = e.ImageTexture("roughness", e.Attribute("UVMap"))
    scene.materials["body"] = Material(np.array([0.8, 0.7, 0.6]), metallic=1.0, textures={"roughness": roughness})
    return scene


def shifted(make: Callable[[], Scene]) -> Make:
    """The body moves as a whole."""

    def at(theta: float) -> Scene:
        scene = small(make())
        body = scene.meshes["body"]
        body.vertices = body.vertices + theta * RATE
        return scene

    return at


def bent(make: Callable[[], Scene]) -> Make:
    """The body turns, stretches and shears, so that its faces turn against each other."""
    rate = np.array([[0.3, 0.5, -0.2], [-0.4, 0.2, 0.3], [0.5, -0.3, 0.4]])

    def at(theta: float) -> Scene:
        scene = small(make())
        body = scene.meshes["body"]
        body.vertices = body.vertices @ (np.eye(3) + theta * rate)
        return scene

    return at


CASES: dict[str, tuple[Make, dict[str, Any]]] = {
    "metal corner": (shifted(lambda: lit(room_corner(), METAL)), {"max_depth": 3}),
    "corner with a roughness map": (shifted(with_roughness_map), {"max_depth": 3}),
    "glossy corner": (bent(lambda: lit(room_corner(), GLOSS)), {"max_depth": 4}),
    "corner of a grid": (shifted(lambda: lit(room_corner(64))), {"max_depth": 3}),
    "corner of a grid, bent": (bent(lambda: lit(room_corner(4))), {"max_depth": 3}),
    "corner beside a leaf": (shifted(lambda: with_alpha(room_corner())), {"max_depth": 4}),
    "corner with a window": (bent(lambda: with_window(room_corner())), {"max_depth": 3}),
    "bowl": (shifted(lambda: lit(smooth_bowl(1))), {"max_depth": 3}),
    "bowl, bent": (bent(lambda: lit(smooth_bowl(1))), {"max_depth": 3}),
    "bevel": (shifted(lambda: lit(bevelled(True))), {"max_depth": 4}),
    "bowl under a bulb": (shifted(under_a_bulb), {"max_depth": 4}),
    "bowl under a bulb, bent": (bent(under_a_bulb), {"max_depth": 3}),
}


@pytest.mark.parametrize("name", CASES)
def test_derivatives_agree_with_central_differences(name: str) -> None:
    need_every_table()
    make, options = CASES[name]
    check_agreement(along(make, BODY), **options)


@pytest.mark.parametrize("name", CASES)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    make, options = CASES[name]
    check_transpose(make, BODY, spp=8, **options)


@pytest.mark.parametrize(
    "name", ["metal corner", "corner with a roughness map", "corner of a grid", "corner beside a leaf", "bowl",
             "bowl under a bulb"])
def test_more_samples_bring_less_noise(name: str) -> None:
    """Rates of 1/r have no variance: their errors do not decrease with the number of samples."""
    need_every_table()
    make, options = CASES[name]
    scene, rate = along(make, BODY)(0.0)
    renderer = Renderer(scene)

    def error(spp: int) -> float:
        """The median over seeds of the derivative picture's error."""
        pictures = np.array(
            [renderer.render_forward(rate, spp=spp, seed=k, terms=("interior",), **options) for k in range(24)])
        return float(np.median(np.sum((pictures - np.median(pictures, axis=0)) ** 2, axis=(1, 2, 3)))) ** 0.5

    # With a variance errors fall to a quarter, without one they stay: half is nearly in the middle.
    assert error(256) < 0.45 * error(16)


def spread(material: Material, distance: float) -> float:
    """The middle of the errors of samples of one point of a corner at a distance from its crease."""
    walls = (patch((-0.6, 0, -0.6), (1.2, 0, 0), (0, 1.2, 0)), patch((-0.6, 0, -0.6), (0, 1.2, 0), (0, 0, 1.2)))
    scene = lit(room_corner(), material)
    scene.meshes = {f"wall {k}": Mesh(w.vertices, w.faces, ("body",)) for k, w in enumerate(walls)}
    scene.camera = camera((1.2, 1.5, 2.0), (-0.6 + distance, 0.69, -0.6), 16, 1e-5)
    rate: dict[str, Floats] = {f"meshes.{n}.vertices": np.broadcast_to(RATE, (4, 3)).copy() for n in scene.meshes}
    samples = Renderer(scene).render_forward(rate, spp=1, max_depth=3, terms=("interior",))
    return float(np.median(np.abs(samples - np.median(samples))))


def test_samples_beside_a_crease_are_not_rounding_errors() -> None:
    """Near a crease the second point slides far along its ray: its view direction does not change by that."""
    need_every_table()
    assert spread(METAL, 1e-4) < 4.0 * spread(METAL, 1e-2)

"""Pictures and derivatives are the same in a world of another size, up to rounding: no length is a constant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad import TERMS, AreaLight, Material, Mesh, PointLight, Renderer, Scene, World
from tests.support import shapes
from tests.support.rich_scene import pose, turn
from tests.support.scenes.world_sizes import resized, resized_tangent
from tests.support.small_scenes import need

OPTIONS = {"spp": 4, "max_depth": 3, "seed": 1}
PATHS = ("meshes.body.vertices", "camera.to_world", "lights.lamp.position")


def smooth_body_on_floor() -> Scene:
    vertices, faces = shapes.cube(1.0)
    floor, floor_faces = shapes.sheet(2, 6.0)
    return Scene(
        shapes.camera((2.0, -5.0, 3.0), size=(8, 8)),
        {
            "body": Mesh(vertices @ turn(0.2, 0.1, 0.6).T, faces, ("clay",), smoothing=faces.copy()),
            "floor": Mesh(floor - [0.0, 0.0, 0.9], floor_faces, ("clay",)),
        },
        {"clay": Material(specular_ior_level=0.5)}, {"lamp": PointLight(np.array([1.0, -2.0, 3.0]), 100.0, 0.3, True)},
        World(np.full(3, 0.3)),
    )  # fmt: skip


def check(scene: Scene, factor: float) -> None:
    """Compare the picture, and every term of derivatives by places, in both sizes."""
    rng = np.random.default_rng(0)
    tangent = {PATHS[0]: rng.normal(size=(8, 3)), PATHS[1]: rng.normal(size=(4, 4)), PATHS[2]: rng.normal(size=3)}
    other = {path: resized_tangent(scene, path, value, factor) for path, value in tangent.items()}
    small, large = Renderer(scene), Renderer(resized(scene, factor))
    same(large.render(**OPTIONS), small.render(**OPTIONS))
    for term in TERMS:
        found = large.render_forward(other, terms=[term], **OPTIONS)
        same(found, small.render_forward(tangent, terms=[term], **OPTIONS))


def same(found: np.ndarray, wanted: np.ndarray) -> None:
    np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-5 * float(np.abs(wanted).max()))


# A power of two changes no digit of a float.
@pytest.mark.parametrize("factor", [2.0**20, 2.0**-17])
def test_worlds_of_any_size_have_the_same_derivatives(factor: float) -> None:
    need("native")
    check(smooth_body_on_floor(), factor)


def test_an_orthographic_camera_sees_the_same_in_a_small_world() -> None:
    need("native")
    scene = smooth_body_on_floor()
    scene.camera = replace(scene.camera, kind="ORTHOGRAPHIC", ortho_width=3.0)
    check(scene, 2.0**-17)


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_light_of_a_tiny_lamp_is_that_of_a_small_one(shape: str) -> None:
    need("native")
    scene, found = smooth_body_on_floor(), []
    for size in (1e-3, 1e-10):
        scene.lights = {"lamp": AreaLight(pose(np.eye(3), 0.5, -0.5, 3.0), np.full(2, size), shape, 100.0)}
        found.append(Renderer(scene).render(**OPTIONS))
    np.testing.assert_allclose(found[1], found[0], rtol=2e-3, atol=1e-4)


def test_faces_that_meet_at_an_obtuse_angle_do_so_in_large_worlds() -> None:
    """The origin of rays beside an edge depends on the angle between its faces, a product of many lengths."""
    need("native")
    vertices, faces = shapes.sheet(4)
    vertices[:, 2] = 0.1 * np.sin(4.0 * vertices[:, 0])
    scene = shapes.scene(vertices, faces)
    scene.materials["clay"] = Material(np.ones(3), np.ones(3), kind="GLOSSY", roughness=0.6, emission_two_sided=True)
    path, factor = "meshes.object.vertices", 2.0**12
    tangent = np.random.default_rng(0).normal(size=vertices.shape)
    small = Renderer(scene).render_forward({path: tangent}, terms=["primary"], **OPTIONS)
    large = Renderer(resized(scene, factor)).render_forward({path: factor * tangent}, terms=["primary"], **OPTIONS)
    same(large, small)


@pytest.mark.parametrize("decay", ["LINEAR", "CONSTANT"])
@pytest.mark.parametrize("count", [2, 40])
def test_lights_of_every_falloff_are_chosen_by_what_they_give_in_any_world(decay: str, count: int) -> None:
    """A lamp far away whose light does not fall with the square of the distance, among others nearby.

    Chosen as if it did, each sample would be of another lamp in a larger world, and the far one's light noisy.
    """
    need("native")
    scene, rng = smooth_body_on_floor(), np.random.default_rng(0)
    near = {f"near {k}": PointLight(rng.uniform(-1.0, 1.0, 3) + [0.0, 0.0, 4.0], 60.0 / count) for k in range(count)}
    far = PointLight(np.array([10.0, -20.0, 30.0]), 60.0, decay=decay)
    scene.lights = {"lamp": scene.lights["lamp"], **near, "far": far}
    check(scene, 2.0**10)

"""Which paths derivatives record: paths that have met nothing whose derivative is requested contribute nothing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from edgegrad import Material, PointLight, Scene, World
from edgegrad import expression as e
from edgegrad.rendering.renderer import Renderer
from tests.support import small_scenes
from tests.support.fields.splines import sampled, torus


@pytest.mark.parametrize("veils", [0, 3])
@pytest.mark.parametrize("max_depth", [2, 3, 6])
@pytest.mark.parametrize("name", ["floor", "clay"])
def test_paths_that_miss_a_material_add_nothing_to_its_gradient(name: str, max_depth: int, veils: int) -> None:
    """The gradient of one requested colour equals that among other parameters, where all paths are recorded."""
    small_scenes.need("native")
    scene = with_material(metallic=0.5, roughness=0.4)
    scene.materials["veil"] = Material(np.full(3, 0.8), alpha=0.4)
    for k in range(veils):  # surfaces that let paths pass, and are met within one segment
        height = (0.0, 1.3 + 0.2 * k, 0.0)
        scene.meshes[f"veil {k}"] = small_scenes.rectangle(height, (0.9, 0, 0), (0, 0, 0.7), "veil")
    renderer = Renderer(scene, threads=1)
    adjoint = np.random.default_rng(5).normal(size=(scene.camera.height, scene.camera.width, 3))
    path = f"materials.{name}.base_color"
    everything = [path, "materials.lamp.emission", "world.color"]
    options = {"spp": 8, "max_depth": max_depth, "seed": 3}
    alone = renderer.render_backward(adjoint, [path], **options)[path]
    among = renderer.render_backward(adjoint, everything, **options)[path]
    assert np.any(among)
    np.testing.assert_allclose(alone, among, rtol=2e-5)
    tangent = {path: np.array([1.0, 0.5, 2.0])}
    image = renderer.render_forward(tangent, **options)
    pushed, pulled = np.sum(adjoint * image), np.sum(alone * tangent[path])
    assert abs(pushed - pulled) <= 1e-4 * np.sum(np.abs(adjoint * image))


def with_material(**fields: object) -> Scene:
    """A box over a floor, under a lamp and a sky, the box of a material of its own."""
    scene = small_scenes.floating_box()
    scene.materials["clay"] = Material(np.array([0.7, 0.3, 0.2]), **fields)  # type: ignore[arg-type]
    return scene


def rounded() -> Scene:
    """The box with smooth normals, whose derivatives by its vertices reach as far as its faces."""
    scene = with_material(metallic=0.5, roughness=0.4)
    scene.meshes["box"].smoothing = np.array(scene.meshes["box"].faces, np.int32)
    return scene


RESTING: dict[str, Callable[[], Scene]] = {
    "diffuse": small_scenes.floating_box,
    "glossy": lambda: with_material(metallic=0.5, roughness=0.4),
    "mirror": lambda: with_material(metallic=1.0, roughness=0.0),
    "glass": lambda: with_material(kind="GLASS", roughness=0.0),
    "half transparent": lambda: with_material(alpha=0.5),
    "smooth": rounded,
}


@pytest.mark.parametrize("max_depth", [2, 3, 6])
@pytest.mark.parametrize("mesh", ["box", "floor"])
@pytest.mark.parametrize("case", RESTING)
def test_paths_that_meet_nothing_that_moves_add_nothing(case: str, mesh: str, max_depth: int) -> None:
    """The gradient of one requested mesh equals that among all meshes, where all paths are recorded."""
    small_scenes.need("native")
    scene = RESTING[case]()
    renderer = Renderer(scene, threads=1)
    rng = np.random.default_rng(5)
    adjoint = rng.normal(size=(scene.camera.height, scene.camera.width, 3))
    path, colour = f"meshes.{mesh}.vertices", "materials.floor.base_color"
    everything = [f"meshes.{name}.vertices" for name in scene.meshes]
    options = {"spp": 8, "max_depth": max_depth, "seed": 3, "terms": ("interior",)}
    among = renderer.render_backward(adjoint, everything, **options)[path]
    assert np.any(among)
    least = 1e-5 * np.abs(among).max()
    np.testing.assert_allclose(renderer.render_backward(adjoint, [path], **options)[path], among, rtol=2e-5, atol=least)
    # A colour beside it is met on other surfaces.
    with_colour = [*everything, colour]
    both = renderer.render_backward(adjoint, [path, colour], **options)
    for name, value in renderer.render_backward(adjoint, with_colour, **options).items():
        if name in both:
            np.testing.assert_allclose(both[name], value, rtol=2e-5, atol=1e-5 * np.abs(value).max())
    motion = {path: rng.normal(size=among.shape)}
    rest = {name: np.zeros(np.shape(scene.meshes[name.split(".")[1]].vertices)) for name in everything}
    np.testing.assert_allclose(renderer.render_forward(motion, **options),
                               renderer.render_forward({**rest, **motion}, **options), rtol=1e-4, atol=1e-5)


def torus_over_floor(*lights: PointLight) -> Scene:
    """A field in a constant environment: part of its light is hidden by itself and by the floor."""
    floor = small_scenes.rectangle((0, 0, -0.4), (2, 0, 0), (0, 2, 0), "floor")
    return Scene(small_scenes.camera((0.3, -1.6, 1.8), (0, 0, 0), 24, 0.8, up=(0, 0, 1)), {"floor": floor},
                 {"clay": small_scenes.matte(0.7, 0.6, 0.5), "floor": small_scenes.matte()},
                 {f"lamp {k}": light for k, light in enumerate(lights)}, World(np.ones(3)),
                 fields={"body": sampled(torus, 20)})


def painted(scene: Scene) -> Scene:
    """The same with a colour that depends on the place."""
    color = e.VectorMath("MULTIPLY_ADD", e.Coordinates("POSITION"), (0.3, -0.2, 0.1), (0.5, 0.5, 0.5))
    scene.materials["clay"] = Material(textures={"base_color": color})
    return scene


EVEN: dict[str, tuple[str, Callable[[], Scene]]] = {
    "field": ("fields.body.values", torus_over_floor),
    "lit field": ("fields.body.values", lambda: torus_over_floor(PointLight(np.array([0.5, 0.5, 2.0]), 60.0))),
    "painted field": ("fields.body.values", lambda: painted(torus_over_floor())),
    "lit box": ("meshes.box.vertices", small_scenes.floating_box),
}


@pytest.mark.parametrize("max_depth", [2, 3, 6])
@pytest.mark.parametrize("case", EVEN)
def test_paths_in_even_light_add_nothing(case: str, max_depth: int) -> None:
    """The gradient of a body in a constant environment equals that beside the camera's, where all paths are swept."""
    small_scenes.need("native")
    path, make = EVEN[case]
    renderer = Renderer(make(), threads=1)
    camera = renderer.scene.camera
    adjoint = np.random.default_rng(5).normal(size=(camera.height, camera.width, 3))
    options = {"spp": 16, "max_depth": max_depth, "seed": 3, "terms": ("interior",)}
    alone, among = (renderer.render_backward(adjoint, wrt, **options)[path]
                    for wrt in ([path], [path, "camera.to_world"]))
    assert np.any(among)
    np.testing.assert_allclose(alone, among, rtol=2e-5, atol=1e-5 * np.abs(among).max())

"""Derivatives with respect to materials, within their ranges and where a lobe's weight is zero."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Material, Renderer, Scene
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.block_statistics import check, mean_p_value
from tests.support.picture_differences import check_transpose, need_every_table, sums_of_differences
from tests.support.rich_scene import turn

LAYERED = {
    "specular_ior_level": 0.4, "sheen_weight": 0.4, "sheen_tint": np.array([0.9, 0.7, 0.3]), "sheen_roughness": 0.4,
    "coat_weight": 0.3, "coat_tint": np.array([0.9, 0.7, 0.3]), "specular_tint": np.array([0.9, 0.7, 0.3]),
    "metallic": 0.2, "anisotropy": 0.3, "diffuse_roughness": 0.2, "roughness": 0.4, "coat_roughness": 0.3,
}  # fmt: skip


def ball(material: Material) -> Scene:
    scene = shapes.scene(*shapes.ball(2), world=1.0)
    scene.camera.width, scene.camera.height = 16, 12
    scene.materials["clay"] = material
    return scene


@pytest.mark.parametrize("field", [*LAYERED, "ior", "coat_ior", "base_color", "emission"])
def test_pictures_change_as_their_derivatives_say(field: str) -> None:
    need_every_table()
    scene = ball(Material(np.array([0.5, 0.2, 0.4]), np.full(3, 0.1), **LAYERED))  # type: ignore[arg-type]
    path = f"materials.clay.{field}"
    value = np.asarray(parameters.get(scene, path), np.float64)
    direction = np.random.default_rng(3).uniform(0.2, 0.5, value.shape) * value
    found, exact = sums_of_differences(scene, path, direction, 0.02, spp=64)
    check(mean_p_value(found - exact, 0.0, rounding=2e-3 * abs(found.mean())))


COLOR = np.array([0.8, 0.5, 0.7])
DISTRIBUTED = {
    "beckmann": (Material(COLOR, kind="GLOSSY", roughness=0.5, anisotropy=0.3, distribution="BECKMANN"),
                 ("roughness", "anisotropy", "base_color")),
    "beckmann glass": (Material(COLOR, kind="GLASS", roughness=0.6, distribution="BECKMANN"), ("roughness", "ior")),
    "phong": (Material(COLOR, kind="GLOSSY", roughness=0.5, anisotropy=0.3, distribution="ASHIKHMIN_SHIRLEY"),
              ("roughness", "anisotropy", "base_color")),
    "velvet": (Material(COLOR, kind="VELVET", roughness=0.5), ("roughness", "base_color")),
}  # fmt: skip


@pytest.mark.parametrize(("name", "field"), [(name, field) for name, (_, fields) in DISTRIBUTED.items()
                                             for field in fields])  # fmt: skip
def test_distributions_change_as_their_derivatives_say(name: str, field: str) -> None:
    need_every_table()
    scene = ball(DISTRIBUTED[name][0])
    path = f"materials.clay.{field}"
    value = np.asarray(parameters.get(scene, path), np.float64)
    found, exact = sums_of_differences(scene, path, 0.3 * value, 0.02, spp=256)
    check(mean_p_value(found - exact, 0.0, rounding=4e-3 * abs(found.mean())))


FILM = {"thin_film_thickness": 350.0, "thin_film_ior": 1.4}
FILMED = {
    "gloss": Material(COLOR, specular_ior_level=0.5, roughness=0.3, **FILM),
    "metal": Material(COLOR, metallic=1.0, roughness=0.3, specular_tint=np.array([0.9, 0.7, 0.4]), **FILM),
    "glass": Material(COLOR, kind="GLASS", roughness=0.4, **FILM),
    "smooth glass": Material(COLOR, kind="GLASS", roughness=0.0, **FILM),
    "transmission": Material(COLOR, transmission=0.7, roughness=0.3, **FILM),
}  # fmt: skip


@pytest.mark.parametrize("field", [*FILM, "base_color", "ior"])
@pytest.mark.parametrize("name", FILMED)
def test_films_change_as_their_derivatives_say(name: str, field: str) -> None:
    need_every_table()
    if field == "ior" and name in ("metal", "smooth glass"):  # a constant, and rays that bend
        return
    scene = ball(FILMED[name])
    path = f"materials.clay.{field}"
    value = np.asarray(parameters.get(scene, path), np.float64)
    found, exact = sums_of_differences(scene, path, 0.2 * value, 0.02, spp=256)
    check(mean_p_value(found - exact, 0.0, rounding=4e-3 * abs(found.mean())))


@pytest.mark.parametrize("field", ["metallic", "coat_weight", "sheen_weight", "transmission", "specular_ior_level",
                                   "diffuse_roughness", "emission", "base_color", "alpha"])  # fmt: skip
def test_weights_at_the_end_of_their_range_have_one_sided_derivatives(field: str) -> None:
    """A lobe that isn't there yet: what a picture leaves out, a derivative must not."""
    need_every_table()
    # Without a coat only samples of the base find what one would add, and hardly ever what a sharp one would.
    material = Material(np.array([0.5, 0.2, 0.4]), coat_roughness=0.3)
    if field == "base_color":
        material.base_color = np.zeros(3)
    path, inwards = f"materials.clay.{field}", -1.0 if field == "alpha" else 1.0
    direction = inwards * np.ones(np.shape(getattr(material, field)))
    found, exact = sums_of_differences(ball(material), path, direction, 0.01, one_sided=True, spp=96)
    assert exact.mean() != 0.0
    # A one-sided difference is off by half the step times the curvature.
    check(mean_p_value(found - exact, 0.0, rounding=0.1 * abs(exact.mean())))


def test_a_radial_tangent_along_the_normal_gives_no_noise() -> None:
    """Without a UV map the tangent is about the mesh's z axis: on an upright sheet through it, along the normal."""
    need_every_table()
    vertices, faces = shapes.sheet(4)
    upright = vertices[:, [0, 2, 1]] @ turn(0.0, 0.0, 0.25 * np.pi).T
    scene = shapes.scene(upright, faces, world=1.0)
    scene.camera.width, scene.camera.height = 16, 12
    scene.materials["clay"] = Material(np.array([0.5, 0.2, 0.4]), kind="GLOSSY", roughness=0.4)
    paths = ["meshes.object.vertices", "materials.clay.anisotropy"]
    check_transpose(lambda theta: scene, paths, spp=4, terms=("interior",))
    # Forward mode is linear
    renderer, rng = Renderer(scene), np.random.default_rng(1)
    parts = [rng.normal(size=upright.shape) for _ in range(2)]
    none = np.zeros(())
    one, other, both = (renderer.render_forward({paths[0]: t, paths[1]: none}, spp=4, terms=("interior",))
                        for t in (*parts, parts[0] + parts[1]))
    np.testing.assert_allclose(one + other, both, atol=1e-5 * float(np.abs(both).max()))

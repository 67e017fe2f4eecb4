"""Texture values beyond the range of the field that they replace are clamped to it, as in Cycles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Material, Mixture, Renderer, Scene
from edgegrad import expression as e
from tests.support import shapes
from tests.support.picture_differences import check_transpose, need_every_table
from tests.support.small_scenes import Floats, camera, rectangle

SHARES = ("metallic", "roughness", "diffuse_roughness", "transmission", "coat_roughness", "sheen_roughness", "alpha")
LAYERS = ("specular_ior_level", "coat_weight", "sheen_weight")
COLORS = ("base_color", "specular_tint", "coat_tint", "sheen_tint")  # not emission, which may be negative
OTHERS = ("ior", "coat_ior", "anisotropy", "anisotropy_rotation", "normal", "normal_strength", "subsurface_weight",
          "thin_film_thickness", "thin_film_ior")
LAYERED = {
    "coat_weight": 0.4, "sheen_weight": 0.4, "metallic": 0.2, "transmission": 0.2, "specular_ior_level": 0.5,
    "coat_tint": np.array([0.4, 0.7, 0.9]), "coat_roughness": 0.2,
}  # fmt: skip
KINDS = ("PRINCIPLED", "DIFFUSE", "GLOSSY", "GLASS", "REFRACTION", "TRANSLUCENT", "TRANSPARENT", "SHEEN", "DISNEY",
         "VELVET")  # fmt: skip


@pytest.fixture(autouse=True)
def engine() -> None:
    need_every_table()


def texels() -> Floats:
    """4 x 4 texels from -3 to 5, those of a pixel's channels apart."""
    return np.random.default_rng(7).permutation(np.linspace(-3.0, 5.0, 48)).reshape(4, 4, 3)


def textured(field: str, pixels: Floats, kind: str = "PRINCIPLED") -> Scene:
    """A sheet and a ball of layers, a field of which is an image, lit by a light and a bright sky."""
    texture: e.Expression = e.ImageTexture("values", e.Attribute("UVMap"), interpolation="CLOSEST")
    if field not in (*COLORS, "normal"):
        texture = e.Channel(texture, 0)
    layers = LAYERED if kind in ("PRINCIPLED", "DISNEY") else {}
    material = Material(np.array([0.8, 0.5, 0.3]), kind=kind, textures={field: texture}, **layers)  # type: ignore[arg-type]
    vertices, faces = shapes.ball(1, 0.7)
    floor = rectangle((0, 0, -0.9), (1.6, 0, 0), (0, 1.6, 0), "layered")
    meshes = {
        name: replace(mesh, attributes={"UVMap": mesh.vertices[mesh.faces, :2] * 0.4 + 0.5})
        for name, mesh in {"floor": floor, "ball": edgegrad.Mesh(vertices, faces, ("layered",))}.items()
    }
    return Scene(
        camera((0.4, -1.0, 3.0), size=16), meshes, {"layered": material},
        {"lamp": edgegrad.PointLight(np.array([1.5, 1.0, 2.0]), 60.0, 0.2)}, edgegrad.World(np.ones(3), 0.7),
        images={"values": edgegrad.Image(pixels.astype(np.float32))},
    )  # fmt: skip


def picture(scene: Scene) -> Floats:
    return edgegrad.render(scene, spp=16, max_depth=3).astype(np.float64)


@pytest.mark.parametrize("field", [*SHARES, *LAYERS, *COLORS, *OTHERS])
def test_no_light_is_negative(field: str) -> None:
    image = picture(textured(field, texels()))
    assert np.isfinite(image).all()
    assert image.min() >= 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("field", ["base_color", "roughness"])
def test_nor_of_any_shader(kind: str, field: str) -> None:
    image = picture(textured(field, texels(), kind))
    assert np.isfinite(image).all()
    assert image.min() >= 0.0


@pytest.mark.parametrize("field", [*SHARES, *LAYERS, *COLORS])
def test_values_outside_are_the_nearest_inside(field: str) -> None:
    most = 1.0 if field in SHARES else np.inf
    outside, inside = (textured(field, values) for values in (texels(), np.clip(texels(), 0.0, most)))
    np.testing.assert_array_equal(picture(outside), picture(inside))
    assert np.any(picture(outside) != picture(textured(field, np.abs(texels() % 1.0))))


@pytest.mark.parametrize("field", [*SHARES, *LAYERS, *COLORS])
def test_their_derivative_is_zero(field: str) -> None:
    """Inside it isn't; at the end of a range it is that of values inside."""
    most = 1.0 if field in SHARES else np.inf
    values = texels()
    values[0, :, :] = 0.4
    scene = textured(field, values)
    adjoint = np.random.default_rng(0).uniform(0.5, 1.0, (16, 16, 3)).astype(np.float32)
    gradient = Renderer(scene).render_backward(adjoint, ["images.values.pixels"], spp=16, max_depth=2)
    found = np.asarray(gradient["images.values.pixels"])
    outside = (values < 0.0) | (values > most)
    assert not found[outside].any()
    assert found[~outside].any()
    check_transpose(lambda _: scene, ["images.values.pixels"], spp=8, max_depth=2)


@pytest.mark.parametrize("kind", ["DIFFUSE", "PRINCIPLED"])
def test_negative_emission_removes_as_much_light_as_its_opposite_adds(kind: str) -> None:
    """As in Cycles: of a lamp that the camera sees, and on the floor that it lights."""

    def lit(sign: float) -> Floats:
        lamp = Material(np.zeros(3), kind=kind, textures={"emission": e.Combine(sign, 2.0 * sign, 3.0 * sign)})
        meshes = {"floor": rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0), "floor"),
                  "lamp": rectangle((0, 0.5, 0.5), (0.5, 0, 0), (0, 0, 0.3), "lamp")}  # fmt: skip
        scene = Scene(camera((0.4, -2.0, 2.0), (0, 0, 0), size=16), meshes, {
            "floor": Material(np.full(3, 0.5), kind="DIFFUSE"), "lamp": lamp})  # fmt: skip
        return edgegrad.render(scene, spp=16, max_depth=3).astype(np.float64)

    removed = lit(-1.0)
    assert removed.max() <= 0.0 and removed.min() < -2.0
    np.testing.assert_allclose(removed, -lit(1.0), rtol=1e-5)


def test_weights_of_mixtures() -> None:
    """A weight below 0 is none; sums of shaders may weigh more than 1."""
    scene = textured("base_color", np.full((4, 4, 3), 0.5))
    weight = e.Channel(e.ImageTexture("values", e.Attribute("UVMap"), interpolation="CLOSEST"), 0)
    parts = {"one": Material(np.full(3, 0.4)), "other": Material(np.array([0.2, 0.6, 0.1]))}
    scene.materials = {"layered": Mixture(("one", "other"), np.array([0.5, 0.0]), {"1": weight}), **parts}
    pictures = []
    for values in (texels(), np.maximum(texels(), 0.0)):
        scene.images = {"values": edgegrad.Image(values.astype(np.float32))}
        pictures.append(picture(scene))
    assert pictures[0].min() >= 0.0
    np.testing.assert_array_equal(pictures[0], pictures[1])


@pytest.mark.parametrize("made", [{"kind": "GLOSSY"}, {"kind": "GLASS"}, {"metallic": 1.0}, {"transmission": 1.0}])
def test_colors_above_one_scatter_no_negative_light(made: dict[str, Any]) -> None:
    """The sum of the reflections between microfacets diverges, and its closed form is negative."""
    scene = textured("base_color", np.full((4, 4, 3), 10.0))
    texture = scene.materials["layered"].textures  # type: ignore[union-attr]
    scene.materials["layered"] = Material(roughness=1.0, textures=texture, **made)
    assert picture(scene).min() >= 0.0

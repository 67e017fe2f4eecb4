"""Surfaces with bent normals under a sun without size: one light sample is the exact picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Material
from tests.support.bsdf_points import bsdfs
from tests.support.small_scenes import need, pixel_at, rectangle

need("native")

VIEW = np.array([0.5, -0.3, 0.8]) / np.linalg.norm([0.5, -0.3, 0.8])
SUN = np.array([-0.6, 0.2, 0.35]) / np.linalg.norm([-0.6, 0.2, 0.35])
TILTED = np.array([0.5, 0.3, 0.8]) / np.linalg.norm([0.5, 0.3, 0.8])
PLACE = np.array([0.1, 0.2, 0.0])
COLOR = np.array([0.8, 0.5, 0.2])


def sunlit(material: Material) -> edgegrad.Scene:
    """A point of the plane z = 0 with the tilted normal, towards the view, in sunlight from SUN of irradiance 1."""
    material = replace(material, textures={"normal": edgegrad.expression.Combine(*(0.5 + 0.5 * TILTED))})
    plane = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "bent")
    plane.attributes = {"UVMap": (plane.vertices[plane.faces][..., :2] + 1.0) / 2.0}
    return edgegrad.Scene(pixel_at(PLACE + 5.0 * VIEW, PLACE, (0, 0, 1)), {"plane": plane}, {"bent": material},
                          {"sun": edgegrad.SunLight(-SUN)})  # fmt: skip


def radiance(material: Material) -> np.ndarray:
    return edgegrad.Renderer(sunlit(material)).render(spp=16, max_depth=2, seed=1)[0, 0].astype(float)


def unsoftened(material: Material) -> np.ndarray:
    return bsdfs(material, VIEW, SUN, normal=TILTED).value[0].astype(float)


def softening() -> float:
    """Conty Estevez, Lecocq and Stein 2019: Smith's G1 of the light's angle with the smooth normal."""
    tan2 = 1.0 / TILTED[2] ** 2 - 1.0
    return float(2.0 / (1.0 + np.sqrt(1.0 + min(0.125 * tan2, 1.0) * (1.0 / SUN[2] ** 2 - 1.0))))


WIDE = [Material(COLOR, kind="DIFFUSE"), Material(COLOR, kind="SHEEN", roughness=0.5), Material(COLOR)]
GLOSSY = [
    Material(COLOR, kind="GLOSSY", roughness=0.5), Material(COLOR, kind="VELVET", roughness=0.5),
    Material(COLOR, metallic=1.0, roughness=0.5), Material(np.zeros(3), specular_ior_level=0.5, roughness=0.6),
    Material(np.zeros(3), coat_weight=1.0, coat_roughness=0.6, coat_ior=1.8),
]  # fmt: skip


@pytest.mark.parametrize("material", WIDE, ids=lambda m: m.kind)
def test_the_terminator_of_diffuse_lobes_is_softened(material: Material) -> None:
    np.testing.assert_allclose(radiance(material), softening() * unsoftened(material), rtol=2e-3)


@pytest.mark.parametrize("material", GLOSSY, ids=lambda m: f"{m.kind} {m.metallic} {m.coat_weight}")
def test_that_of_glossy_lobes_is_not(material: Material) -> None:
    np.testing.assert_allclose(radiance(material), unsoftened(material), rtol=2e-3)


def layers() -> Material:
    """Most lobes of Principled; the normal's z has a kink at the strength 1."""
    return Material(COLOR, specular_ior_level=0.5, roughness=0.6, coat_weight=0.5, coat_roughness=0.5, sheen_weight=0.2,
                    normal_strength=0.8)  # fmt: skip


@pytest.mark.parametrize("field", ["normal_strength", "roughness", "coat_weight", "specular_ior_level"])
def test_derivatives_are_differences(field: str) -> None:
    material = layers()
    value, step = getattr(material, field), 0.02
    pictures = [radiance(replace(material, **{field: value + sign * step})) for sign in (1, -1)]
    difference = (pictures[0] - pictures[1]) / (2 * step)
    scene = sunlit(material)
    found = edgegrad.Renderer(scene).render_forward(
        {f"materials.bent.{field}": 1.0}, spp=16, max_depth=2, seed=1)[0, 0]  # fmt: skip
    np.testing.assert_allclose(found, difference, rtol=5e-3, atol=2e-3 * np.abs(difference).max())


def test_layers_have_their_own_factors() -> None:
    whole = Material(COLOR, specular_ior_level=0.5, roughness=0.6, coat_weight=0.5, coat_roughness=0.5)
    gloss = Material(np.zeros(3), specular_ior_level=0.5, roughness=0.6, coat_weight=0.5, coat_roughness=0.5)
    wide = unsoftened(whole) - unsoftened(gloss)
    np.testing.assert_allclose(radiance(whole), unsoftened(gloss) + softening() * wide, rtol=2e-3)


@pytest.mark.parametrize("length", [0.01, 7.0])
def test_smooth_normals_of_any_length_are_directions(length: float) -> None:
    """With the normal's own length, rough diffuse surfaces would give light that is too bright, or negative."""
    def picture(vector: np.ndarray) -> np.ndarray:
        material = Material(COLOR, kind="DIFFUSE", diffuse_roughness=0.8,
                            textures={"smooth_normal": edgegrad.expression.Combine(*vector)})  # fmt: skip
        plane = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "bent")
        scene = edgegrad.Scene(pixel_at(PLACE + 5.0 * VIEW, PLACE, (0, 0, 1)), {"plane": plane}, {"bent": material},
                               {"sun": edgegrad.SunLight(-SUN)})  # fmt: skip
        return edgegrad.Renderer(scene).render(spp=16, max_depth=2, seed=1)[0, 0].astype(float)

    np.testing.assert_allclose(picture(length * TILTED), picture(TILTED), rtol=1e-5)

"""BSDFs and energy: furnaces, reciprocity, layers, and the tables of albedos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad.scene.material import Material
from tests.support.bsdf_points import UP, Bsdfs, bsdfs, direction, mixed, random_numbers, rough_materials

WHITE = np.ones(3)
COSINES = (1.0, 0.7, 0.3, 0.08)


def albedo(material: Material, cosine: float, inside: bool = False, n: int = 1 << 16) -> np.ndarray:
    """(3,) share of the light that comes back from a white environment."""
    r = bsdfs(material, direction(cosine), random=random_numbers(n, 7), inside=inside)
    return r.sample_weight.mean(0, dtype=np.float64)


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 0.8, 1.0])
def test_white_metals_and_glass_lose_nothing(roughness: float, cosine: float) -> None:
    """Multiscatter GGX: 1 but for the tables' interpolation."""
    assert albedo(Material(WHITE, kind="GLOSSY", roughness=roughness), cosine) == pytest.approx(1.0, abs=0.005)
    assert albedo(Material(WHITE, metallic=1.0, roughness=roughness), cosine) == pytest.approx(1.0, abs=0.005)
    assert albedo(Material(WHITE, kind="GLASS", roughness=roughness), cosine) == pytest.approx(1.0, abs=0.012)


@pytest.mark.parametrize("cosine", COSINES)
def test_white_diffuse_surfaces_lose_nothing(cosine: float) -> None:
    for roughness in (0.0, 0.5, 1.0):
        rough = Material(WHITE, kind="DIFFUSE", diffuse_roughness=roughness)
        assert albedo(rough, cosine) == pytest.approx(1.0, abs=0.006)
    assert albedo(Material(WHITE, kind="TRANSLUCENT"), cosine) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("cosine", COSINES)
def test_principled_mixes_keep_energy(cosine: float) -> None:
    """All lobes white: never above 1, and not far below (layers take their albedo, not each direction's share)."""
    plain = replace(mixed(), base_color=WHITE, specular_tint=WHITE, coat_tint=WHITE)
    for material in (plain, replace(plain, metallic=0.0), replace(plain, transmission=0.0, coat_weight=1.0)):
        for inside in (False, True):
            share = albedo(material, cosine, inside)
            assert (share < 1.006).all() and (share > 0.94).all()


def test_no_rough_surface_gains_energy() -> None:
    """Including glass from inside, where Cycles' tables lose some; Burley's model alone adds some."""
    for name, material in rough_materials().items():
        if name == "disney":
            continue
        for cosine in COSINES:
            for inside in (False, True):
                assert albedo(material, cosine, inside, 1 << 13).max() < 1.01, name


@pytest.mark.parametrize("name", ["diffuse", "rough diffuse", "rough glossy", "disney", "velvet", "rough beckmann",
                                  "brushed beckmann", "rough phong", "brushed phong"])
def test_reciprocity(name: str) -> None:
    """f(wo, wi) = f(wi, wo). Cycles' compensation and layers depend on the view alone: without them."""
    rng = np.random.default_rng(3)
    a, b = (v * np.sign(v[:, 2:]) / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, 200, 3)))
    material = replace(rough_materials()[name], multiscatter=False)
    there, back = bsdfs(material, a, b).value / b[:, 2:], bsdfs(material, b, a).value / a[:, 2:]
    np.testing.assert_allclose(there, back, rtol=2e-4)
    assert (there > 0).mean() > 0.8  # exponentials may be too small for a float


def test_smooth_mirrors_and_glass_are_fresnel() -> None:
    """Samples of perfect surfaces have the weights, densities and directions of Snell and Fresnel."""
    wo, ior = direction(0.6), 1.5
    mirror = bsdfs(Material(np.array([0.9, 0.5, 0.1]), kind="GLOSSY", roughness=0.0), wo)
    np.testing.assert_allclose(mirror.sample_weight[0], [0.9, 0.5, 0.1], rtol=1e-4)
    np.testing.assert_allclose(mirror.sample_wi[0], wo * [-1, -1, 1], atol=1e-6)
    assert mirror.sample_specular.all() and (mirror.sample_ray_kind == 2).all() and mirror.pdf[0] == 0
    n = 1 << 12
    u = np.full((3, n), 0.5, np.float32)
    u[0] = (np.arange(n) + 0.5) / n
    glass = bsdfs(Material(WHITE, kind="GLASS", roughness=0.0, ior=ior), wo, random=u)
    cos_t = np.sqrt(1 - (1 - 0.6**2) / ior**2)
    s, p = (0.6 - ior * cos_t) / (0.6 + ior * cos_t), (ior * 0.6 - cos_t) / (ior * 0.6 + cos_t)
    fresnel = 0.5 * (s * s + p * p)
    assert 1 - glass.sample_transmitted.mean() == pytest.approx(fresnel, abs=1 / n + 1e-6)
    np.testing.assert_allclose(glass.sample_weight, 1.0, rtol=1e-3)
    refracted = glass.sample_wi[glass.sample_transmitted]
    np.testing.assert_allclose(refracted, np.broadcast_to([-0.8 / ior, 0, -cos_t], refracted.shape), atol=1e-6)
    inside = bsdfs(Material(WHITE, kind="GLASS", roughness=0.0, ior=ior), direction(0.3), random=u, inside=True)
    assert not inside.sample_transmitted.any()  # beyond the critical angle


def test_emission_is_filtered_by_coat_and_sheen() -> None:
    def light(**fields: object) -> np.ndarray:
        material = Material(np.zeros(3), np.array([2.0, 1.0, 0.5]), specular_ior_level=0.0, **fields)  # type: ignore[arg-type]
        result: Bsdfs = bsdfs(material, UP)
        return result.emission[0]

    np.testing.assert_allclose(light(), [2.0, 1.0, 0.5])
    # Seen along the normal a smooth coat reflects ((n - 1) / (n + 1))^2 and filters by its tint once.
    tint = np.array([0.5, 0.9, 1.0])
    coated = light(coat_weight=1.0, coat_roughness=0.0, coat_ior=1.5, coat_tint=tint)
    np.testing.assert_allclose(coated, np.array([2.0, 1.0, 0.5]) * 0.96 * tint, rtol=2e-3)
    assert (light(sheen_weight=1.0, sheen_roughness=1.0) < [1.9, 0.95, 0.48]).all()


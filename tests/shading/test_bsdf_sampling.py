"""Samples of BSDFs against their densities and values; lanes and instruction sets agree; no NaN anywhere."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from edgegrad import _native
from edgegrad.scene.material import KINDS, Material
from tests.support.block_statistics import check, means_p_value, normal_p_value
from tests.support.bsdf_points import bsdfs, direction, random_numbers, rough_materials
from tests.support.distributions import chi_square_tail

ROUGH = rough_materials()
BINS = (16, 20)  # of the cosine and the angle
FINE = 32  # places per bin and axis for the density's integral
QUADRATURE = 0.02  # its relative error: refraction's density has steep edges
SAMPLES = 100_000
FAVOURED = 0b11100  # mirror, coat and interface (shading/bsdf/lobe.h)
# Samples of the picture, and those of derivatives by the width of lobes, of all that have such.
WAYS = [(name, favoured) for name in ROUGH for favoured in (0, FAVOURED)
        if not favoured or name not in ("diffuse", "rough diffuse", "translucent", "sheen", "velvet")]  # fmt: skip


def views(name: str) -> list[tuple[float, bool]]:
    both = name == "mixed" or ROUGH[name].kind in ("GLASS", "REFRACTION")
    return [(0.8, False), (0.25, False)] + ([(0.7, True)] if both else [])


def expected_counts(material: Material, wo: NDArray[np.float32], inside: bool, favoured: int) -> NDArray[np.float64]:
    """The density's integral over each bin, times the number of samples."""
    z, angle = ((np.arange(n * FINE) + 0.5) / (n * FINE) for n in BINS)
    z, angle = np.meshgrid(2 * z - 1, 2 * np.pi * angle, indexing="ij")
    r = np.sqrt(1 - z**2)
    wi = np.stack([r * np.cos(angle), r * np.sin(angle), z], -1).reshape(-1, 3)
    pdf = bsdfs(material, wo, wi, inside=inside, favoured=favoured).pdf.astype(float)
    return pdf.reshape(BINS[0], FINE, BINS[1], FINE).mean((1, 3)) * (4 * np.pi / (BINS[0] * BINS[1])) * SAMPLES


@pytest.mark.parametrize(("name", "favoured"), WAYS)
def test_samples_follow_the_density(name: str, favoured: int) -> None:
    """Chi-square of sampled directions."""
    for cosine, inside in views(name):
        wo = direction(cosine, 0.1)
        expected = expected_counts(ROUGH[name], wo, inside, favoured)
        numbers = np.random.default_rng(5).random((3, SAMPLES), np.float32)
        r = bsdfs(ROUGH[name], wo, random=numbers, inside=inside, favoured=favoured)
        wi = r.sample_wi[r.sample_active]
        row = np.minimum(((wi[:, 2] + 1) / 2 * BINS[0]).astype(int), BINS[0] - 1)
        column = (np.arctan2(wi[:, 1], wi[:, 0]) / (2 * np.pi) % 1 * BINS[1]).astype(int) % BINS[1]
        counts = np.bincount(row * BINS[1] + column, minlength=BINS[0] * BINS[1]).astype(float)
        expected = expected.ravel()
        assert expected.sum() <= SAMPLES * 1.003
        # Bins of few samples are taken together.
        rare = expected < 20
        assert counts[expected < 1e-6].sum() <= 2
        counts = np.append(counts[~rare], counts[rare].sum())
        expected = np.append(expected[~rare], expected[rare].sum())
        # What isn't in a bin went nowhere: below the surface.
        lost = np.sqrt(expected.sum() * max(1.0 - expected.sum() / SAMPLES, 0.0))  # of a binomial, its deviation
        off = max(abs(counts.sum() - expected.sum()) - 0.003 * SAMPLES, 0.0)  # beyond the error of the quadrature
        check(normal_p_value(off / max(lost, 1.0)))
        usable = expected > 20
        z2 = (counts - expected)[usable] ** 2 / (expected + (QUADRATURE * expected) ** 2)[usable]
        check(chi_square_tail(float(z2.sum()), int(usable.sum()) - 1))


@pytest.mark.parametrize(("name", "favoured"), WAYS)
def test_weight_is_value_by_density(name: str, favoured: int) -> None:
    for cosine, inside in views(name):
        wo = direction(cosine, 0.3)
        first = bsdfs(ROUGH[name], wo, random=random_numbers(4096, 1), inside=inside, favoured=favoured)
        again = bsdfs(ROUGH[name], wo, first.sample_wi, inside=inside, favoured=favoured)
        hit = first.sample_active
        assert hit.mean() > 0.3
        np.testing.assert_allclose(first.sample_pdf[hit], again.pdf[hit], rtol=1e-4)
        np.testing.assert_allclose(first.sample_weight[hit], again.value[hit] / again.pdf[hit, None], rtol=1e-4)
        below = first.sample_wi[:, 2] < 0
        assert (below == first.sample_transmitted)[hit].all()
        assert (first.sample_ray_kind[hit & first.sample_transmitted] == 3).all()
        assert not first.sample_weight[~hit].any() and not first.sample_specular[hit].any()


@pytest.mark.parametrize(("name", "favoured"), WAYS)
def test_samples_and_values_give_the_same_albedo(name: str, favoured: int) -> None:
    n = 1 << 17
    rng = np.random.default_rng(2)
    sphere = rng.normal(size=(n, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    for cosine, inside in views(name):
        wo = direction(cosine)
        found = bsdfs(ROUGH[name], wo, random=random_numbers(n, 4), inside=inside, favoured=favoured)
        sampled = found.sample_weight.astype(float)
        value = bsdfs(ROUGH[name], wo, sphere, inside=inside).value.astype(float) * 4 * np.pi
        check(means_p_value(sampled, value, rounding=1e-4))


def test_packets_may_mix_shaders() -> None:
    """Each lane's result is that of its shader alone, whatever the others are."""
    materials = [*ROUGH.values(), Material(kind="GLOSSY", roughness=0.0), Material(kind="TRANSPARENT")]
    rng = np.random.default_rng(9)
    n = 4000
    which = rng.integers(0, len(materials), n)
    wo = rng.normal(size=(n, 3))
    wo[:, 2] = np.abs(wo[:, 2])
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    wi = rng.normal(size=(n, 3))
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    u = rng.random((3, n), np.float32)
    together = bsdfs(materials, wo, wi, u, which=which)
    for k, material in enumerate(materials):
        at = which == k
        alone = bsdfs(material, wo[at], wi[at], u[:, at])
        np.testing.assert_allclose(together.value[at], alone.value, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(together.pdf[at], alone.pdf, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(together.sample_wi[at], alone.sample_wi, atol=1e-4)
        np.testing.assert_array_equal(together.sample_active[at], alone.sample_active)


@pytest.mark.parametrize("instruction_set", _native.instruction_sets())
def test_instruction_sets_agree(instruction_set: str) -> None:
    materials = list(ROUGH.values())
    rng = np.random.default_rng(1)
    n = 3000
    which = rng.integers(0, len(materials), n)
    wo, wi = rng.normal(size=(2, n, 3))
    wo[:, 2] = np.abs(wo[:, 2]) + 0.05
    wo, wi = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (wo, wi))
    u = rng.random((3, n), np.float32)
    a = bsdfs(materials, wo, wi, u, which=which)
    b = bsdfs(materials, wo, wi, u, which=which, instruction_set=instruction_set)
    np.testing.assert_allclose(a.value, b.value, rtol=5e-4, atol=1e-5)
    np.testing.assert_allclose(a.pdf, b.pdf, rtol=5e-4, atol=1e-5)
    close = np.abs(a.sample_wi - b.sample_wi).max(1) < 1e-3
    assert close.mean() > 0.998  # a rounding may change the choice of a lobe


share = st.floats(0, 1, width=32) | st.sampled_from([0.0, 1.0, 1e-6])
color = st.tuples(share, share, share).map(np.array)
material_strategy = st.builds(
    Material, base_color=color, kind=st.sampled_from(KINDS), metallic=share, roughness=share, diffuse_roughness=share,
    specular_ior_level=share, specular_tint=color, ior=st.floats(0.3, 4) | st.just(1.0), anisotropy=st.floats(-1, 1),
    anisotropy_rotation=st.floats(-2, 2), transmission=share, coat_weight=share, coat_roughness=share,
    coat_ior=st.floats(1, 4), coat_tint=color, sheen_weight=share, sheen_roughness=share, sheen_tint=color,
    thin_film_thickness=st.sampled_from([0.0, 0.05, 0.5]) | st.floats(0, 2e4), thin_film_ior=st.floats(0.3, 4),
    multiscatter=st.booleans(), distribution=st.sampled_from(("GGX", "GGX", "BECKMANN")))  # fmt: skip


@settings(max_examples=300, deadline=None, derandomize=True)
@given(material_strategy, st.floats(1e-6, 1) | st.just(1.0), st.floats(0, 1), st.booleans(), st.integers(0, 10**6))
def test_nothing_is_ever_invalid(m: Material, cosine: float, tilt: float, inside: bool, seed: int) -> None:
    """Any parameters, grazing views, tilted shading normals, random numbers at their ends."""
    n = 64
    rng = np.random.default_rng(seed)
    wi = rng.normal(size=(n, 3))
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    wi[0], wi[1] = (1, 0, 0), (0, 0, 1)
    u = rng.random((3, n), np.float32)
    u[:, 2], u[:, 3] = 0, 0.99999994
    r = bsdfs(m, direction(cosine, 0.7), wi, u, inside=inside, normal=direction(1 - 0.7 * tilt, 0.4))
    for values in (r.value, r.pdf, r.sample_weight, r.sample_pdf, r.emission):
        assert np.isfinite(values).all() and (values >= 0).all()
    assert np.abs(np.linalg.norm(r.sample_wi[r.sample_active], axis=1) - 1).max(initial=0) < 1e-3
    side = r.sample_wi[:, 2] < 0
    assert (side == r.sample_transmitted)[r.sample_active].all()
    # Tiny roughnesses apart, no single sample carries much more than the light it stands for.
    assert r.sample_weight.max(initial=0) < 1e3

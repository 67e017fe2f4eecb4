"""BSDFs against Cycles, value by value: a plane under a sun without size has no noise."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad.scene.material import Material
from tests.support.bsdf_points import bsdfs

pytest.importorskip("bpy")
pytestmark = pytest.mark.slow

from tests.support.cycles_slices import cycles_slice, pixels  # noqa: E402

COLOR = np.array([0.8, 0.5, 0.2])
ABOVE = tuple(np.array(v) / np.linalg.norm(v) for v in ((0.3, 0.9, 0.8), (-0.5, -0.2, 0.35)))
UNDER = np.array((0.2, 0.6, -0.8)) / np.linalg.norm((0.2, 0.6, -0.8))


def principled(**fields: object) -> Material:
    return Material(COLOR, **{"specular_ior_level": 0.5, **fields})  # type: ignore[arg-type]


def simple(kind: str, **fields: object) -> Material:
    return Material(COLOR, kind=kind, **fields)  # type: ignore[arg-type]


CASES = {
    "diffuse": simple("DIFFUSE"),
    "rough diffuse": simple("DIFFUSE", diffuse_roughness=0.7),
    "glossy": simple("GLOSSY", roughness=0.5),
    "glossy without multiscatter": simple("GLOSSY", roughness=0.5, multiscatter=False),
    "rough glossy": simple("GLOSSY", roughness=1.0),
    "brushed": simple("GLOSSY", roughness=0.4, anisotropy=0.6),
    "brushed across": simple("GLOSSY", roughness=0.4, anisotropy=-0.6, anisotropy_rotation=0.1),
    "translucent": simple("TRANSLUCENT"),
    "sheen": simple("SHEEN", roughness=0.5),
    "thin sheen": simple("SHEEN", roughness=0.2),
    **{f"velvet {r}": simple("VELVET", roughness=r) for r in (0.15, 0.4, 1.0)},
    **{f"Beckmann {r}": simple("GLOSSY", roughness=r, distribution="BECKMANN") for r in (0.1, 0.4, 0.7, 1.0)},
    "Beckmann brushed": simple("GLOSSY", roughness=0.4, anisotropy=-0.6, anisotropy_rotation=0.1,
                               distribution="BECKMANN"),
    "Beckmann glass": simple("GLASS", roughness=0.4, distribution="BECKMANN"),
    "rough Beckmann glass": simple("GLASS", roughness=0.9, ior=1.2, distribution="BECKMANN"),
    "Beckmann refraction": simple("REFRACTION", roughness=0.5, distribution="BECKMANN"),
    **{f"Ashikhmin-Shirley {r}": simple("GLOSSY", roughness=r, distribution="ASHIKHMIN_SHIRLEY")
       for r in (0.1, 0.4, 0.7, 1.0)},
    "Ashikhmin-Shirley brushed": simple("GLOSSY", roughness=0.4, anisotropy=0.7, anisotropy_rotation=0.1,
                                        distribution="ASHIKHMIN_SHIRLEY"),
    "glass": simple("GLASS", roughness=0.4),
    "rough glass": simple("GLASS", roughness=0.8, ior=1.2),
    "refraction": simple("REFRACTION", roughness=0.5),
    "plastic": principled(),
    "rough plastic": principled(diffuse_roughness=0.6),
    "specular level": principled(specular_ior_level=0.9, roughness=0.3, specular_tint=np.array([0.3, 0.9, 0.5])),
    "high index": principled(ior=2.0, roughness=0.3),
    "index below 1": principled(ior=0.8, specular_ior_level=0.7),
    "metal": principled(metallic=1.0, roughness=0.4, specular_tint=np.array([0.5, 0.8, 1.0])),
    "half metal": principled(metallic=0.5, roughness=0.3),
    "brushed metal": principled(metallic=0.7, anisotropy=0.8, anisotropy_rotation=0.2, roughness=0.4),
    "transmission": principled(transmission=0.5, roughness=0.4, specular_tint=np.array([0.5, 0.9, 1.0]), metallic=0.2),
    "coat": principled(coat_weight=1.0, coat_roughness=0.3),
    "tinted coat": principled(coat_weight=0.7, coat_roughness=0.2, coat_tint=np.array([0.9, 0.4, 0.2]), coat_ior=1.8),
    "fabric": principled(sheen_weight=1.0, sheen_roughness=0.5, sheen_tint=np.array([1.0, 0.8, 0.6])),
    **{f"film of {d} nm": principled(roughness=0.3, thin_film_thickness=d, specular_tint=np.array([0.4, 0.9, 1.0]))
       for d in (0.4, 120.0, 400.0, 2500.0)},
    "film without level": principled(roughness=0.3, specular_ior_level=0.0, thin_film_thickness=500.0,
                                     thin_film_ior=1.8),
    "thin film on metal": principled(roughness=0.4, metallic=1.0, thin_film_thickness=300.0, thin_film_ior=2.0,
                                     specular_tint=np.array([0.5, 0.8, 1.0])),
    "film on half metal": principled(roughness=0.4, metallic=0.6, thin_film_thickness=350.0, anisotropy=0.5,
                                     coat_weight=0.3),
    "film on glass": simple("GLASS", roughness=0.4, thin_film_thickness=350.0),
    "light film on glass": simple("GLASS", roughness=0.4, ior=1.6, thin_film_thickness=500.0, thin_film_ior=1.2),
    "film on transmission": principled(transmission=0.7, roughness=0.4, thin_film_thickness=420.0, thin_film_ior=1.7,
                                       specular_tint=np.array([0.5, 0.9, 1.0])),
    "all": principled(sheen_weight=0.5, coat_weight=0.5, coat_roughness=0.4, metallic=0.3, transmission=0.4,
                      diffuse_roughness=0.5, roughness=0.35, anisotropy=0.4),
}  # fmt: skip

# Deviations of single pixels: their filter, though narrow, moves rays by a part of these lobes' width.
SHARP = {"velvet 0.15": 0.01, "Beckmann 0.1": 0.08, "Ashikhmin-Shirley 0.1": 0.08, "Ashikhmin-Shirley brushed": 0.02}


def difference(material: Material, wi: np.ndarray, inside: bool) -> tuple[float, float]:
    """Mean of ours by Cycles', and root mean square of the difference by Cycles' mean."""
    cycles = cycles_slice(material, wi, inside)
    _, at = pixels()
    around = np.stack([-at[:, 1], at[:, 0], 0 * at[:, 0]], -1)  # the radial tangent about z
    ours = bsdfs(material, cycles.wo, cycles.wi, inside=inside, tangent=around).value.astype(float)
    mean = float(cycles.value.mean(dtype=float))
    if mean == 0:
        return 1.0 + float(ours.mean()), 0.0
    return float(ours.mean()) / mean, float(np.sqrt(((ours - cycles.value) ** 2).mean())) / mean


@pytest.mark.parametrize("name", CASES)
def test_reflection_is_that_of_cycles(name: str) -> None:
    transparent = CASES[name].kind in ("GLASS", "REFRACTION") or CASES[name].transmission > 0
    for wi in ABOVE:
        for inside in (False, True) if transparent else (False,):
            mean, rms = difference(CASES[name], wi, inside)
            assert abs(mean - 1) < 1e-3 and rms < SHARP.get(name, 5e-3), (wi, inside, mean, rms)


@pytest.mark.parametrize("name", ["glass", "rough glass", "refraction", "transmission", "translucent", "all",
                                  "film on glass", "light film on glass", "film on transmission", "Beckmann glass",
                                  "Beckmann refraction"])
def test_transmission_is_that_of_cycles(name: str) -> None:
    """From outside. Cycles evaluates, though it never samples, refractions that no microfacet can give."""
    mean, rms = difference(CASES[name], UNDER, False)
    assert abs(mean - 1) < (0.04 if name == "rough glass" else 2e-3), mean
    assert rms < (0.08 if name == "rough glass" else 0.01), rms

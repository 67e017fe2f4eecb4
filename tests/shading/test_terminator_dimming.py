"""Light at grazing angles on meshes with a terminator_shading fades out as if its angle were larger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Material
from tests.support.small_scenes import need, pixel_at, rectangle

need("native")

VIEW = np.array([0.3, -0.2, 0.9]) / np.linalg.norm([0.3, -0.2, 0.9])
COLOR = np.array([0.8, 0.5, 0.2])
OFFSET = 0.6
STRETCH = 1.0 / (1.0 - 0.5 * OFFSET)
MATERIALS = [Material(COLOR, kind="DIFFUSE"), Material(COLOR, kind="GLOSSY", roughness=0.5), Material(COLOR),
             Material(COLOR, specular_ior_level=0.5, roughness=0.4)]  # fmt: skip


def sunlit(material: Material, angle: float, offset: float = OFFSET) -> edgegrad.Scene:
    """A point of the plane z = 0 in the light of a sun at an angle to its normal."""
    plane = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "plane")
    travel = -np.array([np.sin(angle), 0.0, np.cos(angle)])
    return edgegrad.Scene(pixel_at(5.0 * VIEW, (0, 0, 0), (0, 0, 1)),
                          {"plane": replace(plane, terminator_shading=offset)}, {"plane": material},
                          {"sun": edgegrad.SunLight(travel, 2.0)})  # fmt: skip


def radiance(material: Material, angle: float, offset: float = OFFSET) -> np.ndarray:
    return edgegrad.Renderer(sunlit(material, angle, offset)).render(spp=4, max_depth=2)[0, 0].astype(np.float64)


@pytest.mark.parametrize("angle", [0.2, 0.9, 1.2])
@pytest.mark.parametrize("material", MATERIALS, ids=lambda m: f"{m.kind} {m.specular_ior_level}")
def test_the_cosine_is_that_of_a_larger_angle(material: Material, angle: float) -> None:
    factor = max(np.cos(STRETCH * angle), 0.0) / np.cos(angle)
    wanted = factor * radiance(material, angle, 0.0)
    np.testing.assert_allclose(radiance(material, angle), wanted, rtol=2e-4, atol=1e-6)


@pytest.mark.parametrize("path", ["materials.plane.base_color", "lights.sun.direction"])
@pytest.mark.parametrize("material", MATERIALS[:2], ids=lambda m: m.kind)
def test_derivatives_of_dimmed_light(material: Material, path: str) -> None:
    angle, step = 0.8, 2e-3
    renderer = edgegrad.Renderer(sunlit(material, angle))
    if path.startswith("materials"):
        tangent = np.ones(3)
        ends = [radiance(replace(material, base_color=COLOR + sign * step), angle) for sign in (-1, 1)]
    else:
        tangent = -np.array([np.cos(angle), 0.0, -np.sin(angle)])
        ends = [radiance(material, angle + sign * step) for sign in (-1, 1)]
    forward = renderer.render_forward({path: tangent}, spp=4, max_depth=2)
    np.testing.assert_allclose(forward[0, 0], (ends[1] - ends[0]) / (2.0 * step), rtol=3e-3)
    adjoint = np.array([[[1.0, 2.0, -0.5]]], np.float32)
    backward = renderer.render_backward(adjoint, [path], spp=4, max_depth=2)[path]
    assert np.sum(backward * tangent) == pytest.approx(float(np.sum(adjoint * forward)), rel=1e-4)

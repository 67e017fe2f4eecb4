"""Samples of lights: their densities and the irradiance that they add up to."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import edgegrad
from edgegrad.scene.light import Light
from tests.support.light_directions import AT, ORIGIN, UP, check_density, facing, grid
from tests.support.light_probes import Probe, lit
from tests.support.small_scenes import glowing, need

need("native")

Floats = NDArray[np.float64]


DOWN = np.array([-0.2, -0.1, -1.0])
SIZED: dict[str, Light] = {
    "sphere": edgegrad.PointLight(AT, 10.0, 0.3, True),
    "facing disk": edgegrad.PointLight(AT, 10.0, 0.3),
    "sphere around the point": edgegrad.PointLight(np.array([0.1, 0.0, 0.2]), 10.0, 0.5, True),
    "spot with a radius": edgegrad.SpotLight(AT, DOWN, 10.0, 1.0, 0.5, 0.1, True),
    "sun": edgegrad.SunLight(DOWN, 3.0, 0.5),
    "narrow sun": edgegrad.SunLight(DOWN, 3.0, 0.009),
    "rectangle": edgegrad.AreaLight(facing(AT, (0, 0, 0.2)), np.array([0.5, 1.0])),
    "large rectangle": edgegrad.AreaLight(facing((0.3, 0, 0.1), (0.1, 0, 0)), np.array([5.0, 4.0])),
    "tiny rectangle": edgegrad.AreaLight(facing(AT, (0, 0, 0.2)), np.array([0.002, 0.001])),
    "ellipse": edgegrad.AreaLight(facing(AT, (0, 0, 0.2)), np.array([0.5, 1.0]), "ELLIPSE"),
    "rectangle with spread": edgegrad.AreaLight(facing(AT, (0, 0, 0.2)), np.array([0.5, 1.0]), spread=1.2),
}


def triangle(*corners: ArrayLike) -> edgegrad.Mesh:
    return edgegrad.Mesh(np.array(corners, float), np.array([[0, 1, 2]], np.int32), ("hot",))


TRIANGLES = {
    "triangle": triangle((-0.2, 0.3, 0.9), (0.4, 0.5, 1.0), (0.5, -0.3, 0.7)),
    "thin triangle": triangle((-0.9, 0.3, 0.9), (0.9, 0.31, 1.0), (0.9, 0.3, 1.0)),
    "tiny triangle": triangle((0.3, 0.3, 0.9), (0.301, 0.3, 0.9), (0.3, 0.302, 0.901)),
    "grazing triangle": triangle((-2.0, -1.0, 0.01), (2.0, -1.0, 0.01), (0.0, 2.0, 0.02)),
}


def scene_of(name: str) -> edgegrad.Scene:
    if name in TRIANGLES:
        return lit({}, {"lamp": TRIANGLES[name]}, {"hot": glowing(3.0, two_sided=True)})
    return lit({"light": SIZED[name]})


@pytest.mark.parametrize("name", [name for name in (*SIZED, *TRIANGLES) if name != "thin triangle"])
def test_directions_follow_their_density(name: str) -> None:
    check_density(Probe(scene_of(name)))


@pytest.mark.parametrize("name", [*SIZED, *TRIANGLES])
def test_samples_know_their_density(name: str) -> None:
    """The density of a sample is the one that the engine computes for a ray that meets the light at the same place."""
    probe = Probe(scene_of(name))
    s = probe.sample(ORIGIN, UP, grid(64))
    lit_ones = s["radiance"][:, 0] > 0.0
    told = probe.density(ORIGIN, UP, s["w"].astype(np.float64))
    met = lit_ones & (told > 0.0)  # rounding may lose the rim
    assert met.sum() > (0.9 if name != "thin triangle" else 0.6) * lit_ones.sum()
    assert lit_ones.any()
    np.testing.assert_allclose(told[met], s["pdf"][met], rtol=2e-3)


# ---------------------------------------------------------------- irradiance
def irradiance(scene: edgegrad.Scene, position: ArrayLike = ORIGIN, normal: ArrayLike = UP, n: int = 256) -> float:
    s = Probe(scene).sample(position, normal, grid(n))
    cosine = np.maximum(s["w"] @ np.asarray(normal, np.float32), 0.0)
    return float(np.mean(s["radiance"][:, 0].astype(np.float64) * s["geometry"] * cosine))


def polygon_irradiance(corners: Floats, normal: Floats) -> float:
    """Lambert's formula, per unit radiance, of a polygon above the horizon."""
    w = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(w, np.roll(w, -1, axis=0), strict=True):
        c = np.cross(a, b)
        total += math.acos(float(a @ b)) * float(c @ normal) / float(np.linalg.norm(c))
    return abs(total) / 2.0


def test_irradiance_of_point_lights() -> None:
    d2 = float(AT @ AT)
    cosine = AT[2] / math.sqrt(d2)
    intensity = 10.0 / (4.0 * math.pi)
    point = irradiance(lit({"light": edgegrad.PointLight(AT, 10.0)}))
    assert point == pytest.approx(intensity * cosine / d2, rel=1e-5)
    # A sphere above the horizon gives the same, wherever its radius ends; a disk of radiance L that faces the point
    # gives pi L cos sin^2 of its half angle.
    assert irradiance(lit({"light": SIZED["sphere"]})) == pytest.approx(point, rel=1e-4)
    assert irradiance(lit({"light": SIZED["facing disk"]})) == pytest.approx(point * d2 / (d2 + 0.09), rel=1e-4)
    # Inside a sphere of radiance L the irradiance is pi L.
    radiance = intensity / (math.pi * 0.25)
    assert irradiance(lit({"light": SIZED["sphere around the point"]})) == pytest.approx(math.pi * radiance, rel=1e-3)


def test_irradiance_of_spots() -> None:
    d2 = float(AT @ AT)
    free = 10.0 / (4.0 * math.pi) * AT[2] / d2**1.5
    axis = -AT / math.sqrt(d2)
    turned = np.array([axis[2], 0.0, -axis[0]])
    turned = turned / np.linalg.norm(turned)
    for off, angle, blend in ((0.0, 0.8, 0.3), (0.3, 0.8, 0.5), (0.39, 0.8, 1.0), (0.41, 0.8, 0.5)):
        direction = axis * math.cos(off) + turned * math.sin(off)
        t = (math.cos(off) - math.cos(angle / 2)) / ((1.0 - math.cos(angle / 2)) * blend)
        t = min(max(t, 0.0), 1.0)
        spot = edgegrad.SpotLight(AT, direction, 10.0, angle, blend)
        assert irradiance(lit({"light": spot}), n=8) == pytest.approx(free * t * t * (3 - 2 * t), rel=2e-4, abs=1e-7)
        linear = edgegrad.SpotLight(AT, direction, 10.0, angle, blend, falloff="LINEAR")
        t = min(max((angle / 2 - off) / (angle / 2 * blend), 0.0), 1.0)
        assert irradiance(lit({"light": linear}), n=8) == pytest.approx(free * t, rel=2e-4, abs=1e-7)


def test_irradiance_of_suns() -> None:
    cosine = 1.0 / np.linalg.norm(DOWN)
    for angle in (0.0, 0.009, 0.5, 1.5):
        sun = edgegrad.SunLight(DOWN, 3.0, angle)
        assert irradiance(lit({"light": sun})) == pytest.approx(3.0 * cosine, rel=1e-4)


def test_irradiance_of_area_lights() -> None:
    """Lambert's formula for the rectangle; a disk over the point gives pi L r^2/(r^2 + h^2)."""
    for name in ("rectangle", "tiny rectangle"):
        light = SIZED[name]
        assert isinstance(light, edgegrad.AreaLight)
        half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * light.size
        corners = light.to_world[:3, 3] + half @ light.to_world[:3, :2].T
        radiance = light.power / (math.pi * float(light.size.prod()))
        assert irradiance(lit({"light": light})) == pytest.approx(radiance * polygon_irradiance(corners, UP), rel=2e-4)
    disk = edgegrad.AreaLight(facing((0, 0, 0.7), ORIGIN), np.array([1.2, 1.2]), "ELLIPSE", 5.0)
    expected = 5.0 / (math.pi * 0.36) * 0.36 / (0.36 + 0.49)
    assert irradiance(lit({"light": disk})) == pytest.approx(expected, rel=1e-3)
    behind = edgegrad.AreaLight(facing((0, 0, 0.7), (0, 0, 2)), np.array([1.2, 1.2]))
    assert irradiance(lit({"light": behind})) == 0.0


@pytest.mark.parametrize("spread", [0.02, 0.5, 2.0, 3.0])
def test_spread_keeps_the_power(spread: float) -> None:
    """From afar the light's intensity at the angle t is L A cos t (tan s - tan t)/(tan s - s), s half the spread."""
    light = edgegrad.AreaLight(facing((0, 0, 1000.0), ORIGIN), np.array([0.1, 0.1]), power=10.0, spread=spread)
    s = spread / 2
    flux = 0.0
    angles = (np.arange(64) + 0.5) / 64 * s
    for t in angles:
        w = np.array([math.sin(t), 0.0, math.cos(t)])
        intensity = irradiance(lit({"light": light}), np.array([0, 0, 1000.0]) - 1000.0 * w, w, n=4) * 1e6
        flux += intensity * 2 * math.pi * math.sin(t) * s / 64
    assert flux == pytest.approx(10.0, rel=3e-3)


DECAYS = (("QUADRATIC", 2.0, 0), ("LINEAR", 0.5, 1), ("CONSTANT", 0.0, 2))


@pytest.mark.parametrize(("decay", "smooth", "power"), DECAYS)
def test_decay_is_a_factor_of_the_distance(decay: str, smooth: float, power: int) -> None:
    for r in (0.4, 1.0, 3.0):
        point = edgegrad.PointLight(np.array([0.0, 0.0, r]), 10.0, decay=decay, smooth=smooth)
        expected = 10.0 / (4.0 * math.pi * r**2) * r**power * r**2 / (r**2 + smooth)
        assert irradiance(lit({"light": point})) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("along", ["x", "y"])
def test_a_stretched_cone_is_wider_along_its_axes(along: str) -> None:
    """At the angle t along an axis stretched by f, the share is that of u in the round cone, tan u = tan t / f."""
    angle, blend, stretch = 0.8, 0.5, np.array([2.0, 0.5])
    factor = stretch["xy".index(along)]
    for inner in (0.1, 0.3, 0.35, 0.39, 0.41):
        t = math.atan(math.tan(inner) * factor)
        side = np.array([1.0, 0.0, 0.0]) if along == "x" else np.array([0.0, 1.0, 0.0])
        place = 2.0 * (np.array([0.0, 0.0, math.cos(t)]) - math.sin(t) * side)
        spot = edgegrad.SpotLight(place, np.array([0.0, 0.0, -1.0]), 10.0, angle, blend, stretch=stretch)
        edge = (math.cos(inner) - math.cos(angle / 2)) / ((1.0 - math.cos(angle / 2)) * blend)
        share = min(max(edge, 0.0), 1.0)
        expected = 10.0 / (16.0 * math.pi) * math.cos(t) * share**2 * (3.0 - 2.0 * share)
        assert irradiance(lit({"light": spot})) == pytest.approx(expected, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("name", list(TRIANGLES))
def test_irradiance_of_triangles(name: str) -> None:
    expected = 3.0 * polygon_irradiance(np.asarray(TRIANGLES[name].vertices), UP)
    assert irradiance(scene_of(name)) == pytest.approx(expected, rel=2e-3)


def test_instruction_sets_agree() -> None:
    for name in ("rectangle", "triangle", "sphere"):
        fast, plain = (Probe(scene_of(name), isa).sample(ORIGIN, UP, grid(16)) for isa in ("", "scalar"))
        for key in ("w", "pdf", "radiance"):
            np.testing.assert_allclose(fast[key], plain[key], rtol=1e-4, atol=1e-5)


# ---------------------------------------------------------------- choice


# ---------------------------------------------------------------- environment


# ---------------------------------------------------------------- in pictures



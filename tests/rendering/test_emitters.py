"""Samples of lights: their densities, the light they add up to, the choice among many, and what they light."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import edgegrad
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene.light import Light
from tests.support.light_probes import Probe, lit
from tests.support.small_scenes import camera, glowing, matte, need, pixel_at, rectangle

need("native")

Floats = NDArray[np.float64]
ORIGIN, UP = np.zeros(3), np.array([0.0, 0.0, 1.0])
# A correct sampler fails a chi-square test with this probability; seeds are fixed.
ALARM = 1e-4


def facing(position: ArrayLike, target: ArrayLike) -> Floats:
    """Transform of an area light at `position` that shines to `target`."""
    p = np.asarray(position, float)
    z = (p - target) / np.linalg.norm(p - target)
    x = np.cross((0.1, 0.9, 0.2), z)
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3] = np.stack([x, np.cross(z, x), z, p], axis=1)
    return out


AT = np.array([0.3, 0.2, 1.0])
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


def grid(n: int, seed: int = 0) -> Floats:
    """(n^2, 2) stratified numbers in [0, 1)^2."""
    i = np.arange(n)
    cells = np.stack(np.meshgrid(i, i, indexing="ij"), -1).reshape(-1, 2)
    return np.minimum((cells + np.random.default_rng(seed).random(cells.shape)) / n, 0.9999999)


def cone_directions(axis: Floats, rise: Floats, turn: Floats) -> Floats:
    """Unit vectors whose cosine to the axis is 1 - rise, `turn` in [0, 1) around it."""
    a = np.cross(axis, (0.3, 0.5, -0.8))
    a /= np.linalg.norm(a)
    sine = np.sqrt(rise * (2.0 - rise))
    across = np.cos(2 * np.pi * turn)[:, None] * a + np.sin(2 * np.pi * turn)[:, None] * np.cross(axis, a)
    return np.asarray(across * sine[:, None] + axis * (1.0 - rise)[:, None])


def chi_square_tail(statistic: float, degrees: int) -> float:
    """Probability of a chi-square variate above `statistic` (Wilson and Hilferty 1931)."""
    c = 2.0 / (9.0 * degrees)
    return 1.0 - NormalDist().cdf(((statistic / degrees) ** (1.0 / 3.0) - 1.0 + c) / math.sqrt(c))


def check_density(probe: Probe, samples: int = 30_000, fine: int = 12, rim: float = 0.005) -> None:
    """The histogram of directions sampled from the origin, over a cone around all of them, is that of the density.

    A cell's expected number is a quadrature over fine x fine places, and off by the share `rim` of it.
    """
    position, normal = ORIGIN, UP
    uv = np.random.default_rng(7).random((samples, 2)).clip(0.0, 0.9999999)
    s = probe.sample(position, normal, uv)
    w = s["w"].astype(np.float64)
    axis = w.mean(axis=0) / np.linalg.norm(w.mean(axis=0))
    rise = 0.5 * np.sum((w - axis) ** 2, axis=1)
    top = min(1.05 * rise.max(), 2.0)
    rings, sectors = 10, 16
    a = np.cross(axis, (0.3, 0.5, -0.8))
    a /= np.linalg.norm(a)
    turn = (np.arctan2(w @ np.cross(axis, a), w @ a) / (2 * np.pi)) % 1.0
    ring, sector = (rise / top * rings).astype(int).clip(0, rings - 1), (turn * sectors).astype(int) % sectors
    observed = np.bincount(ring * sectors + sector, minlength=rings * sectors)

    at = (np.arange(rings * fine) + 0.5) / (rings * fine), (np.arange(sectors * fine) + 0.5) / (sectors * fine)
    places = np.stack(np.meshgrid(*at, indexing="ij"), -1).reshape(-1, 2)
    p = probe.density(position, normal, cone_directions(axis, places[:, 0] * top, places[:, 1]))
    solid_angle = 2 * np.pi * top / len(p)
    expected = p.reshape(rings, fine, sectors, fine).sum(axis=(1, 3)).reshape(-1) * solid_angle * samples
    assert expected.sum() / samples == pytest.approx(1.0, abs=0.02)

    order = np.argsort(expected)  # cells with few expected samples are pooled
    few = np.cumsum(expected[order]) < 10.0
    pooled = [np.append(v[order][~few], v[order][few].sum()) for v in (observed, expected)]
    pooled = [v[pooled[1] > 5.0] for v in pooled]
    error = pooled[1] + (rim * pooled[1]) ** 2
    statistic = float(np.sum((pooled[0] - pooled[1]) ** 2 / error))
    assert len(pooled[0]) > 8
    assert chi_square_tail(statistic, len(pooled[0]) - 1) > ALARM, (statistic, len(pooled[0]))


@pytest.mark.parametrize("name", [name for name in (*SIZED, *TRIANGLES) if name != "thin triangle"])
def test_directions_follow_their_density(name: str) -> None:
    check_density(Probe(scene_of(name)))


@pytest.mark.parametrize("name", [*SIZED, *TRIANGLES])
def test_samples_know_their_density(name: str) -> None:
    """The density given with a sample is the one that a ray that meets the light is told."""
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
def dome(count: int, seed: int = 0) -> edgegrad.Scene:
    """Many small lights of all finite kinds that don't hide each other from the origin, of very different power."""
    rng = np.random.default_rng(seed)
    lights: dict[str, Light] = {}
    meshes = {}
    for k in range(count):
        # A spiral of points, evenly over the upper hemisphere (golden angle).
        z = 0.15 + 0.8 * (k + 0.5) / count
        turn = 2.399963 * k
        at = np.array([math.sqrt(1 - z * z) * math.cos(turn), math.sqrt(1 - z * z) * math.sin(turn), z])
        distance = rng.uniform(1.0, 3.0)
        at = at * distance
        size, power = 0.5 * distance / math.sqrt(count), float(rng.lognormal(0.0, 1.5))
        target = ORIGIN + rng.normal(size=3) * 0.3
        kind = k % 4
        if kind == 0:
            lights[f"l{k}"] = edgegrad.PointLight(at, power, size, bool(k % 8))
        elif kind == 1:
            lights[f"l{k}"] = edgegrad.AreaLight(facing(at, target), np.array([size, 2 * size]), power=power)
        elif kind == 2:
            lights[f"l{k}"] = edgegrad.SpotLight(at, target - at, power, 1.0, 0.3, size, True)
        else:
            x, y = facing(at, target)[:3, 0], facing(at, target)[:3, 1]
            meshes[f"l{k}"] = edgegrad.Mesh(np.stack([at - x * size, at + x * size, at - y * size]),
                                            np.array([[0, 1, 2]], np.int32), ("hot",))  # fmt: skip
    lights["sun"] = edgegrad.SunLight(-np.array([0.0, 0.1, 1.0]), 0.3, 0.3)
    return lit(lights, meshes, {"hot": glowing(2.0, two_sided=True)})


@pytest.mark.parametrize("count", [8, 200])
def test_choice_follows_its_density(count: int) -> None:
    """Few lights are picked from a list, many down the tree: where samples land is what their density says."""
    probe = Probe(dome(count))
    check_density(probe, fine=50, rim=0.03)
    s = probe.sample(ORIGIN, UP, grid(64))
    on = s["radiance"][:, 0] > 0.0
    told = probe.density(ORIGIN, UP, s["w"].astype(np.float64))
    same = np.isclose(told, s["pdf"], rtol=1e-2) & on
    assert same.sum() > 0.97 * on.sum()  # the sun's disk or another light may lie in line


@pytest.mark.parametrize("count", [5, 300])
def test_probabilities_sum_to_one(count: int) -> None:
    rng = np.random.default_rng(1)
    at = rng.normal(size=(count, 3)) + (0, 0, 6.0)
    lights = {f"l{k}": edgegrad.PointLight(p, float(rng.lognormal(0, 2)), 1e-3, True) for k, p in enumerate(at)}
    probe = Probe(lit(lights))
    for point in rng.normal(size=(5, 3)):
        d = at - point
        r = np.linalg.norm(d, axis=1)
        solid_angle = 2 * np.pi * (1.0 - np.sqrt(1.0 - (1e-3 / r) ** 2))
        probability = probe.density(point, UP, d / r[:, None]) * solid_angle
        assert probability.min() > 0.0
        assert probability.sum() == pytest.approx(1.0, rel=0.02)  # lights may lie in line


def test_lights_that_cannot_matter_are_not_picked() -> None:
    lights = {
        "below": edgegrad.PointLight(np.array([0.0, 0.0, -1.0]), 1e6),
        "turned away": edgegrad.AreaLight(facing((0, 0, 1), (0, 0, 3)), np.ones(2), power=1e6),
        "beside the cone": edgegrad.SpotLight(np.array([2.0, 0, 1]), np.array([1.0, 0, 0]), 1e6, 0.5, 0.1),
        "off": edgegrad.PointLight(np.array([0.0, 1.0, 1.0]), 0.0),
        "this one": edgegrad.PointLight(AT, 1.0),
    }
    s = Probe(lit(lights)).sample(ORIGIN, UP, grid(32))
    np.testing.assert_allclose(s["geometry"], 1.0 / (AT @ AT), rtol=1e-5)  # its probability is 1


# ---------------------------------------------------------------- environment
def panorama(height: int, seed: int = 3) -> NDArray[np.float32]:
    """A dim, uneven sky with one very bright pixel."""
    rng = np.random.default_rng(seed)
    pixels = (0.2 + rng.random((height, 2 * height, 3))).astype(np.float32)
    pixels[height // 5, height // 2] = 3.0 * height**2
    return pixels


TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def sky(pixels: NDArray[np.float32]) -> edgegrad.Scene:
    return lit({}, images={"sky": edgegrad.Image(pixels)}, world=edgegrad.World(np.ones(3), 2.0, "sky", TURN))


def sphere_grid(rows: int) -> tuple[Floats, float]:
    """Directions of equal solid angle, and that solid angle."""
    z, turn = np.meshgrid((np.arange(rows) + 0.5) / rows * 2 - 1, (np.arange(2 * rows) + 0.5) / rows * np.pi)
    s = np.sqrt(1 - z * z)
    return np.stack([s * np.cos(turn), s * np.sin(turn), z], -1).reshape(-1, 3), 4 * np.pi / z.size


def test_environment_is_mapped_as_documented() -> None:
    pixels = panorama(16)
    w, _ = sphere_grid(40)
    d = w @ TURN.T
    u = (0.5 - np.arctan2(d[:, 1], d[:, 0]) / (2 * np.pi)) * 32 - 0.5
    v = (0.5 - np.arcsin(d[:, 2]) / np.pi) * 16 - 0.5
    x, y = np.floor(u).astype(int), np.floor(v).astype(int)
    fx, fy = (u - x)[:, None], (v - y)[:, None]
    upper = pixels[y % 16, x % 32] * (1 - fx) + pixels[y % 16, (x + 1) % 32] * fx
    lower = pixels[(y + 1) % 16, x % 32] * (1 - fx) + pixels[(y + 1) % 16, (x + 1) % 32] * fx
    np.testing.assert_allclose(Probe(sky(pixels)).look(w)["radiance"], 2 * (upper * (1 - fy) + lower * fy), rtol=2e-3,
                               atol=0.02)  # fmt: skip


@pytest.mark.parametrize("height", [4, 64, 256])
def test_environment_density(height: int) -> None:
    """It integrates to 1, and is that of the samples."""
    probe = Probe(sky(panorama(height)))
    w, solid_angle = sphere_grid(1200)
    # Equal steps miss parts of the one bright pixel's cells.
    assert float(probe.look(w)["pdf"].astype(np.float64).sum()) * solid_angle == pytest.approx(1.0, abs=0.05)
    s = probe.sky(grid(128))
    agree = np.isclose(probe.look(s["w"])["pdf"], s["pdf"], rtol=1e-3)
    assert agree.mean() > 0.995  # rounding moves some over a cell's edge
    # Every place that is brighter than the mean is found: samples and density give its integral.
    above = s["radiance"][:, 1] > 20.0
    bright = probe.look(w)["radiance"][:, 1].astype(np.float64)
    assert np.mean(above * s["radiance"][:, 1] / s["pdf"]) == pytest.approx(
        float(bright[bright > 20.0].sum()) * solid_angle, rel=0.1)  # fmt: skip


@pytest.mark.parametrize("height", [4, 64])
def test_light_of_the_environment(height: int) -> None:
    """A flat floor under the sky: radiance is albedo/pi times the irradiance, for direct light and longer paths."""
    pixels = panorama(height)
    scene = edgegrad.Scene(
        pixel_at((0.3, 0.1, 3.0), (0, 0, 0)), {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor")},
        {"floor": matte(0.5, 0.5, 0.5)}, images={"sky": edgegrad.Image(pixels)},
        world=edgegrad.World(np.ones(3), 2.0, "sky", TURN),
    )  # fmt: skip
    w, solid_angle = sphere_grid(1200)
    radiance = Probe(sky(pixels)).look(w)["radiance"].astype(np.float64)
    expected = 0.5 / np.pi * (radiance * np.maximum(w[:, 2:], 0.0)).sum(axis=0) * solid_angle
    for depth in (2, 4):
        pictures = [Renderer(scene).render(spp=4096, seed=k, max_depth=depth)[0, 0] for k in range(4)]
        error = np.std(pictures, axis=0, ddof=1) / 2.0
        np.testing.assert_allclose(np.mean(pictures, axis=0), expected, atol=float(5 * error.max()), rtol=5e-3)
        assert error.max() < 0.01 * expected.max()


# ---------------------------------------------------------------- in pictures
def room(light: Light) -> edgegrad.Scene:
    """One pixel of a floor, and a screen on the way to the light."""
    return edgegrad.Scene(
        pixel_at((0.0, -3.0, 2.0), (0, 0, 0), (0, 0, 1)),
        {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor"),
         "screen": rectangle((0, 0, 1.0), (0.2, 0, 0), (0, 0.2, 0), "floor")},
        {"floor": matte(0.5, 0.5, 0.5)}, {"light": light},
    )  # fmt: skip


def test_linking_shadows_and_receivers() -> None:
    at = np.array([0.0, 0.0, 2.0])
    free = 0.5 / np.pi * 10.0 / (4.0 * np.pi) / 4.0

    def pixel(**fields: Any) -> float:
        return float(Renderer(room(edgegrad.PointLight(at, 10.0, **fields))).render(spp=4)[0, 0, 0])

    assert pixel() == 0.0
    assert pixel(casts_shadow=False) == pytest.approx(free, rel=1e-3)
    assert pixel(blockers=("floor",)) == pytest.approx(free, rel=1e-3)
    assert pixel(blockers=("screen",)) == 0.0
    assert pixel(casts_shadow=False, receivers=("floor",)) == pytest.approx(free, rel=1e-3)
    assert pixel(casts_shadow=False, receivers=("screen",)) == 0.0
    assert pixel(casts_shadow=False, visible_to=frozenset(("camera", "glossy"))) == 0.0


def test_lights_with_a_size_are_seen_where_they_may_be() -> None:
    """The camera sees the light's radiance, and what stands behind it too; it casts no shadow."""
    floor = {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor")}
    everything = frozenset(("camera", "diffuse", "glossy", "transmission", "shadow"))
    for light, radiance in (
        (edgegrad.AreaLight(facing((0, 0, 1), (0, 0, 2)), np.array([1.0, 1.0]), power=4.0), 4.0 / np.pi),
        (edgegrad.PointLight(np.array([0, 0, 1.0]), 4.0, 0.5, True), 4.0 / (4 * np.pi**2 * 0.25)),
    ):
        for seen in (True, False):
            light.visible_to = everything if seen else everything - {"camera"}
            scene = edgegrad.Scene(pixel_at((0, 0, 3.0), (0, 0, 0)), floor, {"floor": matte(0, 0, 0)}, {"light": light})
            assert Renderer(scene).render(spp=4)[0, 0, 0] == pytest.approx(radiance if seen else 0.0, rel=1e-4)


def test_both_strategies_give_the_light() -> None:
    """A rough mirror finds a sized light by its own rays too: the picture of a glossy floor under a sphere doesn't
    depend on whether samples of the light are possible for it."""
    lamp = edgegrad.PointLight(np.array([0.0, 0.6, 0.8]), 20.0, 0.4, True)
    glossy = edgegrad.Material(np.full(3, 0.8), kind="GLOSSY", roughness=0.3)
    view = camera((0, -2.0, 1.2), (0, 0, 0), size=8, fov=0.4, up=(0, 0, 1))
    floor = {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "floor")}
    scene = edgegrad.Scene(view, floor, {"floor": glossy}, {"light": lamp})
    # A mesh of the same radiance instead: small triangles around the sphere.
    n = 40
    v, faces = sphere_mesh(n)
    ball = edgegrad.Mesh(v * 0.4 + lamp.position, faces, ("hot",))
    hot = glowing(20.0 / (4 * np.pi**2 * 0.16))
    other = edgegrad.Scene(view, {**floor, "ball": ball}, {"floor": glossy, "hot": hot}, {})
    a, b = (np.mean([Renderer(s).render(spp=256, seed=k) for k in range(4)], axis=0)[4:] for s in (scene, other))
    assert a.mean() > 0.1
    assert a.mean() == pytest.approx(b.mean(), rel=0.01)


def sphere_mesh(n: int) -> tuple[Floats, NDArray[np.int32]]:
    """Unit sphere of n x 2n quads in triangles, wound outwards, with the sphere's area."""
    t, p = np.meshgrid(np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, 2 * n + 1), indexing="ij")
    v = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    i, j = (a.reshape(-1) for a in np.meshgrid(np.arange(n), np.arange(2 * n), indexing="ij"))
    a, b = i * (2 * n + 1) + j, (i + 1) * (2 * n + 1) + j
    faces = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)])
    m = np.cross(v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]])
    kept = np.linalg.norm(m, axis=1) > 1e-9
    area = np.linalg.norm(m, axis=1).sum() / 2
    return v * math.sqrt(4 * math.pi / area), faces[kept].astype(np.int32)

"""Pictures and derivatives of both engines against formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.small_scenes import (
    FLOOR,
    Floats,
    box,
    camera,
    glowing,
    matte,
    need,
    pixel_at,
    rectangle,
    split,
    white_world,
)

ALBEDO = np.array([0.7, 0.4, 0.2])
LOOK = pixel_at((0.3, 2.0, 2.5), (0.3, 0.0, 0.4))
SEEN = np.array([0.3, 0.0, 0.4])


@pytest.fixture(params=["reference", "native"])
def engine(request: pytest.FixtureRequest) -> str:
    need(request.param)
    return str(request.param)


def above(height: float) -> Floats:
    """The point straight above SEEN."""
    return SEEN + np.array([0.0, height, 0.0])


def lit_floor(lights: dict[str, edgegrad.PointLight | edgegrad.SunLight | edgegrad.AreaLight]) -> edgegrad.Scene:
    return edgegrad.Scene(LOOK, {"floor": rectangle(**FLOOR, material="clay")}, {"clay": matte(*ALBEDO)}, lights)


def lying_light(height: float, half: float, power: float) -> edgegrad.AreaLight:
    """A square light over the point SEEN that shines down."""
    to_world = np.eye(4)
    to_world[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    to_world[:3, 3] = above(height)
    return edgegrad.AreaLight(to_world, np.full(2, 2.0 * half), power=power)


def rectangle_irradiance(radiance: float, height: float, half: float) -> float:
    """Irradiance under the centre of a square of half width `half`, parallel and `height` above."""
    a = half / height
    return radiance * 4.0 * a / np.sqrt(1.0 + a * a) * np.arctan(a / np.sqrt(1.0 + a * a))


def samples_of(renderer: Renderer, spp: int, seeds: int = 16) -> Floats:
    """(seeds, 3) independent estimates of one pixel."""
    return np.array([renderer.render(spp=spp, seed=k)[0, 0] for k in range(seeds)], np.float64)


def test_point_light(engine: str) -> None:
    position = np.array([1.0, 1.5, -0.2])
    light = edgegrad.PointLight(position, 50.0, color=np.array([1.0, 0.5, 0.2]))
    to = position - SEEN
    r = np.linalg.norm(to)
    expected = ALBEDO / np.pi * 50.0 * light.color / (4.0 * np.pi) * to[1] / r**3
    got = Renderer(lit_floor({"p": light}), engine=engine).render(spp=4)[0, 0]
    assert got == pytest.approx(expected, rel=2e-4)


def test_sun(engine: str) -> None:
    light = edgegrad.SunLight(np.array([1.0, -2.0, 0.5]), 3.0, color=np.array([1.0, 0.5, 0.2]))
    expected = ALBEDO / np.pi * 3.0 * light.color * 2.0 / np.sqrt(5.25)
    assert Renderer(lit_floor({"s": light}), engine=engine).render(spp=4)[0, 0] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("height", [0.2, 1.0])
def test_area_light(engine: str, height: float) -> None:
    """Irradiance under a square; the light itself is not seen, though it hangs between camera and floor."""
    half, power = 0.5, 7.0
    radiance = power / (np.pi * 4.0 * half * half)
    expected = ALBEDO / np.pi * rectangle_irradiance(radiance, height, half)
    samples = samples_of(Renderer(lit_floor({"a": lying_light(height, half, power)}), engine=engine), 256)
    check(mean_p_value(samples, expected))
    assert half_width(samples).max() < 0.2 * expected.max()  # a wrong factor pi, 2 or cosine is noticed


def test_emissive_mesh_lights_as_the_area_light(engine: str) -> None:
    scene = lit_floor({})
    scene.meshes = {**scene.meshes, "lamp": rectangle(above(1.0), (0.5, 0, 0), (0, 0, 0.5), "lamp")}
    scene.materials = {**scene.materials, "lamp": glowing(2.0)}
    scene.camera = pixel_at((0.3, 0.4, 2.5), (0.3, 0.0, 0.4))
    expected = ALBEDO / np.pi * rectangle_irradiance(2.0, 1.0, 0.5)
    check(mean_p_value(samples_of(Renderer(scene, engine=engine), 256), expected))
    scene.meshes["lamp"].faces = scene.meshes["lamp"].faces[:, ::-1].copy()
    assert not Renderer(scene, engine=engine).render(spp=16).any()  # the back is dark
    scene.materials["lamp"].emission_two_sided = True
    check(mean_p_value(samples_of(Renderer(scene, engine=engine), 256), expected))


def test_white_furnace(engine: str) -> None:
    """A convex body in a constant environment radiates albedo times its radiance everywhere, without noise."""
    scene = edgegrad.Scene(
        camera((2, 1.5, 3), fov=0.2), {"box": box((0, 0, 0), (1, 1, 1), "clay")}, {"clay": matte(*ALBEDO)},
        world=edgegrad.World(np.array([1.0, 2.0, 3.0]), 0.5),
    )
    renderer = Renderer(scene, engine=engine)
    image = renderer.render(spp=4)
    assert image == pytest.approx(np.broadcast_to(ALBEDO * scene.world.color * 0.5, image.shape), rel=1e-5)
    assert not renderer.render(spp=4, max_depth=1).any()
    # The derivatives by colour are as simple; only the reference's have no noise.
    rel = 2e-5 if engine == "reference" else 2e-2
    d = renderer.render_forward({"materials.clay.base_color": np.ones(3)}, spp=4).mean(axis=(0, 1))
    assert d == pytest.approx(scene.world.color * 0.5, rel=rel)
    d = renderer.render_forward({"world.strength": 1.0}, spp=4).mean(axis=(0, 1))
    assert d == pytest.approx(ALBEDO * scene.world.color, rel=rel)


def test_clip_distances(engine: str) -> None:
    scene = lit_floor({"s": edgegrad.SunLight(np.array([0.0, -1.0, 0.0]))})
    scene.world = edgegrad.World(np.array([0.25, 0.5, 0.75]))
    depth = float(np.linalg.norm(LOOK.to_world[:3, 3] - SEEN))
    for start, end, seen in ((depth - 0.1, depth + 0.1, True), (0.01, depth - 0.1, False), (depth + 0.1, 100.0, False)):
        scene.camera = replace(LOOK, clip_start=start, clip_end=end)
        image = Renderer(scene, engine=engine).render(spp=4)[0, 0]
        assert (image == pytest.approx(scene.world.color, rel=1e-6)) != seen


def test_point_light_derivatives(engine: str) -> None:
    """Floor straight below the light and seen along its normal: L = f I / h^2, and only height counts."""
    h, f = 1.6, ALBEDO / np.pi
    scene = lit_floor({"p": edgegrad.PointLight(above(h), 4.0 * np.pi)})
    scene.camera = pixel_at(above(1.0), SEEN, up=(0, 0, 1))
    renderer = Renderer(scene, engine=engine)
    up = np.tile([0.0, 1.0, 0.0], (4, 1))
    d = renderer.render_forward({"meshes.floor.vertices": up}, spp=4, terms=("interior",))[0, 0]
    assert d == pytest.approx(2.0 * f / h**3, rel=1e-3)
    d = renderer.render_forward({"lights.p.power": 1.0}, spp=4)[0, 0]
    assert d == pytest.approx(f / h**2 / (4.0 * np.pi), rel=1e-4)
    d = renderer.render_forward({"materials.clay.base_color": np.array([1.0, 0.0, 0.0])}, spp=4)[0, 0]
    assert d == pytest.approx([1.0 / (np.pi * h**2), 0.0, 0.0], rel=1e-4)


def test_sun_derivative_by_tilt(engine: str) -> None:
    """The floor turns about the view axis' foot: L = f E cos(angle to the sun)."""
    w = np.array([1.0, -2.0, 0.0]) / np.sqrt(5.0)
    scene = lit_floor({"s": edgegrad.SunLight(w)})
    vertices = scene.meshes["floor"].vertices
    rate = np.cross([0.0, 0.0, 1.0], vertices - SEEN)  # the normal moves along -x
    d = Renderer(scene, engine=engine).render_forward({"meshes.floor.vertices": rate}, spp=4, terms=("interior",))
    assert d[0, 0] == pytest.approx(ALBEDO / np.pi * w[0], rel=1e-4)


def test_dark_emitter_has_a_derivative(engine: str) -> None:
    """A black lamp gives no light, but its derivative by emission is that of a lit one."""
    scene = lit_floor({})
    scene.meshes = {**scene.meshes, "lamp": rectangle(above(1.0), (0.5, 0, 0), (0, 0, 0.5), "lamp")}
    scene.materials = {**scene.materials, "lamp": glowing(0.0)}
    scene.world = white_world(1e-3)
    scene.camera = pixel_at((0.3, 0.4, 2.5), (0.3, 0.0, 0.4))
    renderer = Renderer(scene, engine=engine)
    found = [renderer.render_forward({"materials.lamp.emission": np.ones(3)}, spp=128, seed=k)[0, 0] for k in range(16)]
    expected = ALBEDO / np.pi * rectangle_irradiance(1.0, 1.0, 0.5)
    check(mean_p_value(found, expected))


# ---------------------------------------------------------------- the area of a triangle on the screen
def seen_area(vertices: Floats, cam: edgegrad.Camera) -> float:
    """Pixels that a triangle covers: clipped against the frustum in camera space, then projected."""
    p = vertices - cam.to_world[:3, 3]
    polygon = np.stack([p @ cam.to_world[:3, 0], p @ cam.to_world[:3, 1], -(p @ cam.to_world[:3, 2])], axis=1)
    f = cam.focal
    cx, cy = (float(c) for c in cam.principal_point)
    sides = [(f, 0, cx, 0), (-f, 0, cam.width - cx, 0), (0, -f, cy, 0), (0, f, cam.height - cy, 0)]
    for x, y, z, w in [(0, 0, 1, -cam.clip_start), *sides]:
        value = polygon @ (x, y, z) + w
        out = []
        for k in range(len(polygon)):
            j = (k + 1) % len(polygon)
            if value[k] >= 0.0:
                out.append(polygon[k])
            if (value[k] >= 0.0) != (value[j] >= 0.0):
                out.append(polygon[k] + value[k] / (value[k] - value[j]) * (polygon[j] - polygon[k]))
        polygon = np.array(out)
    s = f * polygon[:, :2] / polygon[:, 2:]
    x, y = s.T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


@pytest.mark.parametrize(
    "vertices",
    [
        pytest.param([[-0.9, -0.7, 0.0], [0.8, -0.9, 0.2], [0.2, 1.0, -0.3]], id="inside"),
        pytest.param([[-3.0, -0.7, 0.0], [0.8, -2.9, 0.2], [0.2, 1.0, -0.3]], id="over the picture's border"),
        pytest.param([[-0.5, -0.4, 1.0], [0.5, -0.5, 1.5], [0.2, -0.6, 6.0]], id="through the near plane"),
    ],
)
def test_projected_area_of_a_black_body(engine: str, vertices: list[list[float]]) -> None:
    """sum(image) = L * area on the screen, so its gradient is that of the area: boundary term only."""
    v = np.array(vertices)
    cam = replace(camera(size=32), clip_start=0.1)
    mesh = edgegrad.Mesh(v, np.array([[0, 1, 2]], np.int32), ("hot",))
    renderer = Renderer(edgegrad.Scene(cam, {"t": mesh}, {"hot": glowing(2.0, True)}), engine=engine)
    ones = np.ones((32, 32, 3), np.float32) / 3.0
    assert renderer.render(spp=64, max_depth=1).sum() / 3.0 == pytest.approx(2.0 * seen_area(v, cam), rel=2e-3)
    found = [
        renderer.render_backward(ones, ["meshes.t.vertices"], spp=32, seed=k, max_depth=1)["meshes.t.vertices"]
        for k in range(16)
    ]
    expected, h = np.zeros((3, 3)), 1e-5
    for i in np.ndindex(3, 3):
        d = np.zeros((3, 3))
        d[i] = h
        expected[i] = 2.0 * (seen_area(v + d, cam) - seen_area(v - d, cam)) / (2.0 * h)
    largest = float(np.abs(expected).max())
    check(mean_p_value(found, expected, rounding=1e-3 * largest))
    assert half_width(found).max() < 0.2 * largest


# ---------------------------------------------------------------- topology
def test_cube_stored_shared_or_split(engine: str) -> None:
    """Convex in a constant environment: the interior term is exactly 0, and seams are no borders."""
    cube = box((0, 0, 0), (0.7, 0.6, 0.5), "clay", 0.5)
    gradients = []
    for mesh in (cube, split(cube)):
        scene = edgegrad.Scene(camera((0, 1.2, 4)), {"cube": mesh}, {"clay": matte(*ALBEDO)}, world=white_world())
        renderer = Renderer(scene, engine=engine)
        rate = np.cross([0.2, 1.0, 0.1], mesh.vertices)
        interior = renderer.render_forward({"meshes.cube.vertices": rate}, spp=8, terms=("interior",))
        assert not interior.any()
        adjoint = np.random.default_rng(0).normal(size=(32, 32, 3)).astype(np.float32)
        gradient = renderer.render_backward(adjoint, ["meshes.cube.vertices"], spp=64)["meshes.cube.vertices"]
        gradients.append(float(np.sum(gradient * rate)))
    assert gradients[0] != 0.0
    assert gradients[1] == pytest.approx(gradients[0], rel=1e-9)  # the very same edges in the same order

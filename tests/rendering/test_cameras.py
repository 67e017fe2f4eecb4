"""Cameras against geometry: the projection of points, filters, apertures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Camera, Material, Renderer, Scene, World
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.small_scenes import box, need, rectangle

Floats = NDArray[np.float64]


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def lamp(at: tuple[float, float, float], size: float, camera: Camera, facing: str = "z") -> Scene:
    """One small glowing square in the dark."""
    u, v = {"z": ((1, 0, 0), (0, 1, 0)), "x": ((0, 1, 0), (0, 0, 1))}[facing]
    square = rectangle(at, tuple(size * np.array(u)), tuple(size * np.array(v)), "glow")
    return Scene(camera, {"lamp": square}, {"glow": Material(np.zeros(3), np.ones(3))})


def centroid(image: Floats) -> Floats:
    """(2,) mean position, pixels, x to the right and y down."""
    weight = image[..., 0].astype(np.float64)
    y, x = np.mgrid[: weight.shape[0], : weight.shape[1]] + 0.5
    return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()


def test_orthographic_pictures_keep_their_scale() -> None:
    camera = Camera(np.eye(4), kind="ORTHOGRAPHIC", ortho_width=4.0, width=80, height=60, shift=np.array([0.1, -0.05]))
    for depth in (1.0, 50.0):
        image = Renderer(lamp((0.7, -0.4, -depth), 0.2, camera)).render(spp=256, max_depth=1)
        # 20 pixels per metre about the principal point (40 - 8, 30 - 4).
        np.testing.assert_allclose(centroid(image), [32 + 14, 26 + 8], atol=0.05)
        assert image[..., 0].sum() == pytest.approx((0.4 * 20) ** 2, rel=2e-3)


def test_pixels_may_be_oblong() -> None:
    camera = Camera(np.eye(4), fov_x=1.0, width=60, height=40, pixel_aspect=2.0, shift=np.array([0.0, 0.1]))
    image = Renderer(lamp((0.5, 0.6, -3.0), 0.1, camera)).render(spp=512, max_depth=1)
    f = camera.focal
    np.testing.assert_allclose(centroid(image), [30 + f * 0.5 / 3.0, 20 + 3 - f * 0.6 / 3.0 / 2.0], atol=0.05)


@pytest.mark.parametrize("direction", [(0.3, 0.2), (2.5, -0.6), (-1.7, 0.9)])
def test_equirectangular_pictures_are_longitude_and_latitude(direction: tuple[float, float]) -> None:
    longitude, latitude = direction
    camera = Camera(np.eye(4), kind="EQUIRECTANGULAR", width=128, height=64, clip_start=0.0)
    towards = np.array([
        math.sin(longitude) * math.cos(latitude), math.sin(latitude), -math.cos(longitude) * math.cos(latitude)
    ])
    a = np.cross(towards, [0.0, 1.0, 0.0])
    a /= np.linalg.norm(a)
    at = 4.0 * towards
    square = rectangle(tuple(at), tuple(0.1 * a), tuple(0.1 * np.cross(a, towards)), "glow")
    scene = Scene(camera, {"lamp": square}, {"glow": Material(np.zeros(3), np.ones(3))})
    image = Renderer(scene).render(spp=512, max_depth=1)
    expected = [64 + longitude / (2 * np.pi) * 128, 32 - latitude / np.pi * 64]
    np.testing.assert_allclose(centroid(image), expected, atol=0.05)


def test_part_of_a_panorama() -> None:
    camera = Camera(np.eye(4), kind="EQUIRECTANGULAR", width=60, height=60, longitude=np.array([-0.5, 0.7]),
                    latitude=np.array([-0.4, 0.2]))
    image = Renderer(lamp((0.0, 0.0, -4.0), 0.05, camera)).render(spp=512, max_depth=1)
    np.testing.assert_allclose(centroid(image), [60 * 0.5 / 1.2, 60 * 0.2 / 0.6], atol=0.05)


FISHEYES = {
    "FISHEYE_EQUISOLID": (lambda angle: 2.0 * 0.25 * math.sin(0.5 * angle), {"fisheye_lens": 0.25}),
    "FISHEYE_EQUIDISTANT": (lambda angle: angle / 4.0, {"fisheye_fov": 4.0}),
    # The inverse of theta = 0.1 + 2 r + 3 r^2
    "FISHEYE_POLYNOMIAL": (
        lambda angle: (-2.0 + math.sqrt(4.0 + 12.0 * (angle - 0.1))) / 6.0,
        {"fisheye_polynomial": np.array([0.1, 2.0, 3.0, 0.0, 0.0])},
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", FISHEYES)
def test_fisheyes_show_directions_where_their_lens_maps_them(kind: str) -> None:
    radius, fields = FISHEYES[kind]
    camera = Camera(np.eye(4), kind=kind, width=128, height=96, clip_start=0.0, shift=np.array([0.02, -0.03]),
                    pixel_aspect=1.25, **{"fisheye_fov": 3.8, **fields})  # fmt: skip
    for angle, turn in ((0.3, 0.7), (1.2, 2.5), (1.8, 4.0)):
        towards = np.array([
            math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), -math.cos(angle)
        ])  # fmt: skip
        a = np.cross(towards, [0.0, 1.0, 0.0])
        a /= np.linalg.norm(a)
        square = rectangle(tuple(4.0 * towards), tuple(0.1 * a), tuple(0.1 * np.cross(a, towards)), "glow")
        image = Renderer(Scene(camera, {"lamp": square}, {"glow": Material(np.zeros(3), np.ones(3))})).render(
            spp=8192, max_depth=1)  # fmt: skip
        away = 128.0 * radius(angle)
        np.testing.assert_allclose(
            centroid(image),
            camera.principal_point + [away * math.cos(turn), -away * math.sin(turn) / 1.25], atol=0.1)  # fmt: skip
        # The solid angle times r dr / (sin(angle) dangle)
        slope = (radius(angle + 1e-4) - radius(angle - 1e-4)) / 2e-4
        pixels = 128.0**2 / 1.25 * radius(angle) * slope / math.sin(angle) * (0.2 / 4.0) ** 2
        assert image[..., 0].sum() == pytest.approx(pixels, rel=0.01)


def test_fisheyes_see_a_disc() -> None:
    """The world is black outside of it, and rays there meet nothing."""
    for kind, (radius, fields) in FISHEYES.items():
        camera = Camera(np.eye(4), kind=kind, width=64, height=64, **{"fisheye_fov": 2.0, **fields})
        room = box((0, 0, 0), (2.0, 2.0, 2.0), "glow")
        glow = {"glow": Material(np.zeros(3), np.ones(3))}
        disc = 64.0 * radius(0.5 * camera.fisheye_fov)
        assert camera.disc == pytest.approx(disc)
        for scene in (Scene(camera, world=World(np.ones(3))), Scene(camera, {"room": room}, glow)):
            image = Renderer(scene).render(spp=256, max_depth=1)
            assert image[..., 0].sum() == pytest.approx(math.pi * disc**2, rel=2e-3)


def test_polynomials_that_do_not_grow_are_refused() -> None:
    for lens in ([0.0, 1.0, -2.0, 0.0, 0.0], [-0.1, 1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0, 0.0]):
        camera = Camera(np.eye(4), kind="FISHEYE_POLYNOMIAL", fisheye_polynomial=np.array(lens))
        with pytest.raises(ValueError, match="camera: fisheye_polynomial must grow"):
            camera.validate()
    # Beyond half of the field of view it may fall again.
    Camera(np.eye(4), kind="FISHEYE_POLYNOMIAL", fisheye_fov=0.4,
           fisheye_polynomial=np.array([0.0, 1.0, -1.0, 0.0, 0.0])).validate()  # fmt: skip


def test_an_aperture_blurs_to_the_circle_of_confusion() -> None:
    """A point at distance d seen through a lens of radius R focused at s spreads over a disk of radius
    R f |1/d - 1/s| pixels: its second moment is that squared over 4 per axis."""
    sharp = Camera(np.eye(4), fov_x=0.6, width=128, height=128)
    scene = lamp((0.0, 0.0, -4.0), 0.01, sharp)
    for blades, moment in ((0, 0.25), (6, 0.25 * 5.0 / 6.0)):
        scene.camera = replace(sharp, aperture_radius=0.3, focus_distance=8.0, aperture_blades=blades)
        image = np.mean([Renderer(scene).render(spp=2048, max_depth=1, seed=k) for k in range(2)], axis=0)
        y, x = np.mgrid[:128, :128] + 0.5 - 64.0
        weight = image[..., 0] / image[..., 0].sum()
        radius = 0.3 * sharp.focal * (1.0 / 4.0 - 1.0 / 8.0)
        # The lamp's own extent and the pixels add a little.
        own = (0.01 * sharp.focal / 4.0) ** 2 / 3.0 + 1.0 / 12.0
        for axis in (x, y):
            assert (weight * axis**2).sum() == pytest.approx(moment * radius**2 + own, rel=0.04)
        reach = np.hypot(x, y)[image[..., 0] > 0].max()
        assert radius * 0.8 < reach < radius + 2.0
    scene.camera = replace(sharp, aperture_radius=0.3, focus_distance=4.0)
    focused = Renderer(scene).render(spp=256, max_depth=1)
    np.testing.assert_allclose(focused.sum(), Renderer(replace(scene, camera=sharp)).render(spp=256, max_depth=1).sum(),
                               rtol=0.05)


@pytest.mark.parametrize("rotation", [0.0, 0.3])
def test_the_middle_of_a_blade_is_at_the_rotation(rotation: float) -> None:
    """A point nearer than the focus shows the aperture turned by half a turn: a triangle then has a corner where the
    lens has the side's middle, and its third moment along that direction is radius^3 / 40."""
    camera = Camera(np.eye(4), fov_x=0.6, width=128, height=128, aperture_radius=0.3, focus_distance=8.0,
                    aperture_blades=3, aperture_rotation=rotation)  # fmt: skip
    renderer = Renderer(lamp((0.0, 0.0, -4.0), 0.05, camera))
    y, x = np.mgrid[:128, :128] + 0.5 - 64.0
    radius = 0.3 * camera.focal * (1.0 / 4.0 - 1.0 / 8.0)
    along = (np.cos(rotation) * x - np.sin(rotation) * y) / radius  # rows grow downwards
    moments = []
    for seed in range(16):
        image = renderer.render(spp=384, max_depth=1, seed=seed)[..., 0]
        moments.append((image * along**3).sum() / image.sum())
    check(mean_p_value(moments, 0.025))
    assert half_width(moments) < 0.025 - 0.0155  # what it is with the rotation the wrong way round at 0.3 rad


@pytest.mark.parametrize(("kind", "width", "spread"), [
    ("BOX", 1.0, 1.0 / 12.0), ("BOX", 3.0, 0.75), ("GAUSSIAN", 2.0, None), ("BLACKMAN_HARRIS", 1.5, None)
])
def test_pixel_filters_spread_light_by_their_weight(kind: str, width: float, spread: float | None) -> None:
    """A lamp much smaller than a pixel: the mean over its positions within the pixel is the filter itself."""
    x = np.linspace(-0.5 * width, 0.5 * width, 20001)
    if kind == "GAUSSIAN":
        weight = np.exp(-2.0 * (6.0 * x / width) ** 2)
    elif kind == "BLACKMAN_HARRIS":
        v = 2.0 * np.pi * (x / width + 0.5)
        weight = 0.35875 - 0.48829 * np.cos(v) + 0.14128 * np.cos(2 * v) - 0.01168 * np.cos(3 * v)
    else:
        weight = np.ones_like(x)
    expected = float((weight * x**2).sum() / weight.sum())
    assert spread is None or expected == pytest.approx(spread, rel=1e-3)
    camera = Camera(np.eye(4), kind="ORTHOGRAPHIC", ortho_width=16.0, width=16, height=16, filter=kind,
                    filter_width=width)
    # A lamp that covers one pixel: each pixel sees the share of its filter that reaches over it.
    image = Renderer(lamp((0.5, 0.5, -1.0), 0.5, camera)).render(spp=8192, max_depth=1)[..., 0].astype(np.float64)
    share = [weight[np.abs(x - k) <= 0.5].sum() / weight.sum() for k in range(-2, 3)]
    np.testing.assert_allclose(image.sum(axis=0)[6:11], share, atol=4e-3)
    np.testing.assert_allclose(image.sum(axis=1)[5:10], share, atol=4e-3)
    assert image.sum() == pytest.approx(1.0, rel=5e-3)


def test_a_world_is_the_same_through_any_lens() -> None:
    world = World(np.array([0.2, 0.5, 0.9]))
    for camera in (
        Camera(np.eye(4), width=8, height=8, aperture_radius=0.5, aperture_blades=5, aperture_ratio=2.0),
        Camera(np.eye(4), width=8, height=8, kind="ORTHOGRAPHIC"),
        Camera(np.eye(4), width=8, height=8, kind="EQUIRECTANGULAR", filter="GAUSSIAN", filter_width=2.0),
    ):
        image = Renderer(Scene(camera, world=world)).render(spp=4)
        np.testing.assert_allclose(image.reshape(-1, 3), np.tile([0.2, 0.5, 0.9], (64, 1)), rtol=1e-5)

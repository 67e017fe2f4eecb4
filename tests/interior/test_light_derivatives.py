"""Derivatives with respect to every field of every kind of light, on a convex body, which has no shadows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from edgegrad import AreaLight, Material, PointLight, Renderer, Scene, SpotLight, SunLight
from edgegrad.scene.light import Light
from tests.support import shapes
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.picture_differences import need_every_table, sums_of_differences
from tests.support.rich_scene import pose, turn
from tests.support.small_scenes import Floats

AT, ALONG = np.array([1.5, -3.0, 2.0]), np.array([-0.5, 1.0, -0.7])
POSE, SIZE = pose(turn(0.9, 0.3, 0.1), 1.0, -2.5, 2.5), np.array([1.0, 0.7])

LIGHTS: dict[str, tuple[Callable[[], Light], str]] = {
    "point": (lambda: PointLight(AT, 300.0), "position power color"),
    "sphere": (lambda: PointLight(AT, 300.0, 0.5, True), "position power color radius"),
    "disk": (lambda: PointLight(AT, 300.0, 0.5), "position power color radius"),
    "spot": (lambda: SpotLight(AT, ALONG, 300.0, 0.5, 0.6), "position direction power color angle blend"),
    "linear spot": (lambda: SpotLight(AT, ALONG, 300.0, 0.5, 0.6, falloff="LINEAR"), "position direction angle blend"),
    "soft spot": (lambda: SpotLight(AT, ALONG, 300.0, 0.5, 0.6, 0.3), "position direction angle blend radius"),
    "sun": (lambda: SunLight(ALONG, 3.0), "direction strength color"),
    "sun's disk": (lambda: SunLight(ALONG, 3.0, 0.4), "direction strength angle"),
    "rectangle": (lambda: AreaLight(POSE, SIZE, "RECTANGLE", 100.0), "to_world size power color"),
    "spread": (lambda: AreaLight(POSE, SIZE, "RECTANGLE", 100.0, 1.5), "to_world size power spread"),
    "ellipse": (lambda: AreaLight(POSE, SIZE, "ELLIPSE", 100.0, 1.5), "to_world size power spread"),
    "point of linear decay": (lambda: PointLight(AT, 90.0, decay="LINEAR", smooth=4.0), "position power smooth"),
    "sphere of constant decay": (lambda: PointLight(AT, 30.0, 0.5, True, decay="CONSTANT"), "position radius"),
    "disk that is dim close by": (lambda: PointLight(AT, 300.0, 0.5, smooth=9.0), "position radius smooth"),
    "spot of linear decay": (lambda: SpotLight(AT, ALONG, 90.0, 0.5, 0.6, decay="LINEAR"), "position direction angle"),
    "stretched spot": (lambda: SpotLight(AT, ALONG, 300.0, 0.4, 0.6, stretch=np.array([1.6, 0.7])),
                       "position direction power angle blend stretch across"),
    "rectangle of constant decay": (lambda: AreaLight(POSE, SIZE, "RECTANGLE", 10.0, decay="CONSTANT"),
                                    "to_world size power"),
}


def ball(light: Light) -> Scene:
    scene = shapes.scene(*shapes.ball(2))
    scene.camera.width, scene.camera.height = 16, 12
    scene.materials["clay"] = Material(np.array([0.5, 0.2, 0.4]), specular_ior_level=0.4, roughness=0.6)
    scene.lights = {"light": light}
    return scene


@pytest.mark.parametrize(("kind", "field"), [(kind, f) for kind, (_, names) in LIGHTS.items() for f in names.split()])
def test_pictures_change_as_their_derivatives_say(kind: str, field: str) -> None:
    need_every_table()
    light = LIGHTS[kind][0]()
    value = np.asarray(getattr(light, field), np.float64)
    rng = np.random.default_rng(3)
    direction = rng.uniform(0.2, 1.0, value.shape) * (np.abs(value) + 0.05) * rng.choice([-1.0, 1.0], value.shape)
    curve = None
    if field == "to_world":  # rigid, so that its tangents are those of rigid motions
        turned, moved = direction[0, :3], direction[:3, 3]

        def curve(by: float) -> Floats:
            return pose(turn(*(by * turned)) @ value[:3, :3], *(value[:3, 3] + by * moved))

        direction = (curve(1e-5) - curve(-1e-5)) / 2e-5
    found, exact = sums_of_differences(ball(light), f"lights.light.{field}", direction, 0.01, curve=curve)
    # The error of a central difference is of second order in the step.
    check(mean_p_value(found - exact, 0.0, rounding=1e-3 * abs(found.mean())))
    # Light hardly changes with the size of what gives it: that derivative may be zero.
    assert half_width(found - exact) < 0.5 * abs(exact.mean()) or field in ("radius", "angle", "size")


@pytest.mark.parametrize("field", ["position", "radius"])
def test_spheres_are_as_sure_as_disks(field: str) -> None:
    """No sample of a sphere is divided by the cosine at its edge: the variance of both is alike."""
    need_every_table()
    variance = []
    for sphere in (True, False):
        scene = ball(PointLight(AT, 300.0, 0.5, sphere))
        tangent = {f"lights.light.{field}": np.full(np.shape(getattr(scene.lights["light"], field)), 0.5)}
        renderer = Renderer(scene, engine="native")
        pictures = [renderer.render_forward(tangent, spp=64, max_depth=2, seed=k, terms=("interior",))
                    for k in range(24)]
        variance.append(float(np.var(np.array(pictures, np.float64), axis=0, ddof=1).sum()))
    # The sum of the variances of 192 pixels, of 24 pictures each, is known far better than to a factor of two.
    assert 0.5 < variance[0] / variance[1] < 2.0

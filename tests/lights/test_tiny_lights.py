"""Lights far smaller than their distance light as a point does, however small they are."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import glowing, matte, pixel_at, rectangle


def lit_by_area_light(size: float, shape: str) -> float:
    """Radiance of a floor under an area light of that size, of a fixed power, that faces it."""
    pose = np.eye(4)
    pose[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # shines down: its -Z is -Y
    pose[:3, 3] = (0.3, 2.0, 0.1)
    scene = edgegrad.Scene(
        pixel_at((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), {"floor": rectangle((0, 0, 0), (0, 0, 1), (1, 0, 0), "clay")},
        {"clay": matte()}, {"lamp": edgegrad.AreaLight(pose, np.array([size, size]), shape, 10.0)},
    )
    return float(edgegrad.render(scene, spp=16).mean())


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
@pytest.mark.parametrize("size", [1e-5, 1e-9])
def test_small_area_lights_of_equal_power_give_equal_light(size: float, shape: str) -> None:
    need_every_table()
    assert lit_by_area_light(size, shape) == pytest.approx(lit_by_area_light(1e-3, shape), rel=1e-3)


@pytest.mark.parametrize("size", [1e-2, 1e-3, 1e-4, 1e-5])
def test_light_of_small_emissive_faces_is_in_proportion_to_their_area(size: float) -> None:
    need_every_table()

    def light(size: float) -> float:
        lamp = rectangle((0.3, 2.0, 0.1), (0.5 * size, 0, 0), (0, 0, 0.5 * size), "lamp")
        scene = edgegrad.Scene(
            pixel_at((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),
            {"floor": rectangle((0, 0, 0), (0, 0, 1), (1, 0, 0), "clay"), "lamp": lamp},
            {"clay": matte(), "lamp": glowing(1.0 / size**2, True)},
        )
        return float(edgegrad.render(scene, spp=16).mean())

    # The radiance of the floor is albedo / pi * E, E that of a point of intensity cos at the lamp's place.
    place = np.array([0.3, 2.0, 0.1])
    r2 = place @ place
    expected = 0.5 / np.pi * (place[1] ** 2 / r2) / r2
    assert light(size) == pytest.approx(expected, rel=0.05)  # corners are rounded to 2^-24 of their place

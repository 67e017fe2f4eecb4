"""Lights of every shape in the view of cameras of every kind, and sheets that pass through them."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np

import edgegrad
from edgegrad._check import RAYS
from tests.support.rich_scene import pose, turn
from tests.support.small_scenes import camera, matte, rectangle

PLACE = np.array([0.2, 0.1, 0.3])
FACING = pose(turn(0.3, 0.4, 0.2) @ np.diag([1.0, -1.0, -1.0]), *PLACE.tolist())  # shines along -Z: at the camera
LIGHTS: dict[str, edgegrad.PointLight | edgegrad.SpotLight | edgegrad.AreaLight | edgegrad.SunLight] = {
    "sphere": edgegrad.PointLight(PLACE, 60.0, 0.5, True),
    "disk": edgegrad.PointLight(PLACE, 60.0, 0.5, False),
    "spot": edgegrad.SpotLight(PLACE, np.array([-0.1, 0.2, 1.0]), 60.0, 1.2, 0.8, 0.5),
    "rectangle": edgegrad.AreaLight(FACING, np.array([0.9, 0.6]), "RECTANGLE", 30.0),
    "ellipse": edgegrad.AreaLight(FACING, np.array([0.9, 0.6]), "ELLIPSE", 30.0),
    "sun": edgegrad.SunLight(np.array([0.0, 0.15, 1.0]), 0.5, 0.4),
    # One so small and far away that rounding to single precision matters, and a disk so near that the direction in
    # which it faces changes much from ray to ray.
    "small sun": edgegrad.SunLight(np.array([0.02, 0.015, 1.0]), 1e-4, 0.002),
    "wide disk": edgegrad.PointLight(np.array([0.2, 0.1, 1.4]), 60.0, 1.0, False),
}
VIEW = camera((0.2, 0.3, 2.5), (0, 0, 0), 24, 0.9)
VIEWS = {
    "perspective": VIEW,
    "lens": replace(VIEW, aperture_radius=0.1, focus_distance=2.0),
    "orthographic": replace(VIEW, kind="ORTHOGRAPHIC", ortho_width=2.2),
    "panorama": replace(VIEW, kind="EQUIRECTANGULAR", width=48),
    "wide filter": replace(VIEW, filter="BLACKMAN_HARRIS", filter_width=3.0),
    "telescope": camera((2000.0, 3000.0, 25000.0), (1500.0, 2625.0, 0.0), 24, 0.004),
    "high": replace(VIEW, kind="ORTHOGRAPHIC", ortho_width=3.0),
}
FAR = ("small sun", "telescope"), ("wide disk", "high")


# Parallel rays see all of a sun, or nothing.
PAIRS = [*FAR, *((light, view) for light in list(LIGHTS)[:6] for view in list(VIEWS)[:5]
                 if (light, view) != ("sun", "orthographic"))]

PIERCED = ("sphere", "disk", "spot", "rectangle", "ellipse")


def sheet_through(light: str, view: str, alpha: float = 1.0) -> edgegrad.Scene:
    """A light that a black sheet passes through."""
    return edgegrad.Scene(
        deepcopy(VIEWS[view]), {"sheet": rectangle((0.25, 0.1, 0.45), (0.5, 0.1, 0.4), (0.0, 0.9, 0.3), "black")},
        {"black": replace(matte(0.0, 0.0, 0.0), alpha=alpha)},
        {"lamp": replace(LIGHTS[light], visible_to=frozenset(RAYS))},
    )

"""Features of cameras and of what they see: panoramas, shifted lenses, shapes of apertures, parts of pictures.

Each function changes the scene of a comparison and returns paths that may be requested instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from edgegrad.scene.camera import FISHEYES
from tests.support.rich_scene import pose, turn
from tests.torture.drawing.draw import Draw
from tests.torture.tame import Comparison

Feature = Callable[[Draw, Comparison], Sequence[str] | None]


def _panorama(draw: Draw, made: Comparison) -> Sequence[str]:
    """An equirectangular camera near the body, which is anywhere in its picture: at its seam and at its poles, too."""
    old = made.scene.camera
    aim = old.to_world[:3, :3] @ turn(*draw.rng.normal(scale=1.5, size=3))
    place = 0.45 * old.to_world[:3, 3] + [0.0, 0.0, 0.3]
    made.scene.camera = replace(old, kind="EQUIRECTANGULAR", to_world=pose(aim, *place), width=24)
    if draw.chance(0.3):
        made.scene.camera.longitude = np.array([-2.0, 1.5])
        made.scene.camera.latitude = np.array([-1.2, 1.4])
        return "camera.longitude", "camera.latitude", "camera.to_world"
    return ("camera.to_world",)


def _fisheye(draw: Draw, made: Comparison) -> Sequence[str]:
    """A fisheye near the body, which the border of what it sees may cut."""
    old = made.scene.camera
    aim = old.to_world[:3, :3] @ turn(*draw.rng.normal(scale=0.5, size=3))
    place = 0.45 * old.to_world[:3, 3] + [0.0, 0.0, 0.3]
    kind = draw.one(FISHEYES)
    made.scene.camera = replace(
        old, kind=kind, to_world=pose(aim, *place), fisheye_fov=draw.uniform(1.5, 6.0),
        fisheye_lens=draw.uniform(0.3, 0.6), fisheye_polynomial=np.array([0.0, draw.uniform(1.5, 3.5), 0.3, -0.2, 0.1]),
    )  # fmt: skip
    # The border itself is no edge: it must not move
    return ("camera.fisheye_fov", "camera.to_world") if kind == "FISHEYE_EQUIDISTANT" else ("camera.to_world",)


def _frame(draw: Draw, made: Comparison) -> Sequence[str]:
    """A shifted lens, pixels that are not square, or a picture whose border cuts what it shows."""
    made.scene.camera.shift = draw.rng.uniform(-0.2, 0.2, 2)
    made.scene.camera.pixel_aspect = draw.one((0.7, 1.0, 1.6))
    if draw.chance(0.5):
        made.scene.camera.fov_x, made.scene.camera.ortho_width = 0.3, 1.5
    width = "camera.ortho_width" if made.scene.camera.kind == "ORTHOGRAPHIC" else "camera.fov_x"
    return "camera.shift", "camera.pixel_aspect", width


def _aperture(draw: Draw, made: Comparison) -> Sequence[str]:
    lens: dict[str, Any] = {
        "aperture_radius": 0.2,
        "focus_distance": draw.uniform(3.0, 7.0),
        "aperture_blades": draw.one((0, 3, 6)),
        "aperture_ratio": draw.one((1.0, 2.0)),
        "aperture_rotation": draw.uniform(0.0, 2.0),
    }
    made.scene.camera = replace(made.scene.camera, **lens)
    return "camera.aperture_radius", "camera.focus_distance", "camera.aperture_rotation", "camera.aperture_ratio"


def _crop(draw: Draw, made: Comparison) -> None:
    made.scene.camera = replace(made.scene.camera, width=24, height=24, crop=(5, 7, 17, 19))


def _world_for_some(draw: Draw, made: Comparison) -> Sequence[str]:
    made.scene.world.visible_to = frozenset(
        draw.one((("camera",), ("diffuse", "glossy"), ("glossy", "transmission", "camera")))
    )
    return ("world.strength",)


def _few_bounces(draw: Draw, made: Comparison) -> None:
    made.bounces = replace(made.bounces, ambient=draw.one((1, 2)), transparent=draw.one((0, 1, 3)))


FEATURES: dict[str, Feature] = {
    "panorama": _panorama,
    "fisheye": _fisheye,
    "frame": _frame,
    "aperture": _aperture,
    "crop": _crop,
    "world for some rays": _world_for_some,
    "ambient": _few_bounces,
}

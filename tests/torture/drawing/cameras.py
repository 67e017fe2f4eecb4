"""Cameras of every projection, with lenses, crops, filters and shifts, and worlds with and without an image."""

from __future__ import annotations

from typing import Any

import numpy as np

from edgegrad import Camera, World
from edgegrad.scene.camera import FILTERS, FISHEYES, PANORAMAS
from tests.support.rich_scene import pose, turn
from tests.torture.drawing.draw import Draw


def camera(draw: Draw, scale: float) -> Camera:
    """A camera that looks at the origin of a world of the size `scale`; now and then from its midst, or away."""
    aim = turn(0.0, 0.0, draw.uniform(-np.pi, np.pi)) @ turn(draw.uniform(0.2, 1.7), 0.0, 0.0)
    distance = draw.one((0.0, 1.0, 4.0, 4.0, 4.0, 4.0, 50.0))
    eye = aim @ [0.0, 0.0, distance] + draw.rng.normal(scale=0.1, size=3)
    width, height = draw.whole(6, 12), draw.whole(6, 12)
    extras: dict[str, Any] = {}
    kind = draw.one(("PERSPECTIVE",) * 4 + ("ORTHOGRAPHIC", draw.one(PANORAMAS)))
    if kind in FISHEYES:
        curve = draw.uniform(0.5, 6.0) * np.array([draw.one((0.0, 0.01)), 1.0, 0.1, -0.1, 0.1])
        extras |= {"fisheye_fov": draw.one((1e-3, 1.0, 3.0, 2.0 * np.pi)), "fisheye_lens": draw.one((0.01, 0.3, 4.0)),
                   "fisheye_polynomial": curve}
    if kind == "EQUIRECTANGULAR" and draw.chance(0.5):
        start = draw.uniform(-3.0, 0.0)
        extras |= {"longitude": np.array([start, start + draw.uniform(0.1, 6.0)]), "latitude": np.array([-0.7, 1.2])}
    if draw.chance(0.3):
        extras |= {
            "aperture_radius": scale * draw.one((1e-6, 0.01, 0.3, 3.0)), "focus_distance": scale * draw.log(0.1, 100.0),
            "aperture_blades": draw.one((0, 3, 6, 64)), "aperture_rotation": draw.uniform(-3.0, 3.0),
            "aperture_ratio": draw.one((1.0, 0.2, 2.0)),
        }  # fmt: skip
    if draw.chance(0.2):
        x, y = draw.whole(0, width - 2), draw.whole(0, height - 2)
        extras["crop"] = (x, y, draw.whole(x + 1, width), draw.whole(y + 1, height))
    if draw.chance(0.3):
        extras |= {"filter": draw.one(FILTERS), "filter_width": draw.one((0.01, 1.0, 1.5, 4.0))}
    if draw.chance(0.2):
        extras |= {"shift": draw.rng.normal(scale=0.5, size=2), "pixel_aspect": draw.one((0.1, 0.9, 2.0))}
    if draw.chance(0.1):
        extras |= {"clip_start": scale * 2.0, "clip_end": scale * 6.0}
    ends = {"clip_start": 1e-4 * scale, "clip_end": 1e6 * scale}
    return Camera(
        pose(aim, *(scale * eye)), draw.one((0.4, 0.7, 0.7, 0.7, 1e-3, 3.0)), width, height, kind=kind,
        ortho_width=scale * draw.one((0.1, 3.0, 3.0, 30.0)), **(ends | extras),
    )  # fmt: skip


def world(draw: Draw, has_image: bool) -> World:
    """The environment; black ones too, with or without an image."""
    color = draw.one((0.0, 0.3, 1.0)) * (np.ones(3) if draw.chance(0.5) else draw.color())
    return World(color, draw.one((1.0, 1.0, 0.0, 1e-3, 50.0)), "sky" if has_image else None, draw.rotation(),
                 draw.rays(0.1) - {"shadow"})  # fmt: skip

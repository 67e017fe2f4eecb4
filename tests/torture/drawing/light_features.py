"""Features of lights: stretched and negative ones, and some that surfaces pass through; what bounces do to gloss.

Each function changes the scene of a comparison and returns paths that may be requested instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from edgegrad import AreaLight, PointLight, SpotLight, SunLight
from tests.support.rich_scene import pose, turn
from tests.torture.drawing.draw import Draw
from tests.torture.drawing.surface_features import body_material, change, put
from tests.torture.tame import Comparison

Feature = Callable[[Draw, Comparison], Sequence[str] | None]


def _stretched_spot(draw: Draw, made: Comparison) -> Sequence[str]:
    place = draw.rng.uniform((-1.0, -2.5, 2.0), (1.0, -1.5, 3.0))
    spot = SpotLight(
        place, -place + [0.0, 0.0, 0.5], 150.0, draw.uniform(0.5, 1.2), draw.uniform(0.1, 0.9), draw.one((0.0, 0.2)),
        stretch=draw.rng.uniform(0.5, 1.5, 2), across=turn(0.4, 0.2, 1.0)[:, 0],
    )  # fmt: skip
    put(made, "lights", "spot", spot)
    return "lights.spot.angle", "lights.spot.blend", "lights.spot.stretch", "lights.spot.position"


def _negative_lamp(draw: Draw, made: Comparison) -> Sequence[str]:
    """A lamp that takes away some of the light of another."""
    lamp = draw.one(
        (
            PointLight(np.array([-1.0, 1.0, 2.5]), -20.0, 0.3),
            SunLight(np.array([0.5, -0.3, -1.0]), -0.3, 0.2),
            AreaLight(pose(turn(0.3, 0.3, 0.0), -0.5, -0.5, 2.5), np.array([0.8, 0.5]), "ELLIPSE", -20.0),
        )
    )
    put(made, "lights", "negative", lamp)
    field = "strength" if isinstance(lamp, SunLight) else "power"
    return (f"lights.negative.{field}",)


def _pierced_lamp(draw: Draw, made: Comparison) -> Sequence[str]:
    """A lamp of finite size that the floor or the body cuts."""
    height = draw.uniform(-0.1, 0.5)
    lamp = draw.one(
        (
            PointLight(np.array([1.3, -0.9, height]), 30.0, 0.4, True),
            AreaLight(pose(turn(1.2, 0.5, 0.0), 1.3, -0.9, height), np.array([0.7, 0.9]), "RECTANGLE", 30.0),
            AreaLight(pose(turn(1.2, 0.5, 0.0), 1.3, -0.9, height), np.array([0.7, 0.9]), "ELLIPSE", 30.0, spread=1.5),
        )
    )
    put(made, "lights", "pierced", lamp)
    return ("lights.pierced.position" if isinstance(lamp, PointLight) else "lights.pierced.to_world",)


def _thin_film(draw: Draw, made: Comparison) -> Sequence[str]:
    name = body_material(made)
    change(made, name, thin_film_thickness=draw.uniform(150.0, 700.0), thin_film_ior=1.5)
    return f"materials.{name}.thin_film_thickness", f"materials.{name}.thin_film_ior"


def _filter_glossy(draw: Draw, made: Comparison) -> None:
    made.bounces = replace(made.bounces, filter_glossy=draw.one((0.3, 1.0, 3.0)))


FEATURES: dict[str, Feature] = {
    "stretched spot": _stretched_spot,
    "negative lamp": _negative_lamp,
    "pierced lamp": _pierced_lamp,
    "thin film": _thin_film,
    "filtered gloss": _filter_glossy,
}

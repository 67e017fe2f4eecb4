"""Lights of every kind, from no size to one larger than the scene, linked to some meshes or to all."""

from __future__ import annotations

from typing import Any

import numpy as np

from edgegrad import AreaLight, PointLight, SpotLight, SunLight
from edgegrad.scene.light import FALLOFFS, SHAPES, Light
from tests.torture.drawing.draw import F64, Draw

# In sizes of the scene.
SIZES = (0.0, 0.0, 1e-6, 1e-3, 0.2, 0.2, 1.0, 30.0)
ANGLES = (0.0, 1e-6, 1e-3, 0.01, 0.3, 1.5, np.pi)


def light(draw: Draw, scale: float, meshes: tuple[str, ...]) -> Light:
    """Any light in a world of the size `scale` about the origin."""
    at = scale * (draw.rng.normal(size=3) + [0.0, 0.0, 2.0])
    power = draw.one((0.0, 1.0, 1.0, 1.0)) * scale**2 * draw.log(1.0, 300.0)
    shared: dict[str, Any] = {
        "color": draw.color(), "visible_to": draw.rays(0.7) - {"shadow"}, "casts_shadow": draw.chance(0.85),
        "max_bounces": draw.one((None, None, None, 0, 1, 4)),
        "receivers": _some(draw, meshes), "blockers": _some(draw, meshes),
    }  # fmt: skip
    round_light: dict[str, Any] = {"radius": scale * draw.one(SIZES), "sphere": draw.chance(0.5)}
    kind = draw.one(("point", "point", "spot", "sun", "area", "area"))
    if kind == "point":
        return PointLight(at, power, **round_light, **shared)
    if kind == "spot":
        aim = draw.direction() if draw.chance(0.3) else -at / scale
        if draw.chance(0.2):  # an elliptic cone
            return SpotLight(at, aim, power, min(max(draw.one(ANGLES), 1e-4), 3.1), max(draw.share(), 1e-3),
                             stretch=np.array([draw.log(0.01, 100.0), draw.log(0.01, 100.0)]),
                             across=_across(draw, aim), **round_light, **shared)  # fmt: skip
        return SpotLight(at, aim, power, max(draw.one(ANGLES), 1e-4), draw.share(), falloff=draw.one(FALLOFFS),
                         **round_light, **shared)  # fmt: skip
    if kind == "sun":
        return SunLight(draw.direction(), draw.one((0.0, 1.0, 30.0)), draw.one(ANGLES), **shared)
    size = scale * np.array([max(draw.one(SIZES), 1e-6) for _ in range(2)])
    return AreaLight(draw.pose(at), size, draw.one(SHAPES), power, max(draw.one(ANGLES), 1e-3), **shared)


def _across(draw: Draw, aim: F64) -> F64:
    """A direction across `aim`. Two draws may lie along the same axis: the next axis then serves."""
    other = draw.direction()
    found = np.cross(aim, other)
    return found if found.any() else np.cross(aim, np.roll(other, 1))


def _some(draw: Draw, meshes: tuple[str, ...]) -> tuple[str, ...] | None:
    return tuple(name for name in meshes if draw.chance(0.5)) if draw.chance(0.15) else None

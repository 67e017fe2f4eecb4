"""The table of lights that are not meshes; native/scene/lights/light_params.h has the same layout.

A row is an analytic function of the numbers of a light: complex numbers give complex rows (`jacobian`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import derived
from ..scene.light import AreaLight, Light, PointLight, SpotLight, SunLight
from ..scene.scene import Scene
from .geometry import link_sets, ray_bits

# Kinds of lights, as the native LightKind; its kind 0, emissive triangles, has no rows here.
POINT, SPHERE, DISK, RECTANGLE, ELLIPSE, DIRECTION, CONE = range(1, 8)
# Bits of `flags`.
SMOOTH_CONE, LINEAR_CONE, SPREAD, CASTS_SHADOW, DECAYS, BY_WAY, BY_WAY2, STRETCHED = (1 << k for k in range(8))
ANY_BOUNCES = 1 << 30
_BY_DECAY = {"QUADRATIC": 0, "LINEAR": BY_WAY, "CONSTANT": BY_WAY2}

# Positions of the fields in a row.
RADIANCE = slice(0, 3)
POSITION = slice(3, 6)
AXIS_X = slice(6, 9)
AXIS_Y = slice(9, 12)
SHINES_TO = slice(12, 15)
EXTENT_X, EXTENT_Y, RADIUS, AREA, ONE_MINUS_COS, EDGE, EDGE_SCALE, SMOOTH = range(15, 23)
WIDTH = 24

# Scale of an edge that is a step. The edge of a spot light is a step if `blend` is less than LEAST_BLEND.
_STEP = 1e12
LEAST_BLEND = 1e-3
# Smaller sizes count as 0, since their solid angles and areas would vanish in float32.
_LEAST_SUN_ANGLE = 1e-5
_LEAST_RADIUS = 1e-6


@dataclass
class LightTable:
    """All point, spot, sun and area lights of a scene, in the order of the scene; L rows.

    Attributes
    ----------
    params
        (L, WIDTH) float32, the fields of each light at the positions above; world positions are relative to the
        origin of the tables.
    kind, flags
        (L,) int32.
    visible_to
        (L,) int32 bits 1 << index in `RAYS` of the kinds of rays that see the light.
    receivers, blockers
        (L,) int32 index of the set of meshes that the light illuminates, or that cast its shadow
        (`geometry.link_sets`); -1: all meshes.
    max_bounces
        (L,) int32 limit of the bounces of a path before the surface; `ANY_BOUNCES`: no limit.
    row_of
        Name of a light -> row.
    """

    params: NDArray[np.float32]
    kind: NDArray[np.int32]
    flags: NDArray[np.int32]
    visible_to: NDArray[np.int32]
    receivers: NDArray[np.int32]
    blockers: NDArray[np.int32]
    max_bounces: NDArray[np.int32]
    row_of: Mapping[str, int]


def light_table(scene: Scene, origin: NDArray[np.float64]) -> LightTable:
    """Make the table of the lights of a validated scene; positions are relative to `origin` (3,)."""
    lights = list(scene.lights.values())
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # reported below
        rows = [_kind_flags_row(light, origin) for light in lights]
    for name, (_, _, row) in zip(scene.lights, rows, strict=True):
        derived(f"light '{name}'", "the radiance that its strength, color and size make", row)
    return LightTable(
        params=np.array([row for _, _, row in rows], np.float32).reshape(-1, WIDTH),
        kind=np.array([kind for kind, _, _ in rows], np.int32),
        flags=np.array([flags | (CASTS_SHADOW if light.casts_shadow else 0)
                        for (_, flags, _), light in zip(rows, lights, strict=True)], np.int32),
        visible_to=np.array([ray_bits(light.visible_to) for light in lights], np.int32),
        receivers=_sets(scene, "receivers"),
        blockers=_sets(scene, "blockers"),
        max_bounces=np.array([ANY_BOUNCES if light.max_bounces is None else light.max_bounces for light in lights],
                             np.int32),
        row_of={name: row for row, name in enumerate(scene.lights)},
    )


def _sets(scene: Scene, field: str) -> NDArray[np.int32]:
    """Index of the set of meshes of each light; -1: it has none."""
    number = {names: k for k, names in enumerate(link_sets(scene, field))}
    named = [getattr(light, field) for light in scene.lights.values()]
    return np.array([-1 if names is None else number[tuple(sorted(names))] for names in named], np.int32)


def light_row(light: Light, origin: NDArray[np.float64]) -> NDArray[Any]:
    """(WIDTH,) row of a light; its position is relative to `origin` (3,)."""
    return _kind_flags_row(light, origin)[2]


def _kind_flags_row(light: Light, origin: NDArray[np.float64]) -> tuple[int, int, NDArray[Any]]:
    numbers = [value for f in fields(light) if _is_complex(value := getattr(light, f.name))]
    row = np.zeros(WIDTH, np.complex128 if numbers else np.float64)
    row[ONE_MINUS_COS] = 2.0
    if isinstance(light, SunLight):
        return _sun(light, row), 0, row
    kind, flags = _area(light, origin, row) if isinstance(light, AreaLight) else _point(light, origin, row)
    return kind, flags | _decay(light, row), row


def _is_complex(value: Any) -> bool:
    return isinstance(value, (complex, np.ndarray)) and np.iscomplexobj(value)


def _unit(vector: NDArray[Any]) -> NDArray[Any]:
    # `np.linalg.norm` takes absolute values, which are not analytic.
    return np.asarray(vector / np.sqrt(np.sum(vector * vector)))


def _point(light: PointLight | SpotLight, origin: NDArray[np.float64], row: NDArray[Any]) -> tuple[int, int]:
    intensity = light.power * light.color / (4.0 * np.pi)
    row[POSITION] = light.position - origin
    flags = 0
    if isinstance(light, SpotLight):
        row[SHINES_TO] = _unit(light.direction)
        half = 0.5 * light.angle
        row[ONE_MINUS_COS] = 2.0 * np.sin(0.5 * half) ** 2
        linear = light.falloff == "LINEAR"
        flags = LINEAR_CONE if linear else SMOOTH_CONE
        row[EDGE] = half if linear else row[ONE_MINUS_COS]
        width = row[EDGE] * light.blend
        step = light.blend.real < LEAST_BLEND or width.real <= 1.0 / _STEP
        row[EDGE_SCALE] = _STEP if step else 1.0 / width
        if light.stretch is not None:
            flags |= STRETCHED
            _stretch(light, row)
    if light.radius.real < _LEAST_RADIUS:
        row[RADIANCE] = intensity
        return POINT, flags
    row[RADIUS] = light.radius
    # A sphere of radiance L has the intensity pi r^2 L in every direction. So has a disk that faces the receiver.
    row[RADIANCE] = intensity / (np.pi * light.radius**2)
    return (SPHERE if light.sphere else DISK), flags


def _decay(light: PointLight | SpotLight | AreaLight, row: NDArray[Any]) -> int:
    row[SMOOTH] = light.smooth
    by = _BY_DECAY[light.decay]
    return DECAYS | by if by or light.smooth.real > 0.0 else 0


def _stretch(light: SpotLight, row: NDArray[Any]) -> None:
    assert light.stretch is not None
    axis = row[SHINES_TO]
    row[AXIS_X] = _unit(light.across - axis * (axis @ light.across))
    row[AXIS_Y] = np.cross(axis, row[AXIS_X])
    row[EXTENT_X], row[EXTENT_Y] = 1.0 / light.stretch
    # Borders of light that jumps are computed for round cones alone, so this one is always soft.
    row[EDGE_SCALE] = 1.0 / (row[EDGE] * max(light.blend, LEAST_BLEND, key=lambda blend: blend.real))
    half = 0.5 * light.angle
    widest = max((half, *np.arctan(np.tan(half) * light.stretch)), key=lambda angle: angle.real)
    row[ONE_MINUS_COS] = 2.0 * np.sin(0.5 * widest) ** 2


def _sun(light: SunLight, row: NDArray[Any]) -> int:
    row[SHINES_TO] = _unit(light.direction)
    irradiance = light.strength * light.color
    half = 0.5 * light.angle
    if light.angle.real < _LEAST_SUN_ANGLE:
        row[RADIANCE] = irradiance
        row[ONE_MINUS_COS] = 0.0
        return DIRECTION
    # The integral of the cosine over the cone is pi sin^2 of its half angle.
    row[RADIANCE] = irradiance / (np.pi * np.sin(half) ** 2)
    row[ONE_MINUS_COS] = 2.0 * np.sin(0.5 * half) ** 2
    row[AREA] = 2.0 * np.pi * row[ONE_MINUS_COS]
    return CONE


def _area(light: AreaLight, origin: NDArray[np.float64], row: NDArray[Any]) -> tuple[int, int]:
    rectangle = light.shape == "RECTANGLE"
    area = light.size[0] * light.size[1] * (1.0 if rectangle else 0.25 * np.pi)
    row[RADIANCE] = light.power * light.color / (np.pi * area)
    row[POSITION] = light.to_world[:3, 3] - origin
    row[AXIS_X], row[AXIS_Y], row[SHINES_TO] = light.to_world[:3, 0], light.to_world[:3, 1], -light.to_world[:3, 2]
    row[EXTENT_X], row[EXTENT_Y] = 0.5 * light.size
    row[AREA] = area
    flags = 0
    if light.spread.real < np.pi:
        # The grid of a soft box transmits the fraction 1 - tan(t)/tan(s) at the angle t, where s is half the spread.
        # The scale keeps the power: 2 int_0^s cos t sin t (1 - tan t / tan s) dt = 1 - s / tan s.
        half = 0.5 * light.spread
        flags = SPREAD
        row[EDGE] = np.tan(half)
        row[EDGE_SCALE] = 1.0 / (row[EDGE] - half) if half.real > 0.01 else 3.0 / half**3
    return (RECTANGLE if rectangle else ELLIPSE), flags

"""Point, spot, sun and area lights, in Blender's units. Emissive meshes are materials, not lights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import LARGEST_LENGTH, array, choice, flag, names, number, orthonormal, rays, whole
from .._fields import Check, Checked, by, optional

SHAPES = ("RECTANGLE", "ELLIPSE")
FALLOFFS = ("SMOOTH", "LINEAR")
DECAYS = ("QUADRATIC", "LINEAR", "CONSTANT")
# Blender's default: camera rays do not see lights, all other rays do.
_SEEN = frozenset(("diffuse", "glossy", "transmission", "shadow"))


def _white() -> NDArray[np.float64]:
    return np.ones(3)


@dataclass(kw_only=True)
class _Light(Checked):
    """Fields of all lights.

    Attributes
    ----------
    color
        (3,) linear Rec.709, >= 0.
    visible_to
        Kinds of rays that see the light: a subset of "camera", "diffuse", "glossy", "transmission". The light
        illuminates a surface only through closures of these kinds. Only a light with a size can be hit by
        rays.
    casts_shadow
        False: no object blocks its light.
    max_bounces
        The light illuminates surfaces that a path meets after at most so many bounces, transparent surfaces not
        counted (Cycles' Max Bounces of a light). 0: only what the camera sees; None: all.
    receivers, blockers
        Names of the meshes that the light illuminates, and of the meshes that block its light (Blender's light
        linking and shadow linking); None: all meshes.
    """

    color: NDArray[np.float64] = field(default_factory=_white)
    visible_to: frozenset[str] = _SEEN
    casts_shadow: bool = True
    max_bounces: int | None = None
    receivers: tuple[str, ...] | None = None
    blockers: tuple[str, ...] | None = None

    checks: ClassVar[Mapping[str, Check]] = {
        "color": by(array, (3,), np.float64, least=0.0),
        "visible_to": rays,
        "casts_shadow": flag,
        "max_bounces": optional(by(whole, 0, 1 << 20)),
        **dict.fromkeys(("receivers", "blockers"), optional(by(names, "names of meshes"))),
    }

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the light and the wrong field."""
        where = f"light '{name}'"
        self.check_fields(where)
        self._validate(where)

    def _validate(self, where: str) -> None:
        """Check conditions that involve more than one field."""


def _direction(where: str, name: str, value: Any) -> NDArray[np.float64]:
    out = array(where, name, value, (3,), np.float64)
    if not np.linalg.norm(out) > 0.0:
        raise ValueError(f"{where}: {name} must not be zero")
    return out


# Half a turn, plus a margin for angles that were rounded to single precision.
_HALF_TURN = np.pi + 1e-6
# Radians; the cube of a smaller spread underflows in single precision.
_LEAST_SPREAD = 1e-9
_point: Check = by(array, (3,), np.float64, most=LARGEST_LENGTH)
_amount: Check = by(number, least=0.0)
_power: Check = by(number)
_length: Check = by(number, least=0.0, most=LARGEST_LENGTH)


@dataclass(kw_only=True)
class _NearLight(_Light):
    """Fields of lights at a place.

    Attributes
    ----------
    decay, smooth
        How the light falls with the distance r (Blender's Light Falloff): by 1/r² as physical light does
        (``"QUADRATIC"``), by 1/r (``"LINEAR"``) or not at all (``"CONSTANT"``). At 1 m all are the same. `smooth`, in
        m², >= 0, dims the light close by: r²/(r² + smooth) is a factor of it.
    """

    decay: str = "QUADRATIC"
    smooth: float = 0.0

    checks: ClassVar[Mapping[str, Check]] = {**_Light.checks, "decay": by(choice, DECAYS), "smooth": _amount}


@dataclass
class PointLight(_NearLight):
    """A light of radiant intensity power * color / (4 pi) (W/sr).

    Attributes
    ----------
    position
        (3,) metres.
    power
        Watts. A negative light takes light away.
    radius
        Metres, >= 0; 0: a point with hard shadows.
    sphere
        Shape of a light with a radius. True: a sphere. False: a disk that always faces the illuminated point
        (Blender's soft falloff), which avoids overexposure where the light intersects a surface.
    """

    position: NDArray[np.float64]
    power: float = 10.0
    radius: float = 0.0
    sphere: bool = False

    checks: ClassVar[Mapping[str, Check]] = {
        **_NearLight.checks, "position": _point, "power": _power, "radius": _length, "sphere": flag,
    }


@dataclass
class SpotLight(_NearLight):
    """A point light whose emission is restricted to a cone.

    Attributes
    ----------
    position, power, radius, sphere
        As for a point light. The power is that of the whole point light, not of the part within the cone.
    direction
        (3,) axis of the cone, in the direction in which light travels; any length but zero.
    angle
        Full opening angle of the cone, radians, in (0, pi].
    blend
        Fraction of the cone over which the edge is soft, in [0, 1] (as in Blender, the factor is
        smoothstep(((n.w)/|..| - cos(angle/2)) / ((1 - cos(angle/2)) * blend))). Below 0.001 the edge is hard.
    falloff
        Shape of the soft edge: ``"SMOOTH"`` is Blender's; ``"LINEAR"`` falls linearly in the angle to the
        axis, from 1 at (1 - blend) angle/2 to 0 at angle/2 (Mitsuba's spot).
    stretch, across
        (2,) factors > 0 by which the cone is stretched along the axes x and y around its direction, as by the scale of
        Blender's object, and (3,) a vector in the plane of direction and x, not along the direction. None: the cone is
        round. A stretched cone has the edge ``"SMOOTH"``, of a `blend` of at least 0.001, and an angle below pi.
    """

    position: NDArray[np.float64]
    direction: NDArray[np.float64]
    power: float = 10.0
    angle: float = 0.785398
    blend: float = 0.15
    radius: float = 0.0
    sphere: bool = False
    falloff: str = "SMOOTH"
    stretch: NDArray[np.float64] | None = None
    across: NDArray[np.float64] = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))

    checks: ClassVar[Mapping[str, Check]] = {
        **PointLight.checks,
        "direction": _direction,
        "angle": by(number, above=0.0, below=_HALF_TURN),
        "blend": by(number, least=0.0, below=1.0 + 1e-6),
        "falloff": by(choice, FALLOFFS),
        "stretch": optional(by(array, (2,), np.float64, least=1e-6)),
        "across": _direction,
    }

    def _validate(self, where: str) -> None:
        if self.stretch is None:
            return
        if self.falloff != "SMOOTH" or self.angle >= np.pi:
            raise ValueError(f"{where}: stretch needs the falloff 'SMOOTH' and an angle below pi")
        sizes = np.linalg.norm(self.direction) * np.linalg.norm(self.across)
        if np.linalg.norm(np.cross(self.direction, self.across)) <= 1e-6 * sizes:
            raise ValueError(f"{where}: across must not be along direction")


@dataclass
class SunLight(_Light):
    """A light at infinity.

    Attributes
    ----------
    direction
        (3,) direction in which light travels; any length but zero.
    strength
        Irradiance on a surface that faces the sun, W/m². A negative light takes light away.
    angle
        Angular diameter of the sun's disk, radians, in [0, pi]; 0: hard shadows.
    """

    direction: NDArray[np.float64]
    strength: float = 1.0
    angle: float = 0.0

    checks: ClassVar[Mapping[str, Check]] = {
        **_Light.checks,
        "direction": _direction,
        "strength": _power,
        "angle": by(number, least=0.0, below=_HALF_TURN),
    }


@dataclass
class AreaLight(_NearLight):
    """A flat emitter that shines along its local -Z axis with the radiance power * color / (pi * area).

    An area light blocks no light: it casts no shadow.

    Attributes
    ----------
    to_world
        (4, 4) rigid transform from light to world space.
    size
        (2,) extent along its local X and Y axes, metres, > 0.
    shape
        ``"RECTANGLE"`` or ``"ELLIPSE"`` (a disk is an ellipse of equal extents).
    power
        Watts. A negative light takes light away.
    spread
        Blender's spread: opening angle of the emission, radians, in (0, pi]; pi: a Lambertian emitter.
    """

    to_world: NDArray[np.float64]
    size: NDArray[np.float64] = field(default_factory=lambda: np.ones(2))
    shape: str = "RECTANGLE"
    power: float = 10.0
    spread: float = float(np.pi)

    checks: ClassVar[Mapping[str, Check]] = {
        **_NearLight.checks,
        "to_world": by(array, (4, 4), np.float64, most=LARGEST_LENGTH),
        "size": by(array, (2,), np.float64, least=0.0, most=LARGEST_LENGTH),
        "shape": by(choice, SHAPES),
        "power": _power,
        "spread": by(number, above=0.0, least=_LEAST_SPREAD, below=_HALF_TURN),
    }

    def _validate(self, where: str) -> None:
        orthonormal(where, "to_world", self.to_world, "rigid transform")
        if self.size.min() <= 0.0:
            raise ValueError(f"{where}: size must be above 0 along both axes")


Light = PointLight | SpotLight | SunLight | AreaLight


def has_size(light: Light) -> bool:
    """Whether a light has an extent, so that rays can hit it and a plane can divide it."""
    if isinstance(light, SunLight):
        return light.angle > 0.0
    return isinstance(light, AreaLight) or light.radius > 0.0

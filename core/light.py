"""Lights other than emissive meshes, in Blender's units."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import array, number

SHAPES = ("RECTANGLE", "ELLIPSE")


def _white() -> NDArray[np.float64]:
    return np.ones(3)


@dataclass
class PointLight:
    """A light without size; its radiant intensity is power * color / (4 pi) (W/sr).

    Attributes
    ----------
    position
        (3,) metres.
    power
        Watts, >= 0.
    color
        (3,) linear Rec.709, >= 0.
    """

    position: NDArray[np.float64]
    power: float = 10.0
    color: NDArray[np.float64] = field(default_factory=_white)

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the light and the wrong field."""
        where = f"light '{name}'"
        self.position = array(where, "position", self.position, (3,), np.float64)
        self.power = number(where, "power", self.power, least=0.0)
        self.color = array(where, "color", self.color, (3,), np.float64, least=0.0)


@dataclass
class SunLight:
    """A light at infinity without size.

    Attributes
    ----------
    direction
        (3,) direction in which its light travels; any length but zero.
    strength
        Irradiance on a surface that faces it, W/m², >= 0.
    color
        (3,) linear Rec.709, >= 0.
    """

    direction: NDArray[np.float64]
    strength: float = 1.0
    color: NDArray[np.float64] = field(default_factory=_white)

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the light and the wrong field."""
        where = f"light '{name}'"
        self.direction = array(where, "direction", self.direction, (3,), np.float64)
        if not np.linalg.norm(self.direction) > 0.0:
            raise ValueError(f"{where}: direction must not be zero")
        self.strength = number(where, "strength", self.strength, least=0.0)
        self.color = array(where, "color", self.color, (3,), np.float64, least=0.0)


@dataclass
class AreaLight:
    """A flat emitter that shines along its own -Z; its radiance is power * color / (pi * area).

    Light passes through it: it neither casts shadows nor is it seen by the camera.

    Attributes
    ----------
    to_world
        (4, 4) rigid transform from light to world space.
    size
        (2,) extent along its own X and Y, metres, > 0.
    shape
        ``"RECTANGLE"`` or ``"ELLIPSE"`` (a disk is an ellipse of equal extents).
    power
        Watts, >= 0.
    color
        (3,) linear Rec.709, >= 0.
    """

    to_world: NDArray[np.float64]
    size: NDArray[np.float64] = field(default_factory=lambda: np.ones(2))
    shape: str = "RECTANGLE"
    power: float = 10.0
    color: NDArray[np.float64] = field(default_factory=_white)

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the light and the wrong field."""
        where = f"light '{name}'"
        self.to_world = array(where, "to_world", self.to_world, (4, 4), np.float64)
        self.size = array(where, "size", self.size, (2,), np.float64, least=0.0)
        if self.size.min() <= 0.0:
            raise ValueError(f"{where}: size must be above 0 along both axes")
        if self.shape not in SHAPES:
            raise ValueError(f"{where}: shape must be one of {', '.join(SHAPES)}, not {self.shape!r}")
        self.power = number(where, "power", self.power, least=0.0)
        self.color = array(where, "color", self.color, (3,), np.float64, least=0.0)


Light = PointLight | SunLight | AreaLight

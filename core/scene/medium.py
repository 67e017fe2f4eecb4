"""Homogeneous media: fog, smoke and murky liquids that scatter and absorb light."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from .._check import array, number
from .._fields import Check, Checked, by


def _coefficients(where: str, name: str, value: Any) -> tuple[float, ...]:
    return tuple(array(where, name, value, (3,), np.float64, least=0.0).tolist())


@dataclass(frozen=True)
class Medium(Checked):
    """A homogeneous medium, which scatters light by the phase function of Henyey and Greenstein (1941).

    `Material.medium` fills the closed meshes with the material, `World.medium` the space around them. Where media
    overlap, their coefficients add up. Derivatives have the light that media scatter and keep, at scattering events
    that stand still: exact by colours, strengths and the coefficients, while the plan names what motions lack.

    Attributes
    ----------
    scattering
        (3,) 1/m, >= 0: of light scattered into other directions.
    absorption
        (3,) 1/m, >= 0: of light absorbed.
    anisotropy
        Mean cosine between the directions of the light before and after, in (-1, 1): 0 scatters evenly, positive
        values forwards.
    """

    scattering: tuple[float, ...] = (0.0, 0.0, 0.0)
    absorption: tuple[float, ...] = (0.0, 0.0, 0.0)
    anisotropy: float = 0.0

    checks: ClassVar[Mapping[str, Check]] = {
        "scattering": _coefficients,
        "absorption": _coefficients,
        "anisotropy": by(number, least=-0.999, greatest=0.999),
    }


def coefficient(medium: Medium, fieldname: str) -> Any:
    """Return the value of a medium's field: a float array, or a float."""
    value = getattr(medium, fieldname)
    return np.array(value) if isinstance(value, tuple) else value

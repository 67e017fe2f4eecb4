"""How paths bounce: limits by kind of scattering event, and narrow lobes behind diffuse bounces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from .._check import number, whole
from .._fields import Check, Checked, by

# Largest path length, in segments, that a path record can store.
MAX_DEPTH = 1000
MOST_BOUNCES = 255


@dataclass(frozen=True)
class Bounces(Checked):
    """Limits and filter of the bounces of paths, as in Blender's light path settings.

    If a path exceeds a limit, its last ray still returns the emission that it hits, but is not scattered again.

    Attributes
    ----------
    diffuse, glossy, transmission
        Scattering events of this kind, 0 to 255.
    medium
        Scattering events in media behind the first one, 0 to 255 (Cycles' Volume).
    transparent
        Transparent surfaces (alpha, Transparent BSDF) that a path may cross, 0 to 255. They do not count as
        path segments. After the last one, further transparent surfaces are opaque and black.
    ambient
        After this number of scattering events of all kinds, transmission and the first glossy one not counted, a ray
        returns only the emission that it hits and the light of the environment (Cycles' Fast GI Approximation with the
        method Replace, for rooms smaller than its distance). 255: no limit.
    filter_glossy
        Cycles' Filter Glossy, 0 (none) or more: mirrors, coats and glass that paths reach by diffuse bounces scatter
        light more widely, so that its caustics are blurred and have less noise. Their alpha (the squared roughness) is
        at least the mean of Cycles' limit over the directions of a diffuse bounce, 0.44 for a value of 1. Cycles widens
        lobes behind rough glossy bounces, too, by less.
    """

    diffuse: int = MOST_BOUNCES
    glossy: int = MOST_BOUNCES
    transmission: int = MOST_BOUNCES
    transparent: int = MOST_BOUNCES
    ambient: int = MOST_BOUNCES
    filter_glossy: float = 0.0
    medium: int = MOST_BOUNCES

    checks: ClassVar[Mapping[str, Check]] = dict.fromkeys(
        ("diffuse", "glossy", "transmission", "transparent", "medium"), by(whole, 0, MOST_BOUNCES)
    ) | {"ambient": by(whole, 1, MOST_BOUNCES), "filter_glossy": by(number, least=0.0)}

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        self.check_fields("bounces")


UNLIMITED = Bounces()

"""Bounce limits by kind of scattering event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from .._check import whole
from .._fields import Check, Checked, by

# Largest path length, in segments, that a path record can store.
MAX_DEPTH = 1000
MOST_BOUNCES = 255


@dataclass(frozen=True)
class Bounces(Checked):
    """Largest number of scattering events of each kind along a path, as in Blender's light path settings.

    If a path exceeds a limit, its last ray still returns the emission that it hits, but is not scattered again.

    Attributes
    ----------
    diffuse, glossy, transmission
        Scattering events of this kind, 0 to 255.
    transparent
        Transparent surfaces (alpha, Transparent BSDF) that a path may cross, 0 to 255. They do not count as
        path segments. After the last one, further transparent surfaces are opaque and black.
    ambient
        After this number of scattering events of all kinds, transmission and the first glossy one not counted, a ray
        returns only the emission that it hits and the light of the environment (Cycles' Fast GI Approximation with the
        method Replace, for rooms smaller than its distance). 255: no limit.
    """

    diffuse: int = MOST_BOUNCES
    glossy: int = MOST_BOUNCES
    transmission: int = MOST_BOUNCES
    transparent: int = MOST_BOUNCES
    ambient: int = MOST_BOUNCES

    checks: ClassVar[Mapping[str, Check]] = dict.fromkeys(
        ("diffuse", "glossy", "transmission", "transparent"), by(whole, 0, MOST_BOUNCES)
    ) | {"ambient": by(whole, 1, MOST_BOUNCES)}

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        self.check_fields("bounces")


UNLIMITED = Bounces()

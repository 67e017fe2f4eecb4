"""How often light may be scattered, by kind of scattering."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from .._check import whole
from .._fields import Check, Checked, by

# Path segments that a ray's record has room for.
MAX_DEPTH = 1000
MOST_BOUNCES = 255


@dataclass(frozen=True)
class Bounces(Checked):
    """Most scatterings of each kind along a path, as in Blender's light paths.

    A ray beyond a limit still brings the light that it meets, but isn't scattered again.

    Attributes
    ----------
    diffuse, glossy, transmission
        From 0 to 255.
    transparent
        Surfaces that a path passes without being scattered (alpha, Transparent), from 0 to 255; they don't
        count as segments. Beyond that, surfaces are opaque to it and black.
    """

    diffuse: int = MOST_BOUNCES
    glossy: int = MOST_BOUNCES
    transmission: int = MOST_BOUNCES
    transparent: int = MOST_BOUNCES

    checks: ClassVar[Mapping[str, Check]] = dict.fromkeys(
        ("diffuse", "glossy", "transmission", "transparent"), by(whole, 0, MOST_BOUNCES)
    )

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        self.check_fields("bounces")


UNLIMITED = Bounces()

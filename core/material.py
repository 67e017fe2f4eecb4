"""Surface materials."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import array


@dataclass
class Material:
    """A diffuse surface that may emit light. It scatters on both sides.

    Attributes
    ----------
    base_color
        (3,) diffuse reflectance, linear Rec.709, in [0, 1].
    emission
        (3,) emitted radiance, W/(m² sr) per channel, >= 0.
    emission_two_sided
        Whether the back emits too, as Blender's Emission does; False: only the front
        (counter-clockwise) side.
    """

    base_color: NDArray[np.float64] = field(default_factory=lambda: np.full(3, 0.8))
    emission: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    emission_two_sided: bool = True

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the material and the wrong field."""
        where = f"material '{name}'"
        self.base_color = array(where, "base_color", self.base_color, (3,), np.float64, least=0.0)
        self.emission = array(where, "emission", self.emission, (3,), np.float64, least=0.0)
        if self.base_color.max() > 1.0:
            raise ValueError(f"{where}: base_color must not be above 1, but contains {self.base_color.max():g}")

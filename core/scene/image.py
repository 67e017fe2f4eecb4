"""Images for textures and the environment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import light_values
from .._fields import Check, Checked, by


@dataclass
class Image(Checked):
    """A picture of linear values.

    Attributes
    ----------
    pixels
        (height, width, c) float32, row 0 on top, c = 1 (grey), 3 (linear Rec.709 or plain data) or 4
        (with alpha, not premultiplied).
    """

    pixels: NDArray[np.float32]

    checks: ClassVar[Mapping[str, Check]] = {"pixels": by(light_values, (None, None, None))}

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the image and the wrong field."""
        where = f"image '{name}'"
        self.check_fields(where)
        if self.pixels.shape[2] not in (1, 3, 4) or 0 in self.pixels.shape:
            raise ValueError(f"{where}: pixels must have the shape (height, width, 1, 3 or 4), "
                             f"not {self.pixels.shape}")

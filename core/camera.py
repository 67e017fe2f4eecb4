"""The camera: pose, field of view and picture size."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import array, number, whole

# Pixels are numbered in 32 bits, three floats each.
MAX_PIXELS = 1 << 28


@dataclass
class Camera:
    """A pinhole camera in Blender's convention: it looks down its own -Z axis, +Y is up.

    Attributes
    ----------
    to_world
        (4, 4) rigid transform from camera to world space, metres.
    fov_x
        Horizontal field of view of the full picture, radians, in (0, pi).
    width, height
        Picture size in pixels (square pixels).
    shift
        (2,) shift of the lens to the right and upwards as a fraction of the picture *width*:
        the principal point is at pixel (width/2 - shift[0]*width, height/2 + shift[1]*width),
        row 0 on top.
    clip_start, clip_end
        Distances along the view axis, metres, outside of which nothing is seen.
    """

    to_world: NDArray[np.float64]
    fov_x: float = 0.6911
    width: int = 256
    height: int = 256
    shift: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    clip_start: float = 0.01
    clip_end: float = 1e6

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        where = "camera"
        self.to_world = array(where, "to_world", self.to_world, (4, 4), np.float64)
        self.shift = array(where, "shift", self.shift, (2,), np.float64)
        self.fov_x = number(where, "fov_x", self.fov_x, above=0.0, below=np.pi)
        self.width = whole(where, "width", self.width, 1, 65536)
        self.height = whole(where, "height", self.height, 1, 65536)
        if self.width * self.height > MAX_PIXELS:
            raise ValueError(f"{where}: a picture of {self.width} x {self.height} pixels is too large; "
                             f"{MAX_PIXELS} pixels are the most")
        self.clip_start = number(where, "clip_start", self.clip_start, above=0.0)
        self.clip_end = number(where, "clip_end", self.clip_end, above=self.clip_start)
        rotation = self.to_world[:3, :3]
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
            raise ValueError("camera: to_world must be a rigid transform; its axes are not orthonormal")

    @property
    def focal(self) -> float:
        """Focal length in pixels: (width/2) / tan(fov_x/2)."""
        return 0.5 * self.width / float(np.tan(0.5 * self.fov_x))

    @property
    def principal_point(self) -> NDArray[np.float64]:
        """(2,) pixel at which the view axis meets the picture."""
        return np.array([
            0.5 * self.width - self.shift[0] * self.width,
            0.5 * self.height + self.shift[1] * self.width,
        ])

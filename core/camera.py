"""The camera: pose, projection, lens, picture size and pixel filter."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import LARGEST_LENGTH, array, choice, number, whole

# Pixels are numbered in 32 bits, three floats each.
MAX_PIXELS = 1 << 28
KINDS = ("PERSPECTIVE", "ORTHOGRAPHIC", "EQUIRECTANGULAR")
FILTERS = ("BOX", "BLACKMAN_HARRIS", "GAUSSIAN")
# Narrowest field of view, most of ratios (and of their inverses) and of shifts, and radians: what is beyond leaves
# single precision when rays are made of it.
_NARROWEST, _MOST_RATIO, _MOST_SHIFT, _MOST_ANGLE = 1e-9, 1e4, 1e4, 1e4
# Pixels; a sample of a derivative is added to the square of so many.
_WIDEST_FILTER = 256.0


@dataclass
class Camera:
    """A camera in Blender's convention: it looks down its own -Z axis, +Y is up.

    Attributes
    ----------
    to_world
        (4, 4) rigid transform from camera to world space, metres.
    kind
        ``"PERSPECTIVE"``, ``"ORTHOGRAPHIC"`` or ``"EQUIRECTANGULAR"``.
    fov_x
        Perspective: horizontal field of view of the full picture, radians, in (0, pi).
    ortho_width
        Orthographic: width of the picture in the scene, metres, > 0.
    longitude, latitude
        Equirectangular: (2,) range from the picture's left to its right edge, and from its lower to its
        upper edge, radians. Longitude 0 is the viewing direction and grows to the right, latitude to +Y.
    width, height
        Size of the full picture in pixels.
    shift
        (2,) shift of the lens to the right and upwards as a fraction of the picture *width*:
        the principal point is at pixel (width/2 - shift[0]*width, height/2 + shift[1]*width/pixel_aspect),
        row 0 on top.
    pixel_aspect
        Height of a pixel divided by its width, > 0.
    clip_start, clip_end
        Distances outside of which nothing is seen, metres: along the view axis, for an
        equirectangular camera along the ray.
    aperture_radius, focus_distance
        Perspective and orthographic: radius of the lens (metres, 0: everything is sharp), and the distance
        along the view axis at which the picture is sharp (metres, > 0).
    aperture_blades, aperture_rotation, aperture_ratio
        Shape of the aperture: number of sides (below 3: round), the angle at which the middle of a side is
        (radians, from +X to +Y), and its width divided into its height's share as Blender has it (1: none).
    crop
        (x0, y0, x1, y1): only these pixels of the full picture are rendered, x0 <= x < x1, row 0 on top;
        None: all. Rendered pictures have the crop's size.
    filter, filter_width
        Pixel filter ``"BOX"``, ``"BLACKMAN_HARRIS"`` or ``"GAUSSIAN"`` and its full width in pixels, in (0, 256],
        as in Cycles (whose filters end at half that width to each side).
    """

    to_world: NDArray[np.float64]
    fov_x: float = 0.6911
    width: int = 256
    height: int = 256
    shift: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    clip_start: float = 0.01
    clip_end: float = 1e6
    kind: str = "PERSPECTIVE"
    ortho_width: float = 6.0
    longitude: NDArray[np.float64] = field(default_factory=lambda: np.array([-np.pi, np.pi]))
    latitude: NDArray[np.float64] = field(default_factory=lambda: np.array([-0.5 * np.pi, 0.5 * np.pi]))
    pixel_aspect: float = 1.0
    aperture_radius: float = 0.0
    focus_distance: float = 10.0
    aperture_blades: int = 0
    aperture_rotation: float = 0.0
    aperture_ratio: float = 1.0
    crop: tuple[int, int, int, int] | None = None
    filter: str = "BOX"
    filter_width: float = 1.0

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        where = "camera"
        self.to_world = array(where, "to_world", self.to_world, (4, 4), np.float64, most=LARGEST_LENGTH)
        self.shift = array(where, "shift", self.shift, (2,), np.float64, most=_MOST_SHIFT)
        self.longitude = array(where, "longitude", self.longitude, (2,), np.float64, most=_MOST_ANGLE)
        self.latitude = array(where, "latitude", self.latitude, (2,), np.float64, most=_MOST_ANGLE)
        choice(where, "kind", self.kind, KINDS)
        choice(where, "filter", self.filter, FILTERS)
        self.fov_x = number(where, "fov_x", self.fov_x, above=0.0, least=_NARROWEST, below=np.pi)
        for name in ("ortho_width", "focus_distance"):
            least = 1.0 / LARGEST_LENGTH
            setattr(self, name, number(where, name, getattr(self, name), above=0.0, least=least, most=LARGEST_LENGTH))
        for name in ("pixel_aspect", "aperture_ratio"):
            least = 1.0 / _MOST_RATIO
            setattr(self, name, number(where, name, getattr(self, name), above=0.0, least=least, most=_MOST_RATIO))
        self.filter_width = number(where, "filter_width", self.filter_width, above=0.0, most=_WIDEST_FILTER)
        self.aperture_radius = number(where, "aperture_radius", self.aperture_radius, least=0.0, most=LARGEST_LENGTH)
        self.aperture_rotation = number(where, "aperture_rotation", self.aperture_rotation, most=_MOST_ANGLE)
        self.aperture_blades = whole(where, "aperture_blades", self.aperture_blades, 0, 64)
        self.width = whole(where, "width", self.width, 1, 65536)
        self.height = whole(where, "height", self.height, 1, 65536)
        if self.width * self.height > MAX_PIXELS:
            raise ValueError(f"{where}: a picture of {self.width} x {self.height} pixels is too large; "
                             f"{MAX_PIXELS} pixels are the most")
        self.clip_start = number(where, "clip_start", self.clip_start, least=0.0, most=LARGEST_LENGTH)
        self.clip_end = number(where, "clip_end", self.clip_end, above=self.clip_start)
        rotation = self.to_world[:3, :3]
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
            raise ValueError("camera: to_world must be a rigid transform; its axes are not orthonormal")
        if self.crop is not None:
            x0, y0, x1, y1 = (whole(where, "crop", c, 0, 65536) for c in self.crop)
            if not (x0 < x1 <= self.width and y0 < y1 <= self.height):
                raise ValueError(f"{where}: crop {self.crop} must be a part of the picture of "
                                 f"{self.width} x {self.height} pixels that is not empty")
            self.crop = (x0, y0, x1, y1)

    @property
    def focal(self) -> float:
        """Perspective: focal length in pixels, (width/2) / tan(fov_x/2); orthographic: pixels per metre."""
        if self.kind == "ORTHOGRAPHIC":
            return self.width / self.ortho_width
        return 0.5 * self.width / np.tan(0.5 * self.fov_x)

    @property
    def principal_point(self) -> NDArray[np.float64]:
        """(2,) pixel of the full picture at which the view axis meets it."""
        return np.array([
            0.5 * self.width - self.shift[0] * self.width,
            0.5 * self.height + self.shift[1] * self.width / self.pixel_aspect,
        ])

    @property
    def window(self) -> tuple[int, int, int, int]:
        """The pixels that are rendered: `crop`, or the full picture."""
        return self.crop if self.crop is not None else (0, 0, self.width, self.height)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the rendered picture."""
        x0, y0, x1, y1 = self.window
        return y1 - y0, x1 - x0

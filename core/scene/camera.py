"""The camera: pose, projection, lens, picture size and pixel filter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import LARGEST_LENGTH, array, choice, number, orthonormal, whole, wholes
from .._fields import Check, Checked, by, optional

# Pixels are numbered in 32 bits, three floats each.
MAX_PIXELS = 1 << 28
MAX_SIDE = 65536
KINDS = ("PERSPECTIVE", "ORTHOGRAPHIC", "EQUIRECTANGULAR")
FILTERS = ("BOX", "BLACKMAN_HARRIS", "GAUSSIAN")
# Narrowest field of view, most of ratios (and of their inverses) and of shifts, and radians: what is beyond leaves
# single precision when rays are made of it.
_NARROWEST, _MOST_RATIO, _MOST_SHIFT, _MOST_ANGLE = 1e-9, 1e4, 1e4, 1e4
# Pixels; a sample of a derivative is added to the square of so many.
_WIDEST_FILTER = 256.0


@dataclass
class Camera(Checked):
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

    checks: ClassVar[Mapping[str, Check]] = {
        "to_world": by(array, (4, 4), np.float64, most=LARGEST_LENGTH),
        "fov_x": by(number, above=0.0, least=_NARROWEST, below=np.pi),
        **dict.fromkeys(("width", "height"), by(whole, 1, MAX_SIDE)),
        "shift": by(array, (2,), np.float64, most=_MOST_SHIFT),
        **dict.fromkeys(("longitude", "latitude"), by(array, (2,), np.float64, most=_MOST_ANGLE)),
        **dict.fromkeys(("clip_start", "aperture_radius"), by(number, least=0.0, most=LARGEST_LENGTH)),
        "clip_end": by(number, above=0.0),
        "kind": by(choice, KINDS),
        **dict.fromkeys(("ortho_width", "focus_distance"),
                        by(number, above=0.0, least=1.0 / LARGEST_LENGTH, most=LARGEST_LENGTH)),
        **dict.fromkeys(("pixel_aspect", "aperture_ratio"),
                        by(number, above=0.0, least=1.0 / _MOST_RATIO, most=_MOST_RATIO)),
        "filter_width": by(number, above=0.0, most=_WIDEST_FILTER),
        "aperture_blades": by(whole, 0, 64),
        "aperture_rotation": by(number, most=_MOST_ANGLE),
        "crop": optional(by(wholes, 4, 0, MAX_SIDE)),
        "filter": by(choice, FILTERS),
    }

    def validate(self) -> None:
        """Raise ``ValueError`` with one sentence that names the wrong field."""
        where = "camera"
        self.check_fields(where)
        if self.width * self.height > MAX_PIXELS:
            raise ValueError(f"{where}: a picture of {self.width} x {self.height} pixels is too large; "
                             f"{MAX_PIXELS} pixels are the most")
        if self.clip_end <= self.clip_start:
            raise ValueError(f"{where}: clip_end must be above clip_start, {self.clip_start:g}, not {self.clip_end:g}")
        orthonormal(where, "to_world", self.to_world, "rigid transform")
        if self.crop is not None:
            x0, y0, x1, y1 = self.crop
            if not (x0 < x1 <= self.width and y0 < y1 <= self.height):
                raise ValueError(f"{where}: crop {self.crop} must be a part of the picture of "
                                 f"{self.width} x {self.height} pixels that is not empty")

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

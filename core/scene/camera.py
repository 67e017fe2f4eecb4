"""The camera: pose, projection, lens, picture size and pixel filter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import LARGEST_LENGTH, array, choice, number, orthonormal, whole, wholes
from .._fields import Check, Checked, by, optional

# A picture's floats, three a pixel, are indexed by 32 bits.
MAX_PIXELS = 1 << 28
MAX_SIDE = 65536
KINDS = ("PERSPECTIVE", "ORTHOGRAPHIC", "EQUIRECTANGULAR")
FILTERS = ("BOX", "BLACKMAN_HARRIS", "GAUSSIAN")
# Smallest field of view (radians), largest ratio and inverse ratio, largest lens shift and largest angle (radians).
# Beyond them, the generation of camera rays overflows single precision.
_NARROWEST, _MOST_RATIO, _MOST_SHIFT, _MOST_ANGLE = 1e-9, 1e4, 1e4, 1e4
# Pixels. Each derivative sample is splatted over a square of this size, so its cost grows with the square.
_WIDEST_FILTER = 256.0


@dataclass
class Camera(Checked):
    """A camera in Blender's convention: it looks along its local -Z axis, and +Y is up.

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
        Equirectangular: (2,) longitude of the left and the right edge of the picture, and latitude of its lower
        and upper edge, radians. Longitude 0 is the viewing direction; longitude grows to the right, latitude
        towards +Y.
    width, height
        Size of the full picture in pixels.
    shift
        (2,) shift of the lens to the right and upwards as a fraction of the picture *width*:
        the principal point is at pixel (width/2 - shift[0]*width, height/2 + shift[1]*width/pixel_aspect),
        row 0 on top.
    pixel_aspect
        Height of a pixel divided by its width, > 0.
    clip_start, clip_end
        Clipping distances, metres: nothing nearer or farther is visible. They are measured along the view axis,
        for an equirectangular camera along the ray.
    aperture_radius, focus_distance
        Perspective and orthographic: radius of the lens (metres; 0: a pinhole), and distance of the plane in
        focus along the view axis (metres, > 0).
    aperture_blades, aperture_rotation, aperture_ratio
        Shape of the aperture: number of sides (below 3: round), angle of the middle of one side (radians, from
        +X to +Y), and Blender's aperture ratio, which divides the aperture's width (1: undistorted).
    crop
        (x0, y0, x1, y1): render only the pixels x0 <= x < x1, y0 <= y < y1 of the full picture, row 0 on top;
        None: all pixels. Rendered pictures have the size of the crop.
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
                             f"the limit is {MAX_PIXELS} pixels")
        if self.clip_end <= self.clip_start:
            raise ValueError(f"{where}: clip_end must be above clip_start, {self.clip_start:g}, not {self.clip_end:g}")
        orthonormal(where, "to_world", self.to_world, "rigid transform")
        if self.crop is not None:
            x0, y0, x1, y1 = self.crop
            if not (x0 < x1 <= self.width and y0 < y1 <= self.height):
                raise ValueError(f"{where}: crop {self.crop} must be a non-empty part of the picture of "
                                 f"{self.width} x {self.height} pixels")

    def of_size(self, height: int, width: int) -> Camera:
        """Return the camera with another size of the full picture, which covers the same; `crop` must be None.

        The shape of pixels makes up for what the aspects differ.
        """
        stretch = (self.height / height) / (self.width / width)
        return replace(self, width=width, height=height, pixel_aspect=self.pixel_aspect * stretch)

    @property
    def focal(self) -> float:
        """Perspective: focal length in pixels, (width/2) / tan(fov_x/2); orthographic: pixels per metre."""
        if self.kind == "ORTHOGRAPHIC":
            return self.width / self.ortho_width
        return 0.5 * self.width / np.tan(0.5 * self.fov_x)

    @property
    def principal_point(self) -> NDArray[np.float64]:
        """(2,) pixel coordinates, in the full picture, of the point on the view axis."""
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

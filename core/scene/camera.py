"""The camera: pose, projection, lens, picture size and pixel filter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import LARGEST_LENGTH, array, choice, number, orthonormal, whole, wholes
from .._fields import Check, Checked, by, optional

# A picture's floats, three a pixel, are indexed by 32 bits.
MAX_PIXELS = 1 << 28
MAX_SIDE = 65536
FISHEYES = ("FISHEYE_EQUISOLID", "FISHEYE_EQUIDISTANT", "FISHEYE_POLYNOMIAL")
PANORAMAS = ("EQUIRECTANGULAR", *FISHEYES)
KINDS = ("PERSPECTIVE", "ORTHOGRAPHIC", *PANORAMAS)
FILTERS = ("BOX", "BLACKMAN_HARRIS", "GAUSSIAN")
# Smallest field of view (radians), largest ratio and inverse ratio, largest lens shift and largest angle (radians).
# Beyond them, the generation of camera rays overflows single precision.
_NARROWEST, _MOST_RATIO, _MOST_SHIFT, MOST_ANGLE = 1e-9, 1e4, 1e4, 1e4
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
        ``"PERSPECTIVE"``, ``"ORTHOGRAPHIC"``, ``"EQUIRECTANGULAR"``, or a fisheye: ``"FISHEYE_EQUISOLID"``,
        ``"FISHEYE_EQUIDISTANT"`` or ``"FISHEYE_POLYNOMIAL"``.
    fov_x
        Perspective: horizontal field of view of the full picture, radians, in (0, pi).
    ortho_width
        Orthographic: width of the picture in the scene, metres, > 0.
    longitude, latitude
        Equirectangular: (2,) longitude of the left and the right edge of the picture, and latitude of its lower
        and upper edge, radians. Longitude 0 is the viewing direction; longitude grows to the right, latitude
        towards +Y.
    fisheye_fov
        Fisheye: the angle between opposite sides of the cone that it sees, radians, in (0, 2 pi]. The picture is
        black outside. It spans the picture's width if the fisheye is equidistant.
    fisheye_lens
        Equisolid fisheye: focal length divided by the picture's width, > 0.
    fisheye_polynomial
        (5,) polynomial fisheye: the angle from the viewing direction, radians, is the sum of ``fisheye_polynomial[k] *
        r**k``, where r is the distance from the principal point divided by the picture's width. It must grow with r.
    width, height
        Size of the full picture in pixels.
    shift
        (2,) all but equirectangular: shift of the lens to the right and upwards as a fraction of the picture *width*:
        the principal point is at pixel (width/2 - shift[0]*width, height/2 + shift[1]*width/pixel_aspect),
        row 0 on top.
    pixel_aspect
        Height of a pixel divided by its width, > 0.
    clip_start, clip_end
        Clipping distances, metres: nothing nearer or farther is visible. They are measured along the view axis,
        for panoramas and fisheyes along the ray.
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
    fisheye_fov: float = np.pi
    fisheye_lens: float = 0.3
    fisheye_polynomial: NDArray[np.float64] = field(default_factory=lambda: np.array([0.0, np.pi, 0.0, 0.0, 0.0]))
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
        **dict.fromkeys(("longitude", "latitude"), by(array, (2,), np.float64, most=MOST_ANGLE)),
        **dict.fromkeys(("clip_start", "aperture_radius"), by(number, least=0.0, most=LARGEST_LENGTH)),
        "fisheye_fov": by(number, above=0.0, least=_NARROWEST, most=2.0 * np.pi),
        "fisheye_lens": by(number, above=0.0, least=1.0 / _MOST_RATIO, most=_MOST_RATIO),
        "fisheye_polynomial": by(array, (5,), np.float64, most=MOST_ANGLE),
        "clip_end": by(number, above=0.0),
        "kind": by(choice, KINDS),
        **dict.fromkeys(("ortho_width", "focus_distance"),
                        by(number, above=0.0, least=1.0 / LARGEST_LENGTH, most=LARGEST_LENGTH)),
        **dict.fromkeys(("pixel_aspect", "aperture_ratio"),
                        by(number, above=0.0, least=1.0 / _MOST_RATIO, most=_MOST_RATIO)),
        "filter_width": by(number, above=0.0, most=_WIDEST_FILTER),
        "aperture_blades": by(whole, 0, 64),
        "aperture_rotation": by(number, most=MOST_ANGLE),
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
        if self.kind == "FISHEYE_POLYNOMIAL":
            _check_growth(self)
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
        """Perspective: focal length in pixels, (width/2) / tan(fov_x/2); orthographic: pixels per metre.

        Fisheye: pixels by which the principal point is away from where the radius is 1: the radius is the angle of
        equidistant ones, 2 sin(angle/2) of equisolid ones, and the variable of the polynomial.
        """
        if self.kind == "ORTHOGRAPHIC":
            return self.width / self.ortho_width
        if self.kind == "FISHEYE_EQUIDISTANT":
            return self.width / self.fisheye_fov
        if self.kind == "FISHEYE_EQUISOLID":
            return self.fisheye_lens * self.width
        if self.kind == "FISHEYE_POLYNOMIAL":
            return float(self.width)
        return 0.5 * self.width / np.tan(0.5 * self.fov_x)

    @property
    def disc(self) -> float:
        """Radius of the disc that a fisheye sees, pixels along x; 0 for other cameras."""
        if self.kind == "FISHEYE_EQUIDISTANT":
            return 0.5 * self.width
        if self.kind == "FISHEYE_EQUISOLID":
            return 2.0 * self.focal * np.sin(0.25 * self.fisheye_fov)
        return self.width * _edge_of_polynomial(self) if self.kind == "FISHEYE_POLYNOMIAL" else 0.0

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


def _farthest(camera: Camera) -> float:
    """Distance of the picture's farthest corner from the principal point, divided by the picture's width."""
    aside = 0.5 + abs(camera.shift[0].real)
    above = 0.5 * camera.height * camera.pixel_aspect.real / camera.width + abs(camera.shift[1].real)
    return float(np.hypot(aside, above))


def _edge_of_polynomial(camera: Camera) -> Any:
    """Radius at which a polynomial fisheye's angle is half the field of view, or that of the picture's corner."""
    angle, half = np.polynomial.Polynomial(camera.fisheye_polynomial), 0.5 * camera.fisheye_fov
    real = np.polynomial.Polynomial(camera.fisheye_polynomial.real)
    radii = _seen_radii(camera)
    low, high = float(radii[-2]), float(radii[-1])
    if real(high) <= half.real:
        return high
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if real(middle) < half.real else (low, middle)
    # One step of Newton's method, so that the result is analytic (derivatives/complex_step.py)
    return high - (angle(high) - half) / angle.deriv()(high)


def _seen_radii(camera: Camera) -> NDArray[np.float64]:
    """Radii from 0 to the first at which a polynomial fisheye's angle exceeds half the field of view."""
    radii = np.linspace(0.0, _farthest(camera), 1025)
    beyond = np.polynomial.Polynomial(camera.fisheye_polynomial.real)(radii) > 0.5 * camera.fisheye_fov.real
    return radii[: 1 + max(1, int(beyond.argmax()))] if beyond.any() else radii


def _check_growth(camera: Camera) -> None:
    lens = np.polynomial.Polynomial(camera.fisheye_polynomial)
    if lens(0.0) < -1e-3 or (lens.deriv()(_seen_radii(camera)) <= 0.0).any():
        raise ValueError("camera: fisheye_polynomial must grow from 0 or more with the distance from the principal "
                         "point, up to half of fisheye_fov or to the picture's corner")

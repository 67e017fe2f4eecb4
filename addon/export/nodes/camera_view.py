"""What nodes know of the view: the camera's space, sizes of pixels, places in the picture, and the view layer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Operand
from edgegrad.geometry.camera_view import pixel_angles
from edgegrad.scene.camera import PANORAMAS

# Cosine between the view axis and a direction below which the pixels of a perspective camera count as no smaller.
_OBLIQUE = 0.5


@dataclass(frozen=True)
class CameraView:
    """The view of a camera, as expressions of the hit point.

    Attributes
    ----------
    world_to_camera
        (4, 4) transform to Cycles' camera space, in which Z is the depth.
    pixel_size
        Size of the camera's pixels at the hit point, metres.
    window
        Place of the hit point in the picture: (0, 0, 0) at its lower left corner, (1, 1, 0) at its upper right one;
        None: a panorama, for which there is no expression.
    ray_start
        Distance from the camera to its near plane, on the way to the hit point, metres.
    of_layer
        Returns the numbers of a property of the view layer or its scene, by its name; None: neither has it.
    """

    world_to_camera: NDArray[np.float64]
    pixel_size: Operand
    window: Operand | None
    ray_start: Operand = 0.0
    of_layer: Callable[[str], tuple[float, ...] | None] = lambda _: None

    @staticmethod
    def of(camera: edgegrad.Camera, of_layer: Callable[[str], tuple[float, ...] | None] = lambda _: None) -> CameraView:
        """Return the view of an exported camera, with the properties of its view layer."""
        matrix = np.diag([1.0, 1.0, -1.0, 1.0]) @ np.linalg.inv(camera.to_world)
        return CameraView(np.asarray(matrix, np.float64), pixel_size(camera), _window(camera, matrix),
                          _ray_start(camera, matrix), of_layer)  # fmt: skip


def _transform(matrix: NDArray[np.float64]) -> e.Transform:
    rows = tuple(tuple(map(float, row)) for row in matrix[:3])
    return e.Transform(e.Coordinates("POSITION"), rows)  # type: ignore[arg-type]


def _ray_start(camera: edgegrad.Camera, matrix: NDArray[np.float64]) -> Operand:
    if camera.kind != "PERSPECTIVE":
        return float(camera.clip_start)
    seen = _transform(matrix)
    slant = e.Math("DIVIDE", e.VectorMath("LENGTH", seen), e.Channel(seen, 2))
    return e.Math("MULTIPLY", slant, float(camera.clip_start))


def _window(camera: edgegrad.Camera, matrix: NDArray[np.float64]) -> Operand | None:
    if camera.kind in PANORAMAS:
        return None
    place: Operand = _transform(matrix)
    if camera.kind == "PERSPECTIVE":
        place = e.VectorMath("SCALE", place, scale=e.Math("DIVIDE", 1.0, e.Channel(place, 2)))
    high = camera.height * camera.pixel_aspect  # in widths of a pixel
    shift = camera.shift * camera.width
    scale = (camera.focal / camera.width, camera.focal / high, 0.0)
    return e.VectorMath("MULTIPLY_ADD", place, tuple(map(float, scale)),
                        (0.5 - float(shift[0]) / camera.width, 0.5 - float(shift[1]) / high, 0.0))  # fmt: skip


def pixel_size(camera: edgegrad.Camera) -> Operand:
    """Size of the camera's pixels at the hit point, metres, as Cycles' ray differentials have it for camera rays.

    Cycles continues the differentials along the path. Here the distance from the camera replaces the path's length.
    """
    if camera.kind == "ORTHOGRAPHIC":
        return 0.5 * (1.0 + camera.pixel_aspect) / camera.focal
    seen = _transform(np.linalg.inv(camera.to_world))
    distance = e.VectorMath("LENGTH", seen)
    if camera.kind in PANORAMAS:
        return e.Math("MULTIPLY", distance, float(pixel_angles(camera).mean()))
    # A pixel turns the unit vector d of the direction by its size across x times |d.z| sqrt(1 - d.x^2), and likewise
    # for y.
    unit = e.VectorMath("NORMALIZE", seen)
    across = [e.Math("SQRT", e.Math("SUBTRACT", 1.0, e.Math("MULTIPLY", c, c)))
              for c in (e.Channel(unit, 0), e.Channel(unit, 1))]  # fmt: skip
    size = e.Math("MULTIPLY_ADD", across[1], camera.pixel_aspect, across[0])
    depth = e.Math("MAXIMUM", e.Math("MULTIPLY", e.Channel(unit, 2), -1.0), _OBLIQUE)
    return e.Math("MULTIPLY", e.Math("MULTIPLY", size, 0.5 / camera.focal), e.Math("MULTIPLY", depth, distance))

"""Parameters of a scene that have a value in each frame: the driven variables of `Film.keyed`.

A pose is six numbers a frame: a rotation vector about the middle of what it moves, and a translation. Other parameters
are their own numbers. The scene that a frame shows follows in numpy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...scene import parameters
from ...scene.scene import Scene
from ..bounds import first_step, limits
from ..checkpoints.resumable import State
from ..driven import Placement
from ..rigid_variables import TURN_STEP, moved_pose, pivot_and_extent
from .film import Film
from .keyed import KeyedNumbers

F64 = NDArray[np.float64]

CAMERA = "camera."
POSES = ("to_world", "transform")
# Points and directions, which have no range and no first step of their own (`bounds`).
PLACES = ("position", "direction", "across", "lower", "upper")
# More numbers, such as vertices or texels, are shapes and images, which have one value for all frames.
MOST_NUMBERS = 64
# Step of the difference quotients of poses, radians and extents; the functions are smooth, so the error is 1e-10.
STEP = 1e-5


class KeyedParameters:
    """Keyed parameters of a scene (`driven.Driven`).

    Parameters
    ----------
    scene
        The scene, with the values of all frames at the start.
    film
        The frames and the paths.

    Raises
    ------
    ValueError
        For a parameter that has no value in each frame; names it.
    """

    def __init__(self, scene: Scene, film: Film) -> None:
        self._of_views = film.of_views
        self._start: dict[str, F64] = {}
        self._pivots: dict[str, tuple[F64, float]] = {}
        self.variables: list[KeyedNumbers] = []
        count = len(film.times)
        for path in film.keyed:
            value = np.asarray(parameters.get(scene, path), np.float64)
            field = parameters.split(path)[2]
            pose = field in POSES
            if not pose and (value.ndim == 2 or value.size > MOST_NUMBERS or field in PLACES):
                raise ValueError(f"film: '{path}' can't be keyed; key a transform, a camera-to-world matrix or numbers")
            self._start[path] = value
            if pose:
                self._pivots[path] = pivot_and_extent(scene, path, value)
                first, steps = np.zeros(6), np.full(6, TURN_STEP)
                steps[3:] *= self._pivots[path][1]
                low, high = -np.inf, np.inf
            else:
                first, steps = value.ravel(), np.full(value.size, first_step(scene, path))
                low, high = limits(scene, path)
            every = np.ones((count, 1))
            self.variables.append(KeyedNumbers(path, every * first, every * steps, np.full((count, len(first)), low),
                                               np.full((count, len(first)), high)))  # fmt: skip

    def value(self, path: str, numbers: F64) -> F64:
        """Return the parameter in a frame, from the numbers of the frame."""
        if path not in self._pivots:
            return numbers.reshape(self._start[path].shape)
        return moved_pose(self._start[path], self._pivots[path][0], numbers)

    def values(self, path: str, numbers: F64) -> F64:
        """Return the parameter in all frames."""
        return np.stack([self.value(path, one) for one in numbers])

    def place(self, values: Mapping[str, F64], views: Sequence[int] | None = None) -> Placement:
        """Return what follows from values of the variables (`driven.Driven`); it costs little for all pictures."""
        cameras: list[dict[str, F64]] = []
        own: list[dict[str, F64]] = []
        for frame in self._of_views:
            found = {path: self.value(path, numbers[frame]) for path, numbers in values.items()}
            cameras.append({path[len(CAMERA) :]: one for path, one in found.items() if path.startswith(CAMERA)})
            own.append({path: one for path, one in found.items() if not path.startswith(CAMERA)})

        def pull(gradient: Mapping[str, F64], view: int) -> dict[str, F64]:
            frame, out = self._of_views[view], {}
            for path, numbers in values.items():
                out[path] = np.zeros_like(numbers)
                out[path][frame] = self._pulled(path, numbers[frame], np.asarray(gradient[path], np.float64))
            return out

        return Placement(dict(values), {}, cameras, [list(values)] * len(cameras), pull, own)

    def _pulled(self, path: str, numbers: F64, gradient: F64) -> F64:
        if path not in self._pivots:
            return gradient.ravel()
        out = np.zeros(6)
        for k, step in enumerate(np.diag(np.full(6, STEP))):
            slope = (self.value(path, numbers + step) - self.value(path, numbers - step)) / (2.0 * STEP)
            out[k] = np.vdot(gradient, slope)
        return out

    def state(self) -> State:
        """Return nothing, since what follows depends on the values alone."""
        return {}

    def restore(self, state: State) -> None:
        """Take over what `state` has returned."""

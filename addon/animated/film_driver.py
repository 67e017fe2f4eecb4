"""Blender as the owner of the variables of a film: it is evaluated at each frame, with the values of that frame.

A keyed property keeps a value that is set until the next change of the frame. So each frame is made the current one,
and its values are set there; keys are written after the fit only. At the end, the frame of the file is set back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from edgegrad.derivatives.table_derivatives import without_derivative
from edgegrad.fitting.driven import Numbers
from edgegrad.fitting.film.keyed import KeyedNumbers
from edgegrad.scene.changes import StructureChange

from ..evaluation import Evaluation, evaluate
from ..export import Export
from ..problem import Problem
from .arrays import CAMERA, F64, Key, moved, value_of
from .driver import Driver, Placed, pulled
from .parameter import Wanted
from .quotients import Prober, Quotient

# Changes of the properties since their difference quotients were found, in first steps, up to which these are kept.
# A first step changes the arrays by about 2 %, so the gradient changes its direction by about as much.
KEPT_WITHIN = 1.0
# Bytes of kept quotients.
MOST_KEPT = 1 << 28


@dataclass(frozen=True)
class Shot:
    """What a picture of a film shows.

    Attributes
    ----------
    frame
        Frame number.
    camera
        Index of the camera.
    """

    frame: int
    camera: int


@dataclass(frozen=True)
class _Frame:
    """An evaluated frame: the export, and the difference quotients of each property."""

    base: Export
    quotients: Mapping[str, Sequence[Quotient]]


class FilmDriver(Driver):
    """The properties of a fit of a film.

    Parameters
    ----------
    scene, cameras, wanted
        As for `Driver`; each camera once.
    shots
        What each picture shows.

    Attributes
    ----------
    times
        The frames in their order.
    """

    film = True

    def __init__(self, scene: Any, cameras: Sequence[Any], wanted: Sequence[Wanted], shots: Sequence[Shot]) -> None:
        self.shots, self.times = list(shots), sorted({shot.frame for shot in shots})
        self._own: set[Key] = set()  # arrays that are not those of the first frame
        # Difference quotients by frame, with the values at which they were found; None: to be found there again
        self._kept_quotients: dict[int, tuple[dict[str, F64], Mapping[str, Sequence[Quotient]] | None]] = {}
        with frames_kept(scene):
            scene.frame_set(self.times[0])
            super().__init__(scene, cameras, wanted)
            starts: dict[str, list[F64]] = {one.path: [] for one in self.parameters if one.keyed}
            for frame in self.times if starts else ():
                scene.frame_set(frame)
                for one in self.parameters:
                    if one.keyed:
                        starts[one.path].append(one.read())
        every = np.ones((len(self.times), 1))
        self.variables = []
        for one in self.parameters:
            found = one.variable()
            if one.keyed:
                found = KeyedNumbers(one.path, np.array(starts[one.path]), every * found.steps, every * found.low,
                                     every * found.high)  # fmt: skip
                if (found.value < found.low).any() or (found.value > found.high).any():
                    raise Problem(f"property '{one.path}': leaves its limits between frames {self.times[0]} and "
                                  f"{self.times[-1]}; move its keys between them")  # fmt: skip
            self.variables.append(found)
        assert self._start is not None
        numbers = sum(len(one.places) for one in self.parameters) * len(self.times)
        size = sum(mesh.vertices.size for mesh in self._start.scene.meshes.values())
        self._keeps = 8 * numbers * size <= MOST_KEPT

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `state` has returned."""
        super().restore(state)
        self._kept_quotients = {int(frame): (dict(values), None) for frame, values in state["kept"].items()}

    def place(self, values: Mapping[str, F64], views: Sequence[int] | None = None) -> Placed:
        """Evaluate Blender at the frames of some pictures, and return what follows."""
        self._begin_placement()
        self._before["kept"] = {str(frame): values for frame, (values, _) in self._kept_quotients.items()}
        if self._is_check:  # its steps may change
            self._kept_quotients.clear()
        wanted = range(len(self.shots)) if views is None else views
        frames: dict[int, _Frame] = {}
        shared: dict[str, F64] = {}
        with frames_kept(self.scene):
            for frame in sorted({self.shots[j].frame for j in wanted}):
                check = self._is_check and not frames
                frames[frame], now = self._at(frame, values, check)
                shared = shared or now
        placed = {path: value if self._keyed(path) else shared[path] for path, value in values.items()}
        return self._placement(placed, frames)

    def export_frame(self, values: Mapping[str, F64], view: int) -> Export:
        """Export the scene as a picture shows it with these values."""
        shot = self.shots[view]

        def work(evaluation: Evaluation) -> Export:
            with self._kept():
                self._set(self._values_at(values, shot.frame))
                return self._export(evaluation)

        with frames_kept(self.scene):
            self.scene.frame_set(shot.frame)
            found = evaluate(self.scene, work, self.cameras[0])
        found.scene.camera = found.views[shot.camera]
        return found

    def _keyed(self, path: str) -> bool:
        return any(one.keyed for one in self.parameters if one.path == path)

    def _values_at(self, values: Mapping[str, F64], frame: int) -> dict[str, F64]:
        k = self.times.index(frame)
        return {path: value[k] if self._keyed(path) else value for path, value in values.items()}

    def _at(self, frame: int, values: Mapping[str, F64], check: bool) -> tuple[_Frame, dict[str, F64]]:
        """Evaluate a frame; return it, and the values that the properties have there."""

        def work(evaluation: Evaluation) -> tuple[_Frame, dict[str, F64]]:
            assert self._start is not None
            with self._kept():
                self._set(self._values_at(values, frame))
                base = self._export(evaluation)
                try:
                    self._own.update(moved(self._start, base))
                except StructureChange as change:
                    raise Problem(f"frame {frame}: {change} after frame {self.times[0]}; a film needs the same "
                                  "objects and faces in all frames, so choose fewer frames") from None  # fmt: skip
                now = {one.path: one.read() for one in self._owned}
                return _Frame(base, self._quotients_near(evaluation, frame, base, now, check)), now

        self.scene.frame_set(frame)
        return evaluate(self.scene, work, self.cameras[0])

    def _quotients_near(self, evaluation: Evaluation, frame: int, base: Export, now: dict[str, F64],
                        check: bool) -> Mapping[str, Sequence[Quotient]]:  # fmt: skip
        """Return the difference quotients of a frame: those found before, if the values have hardly changed."""
        known = self._kept_quotients.get(frame)
        steps = {one.path: np.atleast_2d(one.steps)[0] for one in self.variables if isinstance(one, Numbers)}
        near = known is not None and not check and all(
            (np.abs(now[path] - known[0][path]) <= KEPT_WITHIN * steps[path]).all() for path in steps)
        if known is not None and near and known[1] is not None:
            return known[1]
        at = known[0] if known is not None and near else now
        if at is not now:  # found before a checkpoint
            self._set(at)
            base = self._export(evaluation)
        found = self._quotients(Prober(lambda: self._export(evaluation), base), check)
        if self._keeps:
            self._kept_quotients[frame] = at, found
        return found

    def _placement(self, values: dict[str, F64], frames: Mapping[int, _Frame]) -> Placed:
        self._own.update(key for frame in frames.values() for of in frame.quotients.values() for quotient in of
                         for key in quotient)  # fmt: skip
        own, cameras, paths = list[dict[str, Any]](), list[dict[str, Any]](), list[list[str]]()
        for shot in self.shots:
            frame = frames.get(shot.frame)
            seen = [] if frame is None else sorted(key for key in self._own if key[0] in (-1, shot.camera))
            base = None if frame is None else frame.base
            own.append({key[1]: value_of(base, key) for key in seen if key[0] < 0} if base is not None else {})
            cameras.append({key[1][len(CAMERA) :]: getattr(base.views[shot.camera], key[1][len(CAMERA) :])
                            for key in seen if key[0] >= 0} if base is not None else {})  # fmt: skip
            moving = {} if frame is None else {key for of in frame.quotients.values() for one in of for key in one}
            paths.append([path for of, path in sorted(moving)
                          if of in (-1, shot.camera) and without_derivative(path) is None])  # fmt: skip

        def pull(gradient: Mapping[str, F64], view: int) -> dict[str, F64]:
            shot, out = self.shots[view], {}
            for path, of_path in frames[shot.frame].quotients.items():
                out[path] = found = pulled(gradient, of_path, shot.camera)
                if self._keyed(path):
                    out[path] = np.zeros((len(self.times), len(found)))
                    out[path][self.times.index(shot.frame)] = found
            return out

        return Placed(values, {}, cameras, paths, pull, own)


@contextmanager
def frames_kept(scene: Any) -> Iterator[None]:
    """Set the scene's frame back after the block."""
    frame, part = scene.frame_current, scene.frame_subframe
    try:
        yield
    finally:
        scene.frame_set(frame, subframe=part)

"""Coarse pictures of a fit, cheap enough to try many starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...images.resampling import resample
from ...scene import parameters
from ...scene.camera import Camera
from ..driven import Looking
from ..gains import Gains
from ..losses import Pyramid
from ..run import Run
from ..targets import View
from .moves import Moves

F64 = NDArray[np.float64]

# Pixels along the shorter side, samples of each, and levels of the pyramid: its coarsest level has three pixels. Its
# coarse levels weigh more: there an object far from its place already costs less than one that is not seen.
SIDE, SAMPLES, LEVELS, FOCUS = 24, 16, 4, 0.25


def moves_of(run: Run) -> Moves:
    """Return what a search moves, from where the fit is now."""
    scene = replace(run.work, camera=replace(run.work.camera),
                    meshes={name: replace(one) for name, one in run.work.meshes.items()},
                    fields={name: replace(one) for name, one in run.work.fields.items()},
                    lights={name: replace(one) for name, one in run.work.lights.items()})  # fmt: skip
    return Moves(scene, [*run.unknowns, *run.variables], run.values())


class Coarse:
    """The loss of coarse pictures, by a vector of `Moves`."""

    def __init__(self, run: Run, moves: Moves) -> None:
        self._run, self._moves = run, moves
        self._start = {item.path: item.value for item in run.variables}
        self._seen = [_coarse(view) for view in run.seen]
        self._gains = Gains(self._seen)
        self._loss = Pyramid(LEVELS, focus=FOCUS)

    def loss(self, vector: F64) -> float:
        """Bring the scene to the moved values, and return the loss of its pictures; infinite if there are none."""
        if not self._place(self._moves.at(vector)):
            return np.inf
        run, pictures = self._run, {}
        for j, view in enumerate(self._seen):
            run.see(j)
            camera = _smaller(run.seen[j].camera, view.image.shape)
            halves = 2 if isinstance(view.gain, str) else 1
            pictures[j] = tuple(
                run.renderer_of(j).render(spp=SAMPLES // halves, **run.limits_of(j), seed=run.seed_of(0, j, 11 + half),
                                          camera=camera) for half in range(halves))  # fmt: skip
        if not all(np.isfinite(half).all() for of in pictures.values() for half in of):
            return np.inf

        def adjoint(view: View, image: NDArray[Any]) -> NDArray[Any]:
            return np.asarray(self._loss(image, view.image, view.mask)[1])

        total, gains = 0.0, self._gains.find(adjoint, pictures)
        for j, view in enumerate(self._seen):
            image = np.mean(pictures[j], axis=0) * (gains[j] if isinstance(view.gain, str) else 1.0)
            total += view.weight * self._loss(image.astype(np.float32), view.image, view.mask)[0]
        return total / len(self._seen)

    def take(self, vector: F64, others: Mapping[str, F64] | None = None) -> None:
        """Bring the scene, and the driven variables, to the moved values, and other parameters to `others`."""
        self._run.bring_to({**(others or {}), **self._start, **self._moves.at(vector)})

    def _place(self, values: Mapping[str, F64]) -> bool:
        run, changed = self._run, self._put(values)
        if run.driven is not None:
            assert isinstance(run.driven, Looking)
            own = {path: value for path, value in values.items() if path in self._start}
            found = run.driven.look(self._start | own)
            if found is None:
                return False
            for view, fields in zip(run.seen, found.cameras, strict=True):
                for name, value in fields.items():
                    setattr(view.camera, name, value)
            for path, value in found.parameters.items():
                parameters.put(run.work, path, value)
            changed += list(found.parameters)
        run.update(changed)
        return True

    def _put(self, values: Mapping[str, F64]) -> list[str]:
        own = [path for path in values if path not in self._start]
        for path in own:
            parameters.put(self._run.work, path, values[path])
        return own


def _coarse(view: View) -> View:
    """A view of a small picture; of a cropped camera, the view itself."""
    height, width = view.image.shape[:2]
    factor = min(height, width) / SIDE
    if factor <= 1.0 or view.camera.crop is not None:
        return view
    size = max(1, round(height / factor)), max(1, round(width / factor))
    if view.mask is None:
        return replace(view, image=resample(view.image, size).astype(np.float32))
    # The mean of each area's pixels that count.
    mask = resample(view.mask, size)
    image = resample(view.image * view.mask[..., None], size) / np.where(mask > 0.0, mask, 1.0)[..., None]
    return replace(view, image=image.astype(np.float32), mask=mask)


def _smaller(camera: Camera, shape: tuple[int, ...]) -> Camera:
    """The camera as it is now, with pixels of another size that cover the same picture."""
    high, wide = shape[:2]
    if camera.size == (high, wide):
        return camera
    return replace(camera.of_size(high, wide), filter="BOX", filter_width=1.0)

"""A fit as a job: its losses and pictures, and the shapes that it has reached."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import images
from edgegrad.fitting.checkpoints.checkpoint_file import CheckpointError
from edgegrad.images.code_values import write_codes

from ..session import Session
from ..write_back.destinations import PixelsOf
from .job import RESTORE, Job

# Iterations at each end of the recent losses whose means give the trend.
TREND_OVER = 10
# Seconds between two pictures of the difference, and how much longer than its making they must be apart.
NEWS_SECONDS, SHARE = 1.0, 20.0
# Relative change of the loss below which it counts as constant.
CONSTANT = 0.01


class FitJob(Job):
    """A fit in a thread.

    Attributes
    ----------
    session
        The prepared fit.
    step
        The last step; None: there was none.
    losses
        Of all iterations so far.
    file
        File to which the picture of the difference is written now and then.
    textures
        Files to which the pixels of fitted images are written then, by the names of the images that show them.
    checkpoint
        File that keeps the state until the fit ends; None: none does. If it is there, and of the same fit, the fit goes
        on from it.
    """

    def __init__(self, session: Session, file: Path, checkpoint: Path | None = None) -> None:
        super().__init__("Fit", self._fit)
        self.file, self.checkpoint = file, checkpoint
        self.session = session
        places = {path: place for path, place in session.destinations.items() if isinstance(place, PixelsOf)}
        self._pixels = {path: (f"Edgegrad {place.image.name}", place.codes) for path, place in places.items()}
        self.textures = {name: file.with_name(f"Edgegrad Pixels {k}.png")
                         for k, (name, _) in enumerate(self._pixels.values())}  # fmt: skip
        self.step: edgegrad.FitStep | None = None
        self.losses: list[float] = []
        self.began = 0  # iterations before this run
        self._waited = 0.0  # seconds of pauses and waits
        self._waits_since = 0.0
        self._drawn = self._told = 0
        self._due = 0.0

    def _fit(self, _: Job) -> Any:
        checkpoint = self.checkpoint
        if checkpoint is None:
            return self.session.run(callback=self._tell, progress=self.check)
        try:
            result = self._run_from(checkpoint, checkpoint.exists())
        except CheckpointError:  # damaged, or of another fit, which would have to begin anew too
            result = self._run_from(checkpoint, resume=False)
        # What ends a fit without the user's wish, as Blender's end does, leaves the state.
        if not self.reason:
            checkpoint.unlink(missing_ok=True)
        return result

    def _run_from(self, checkpoint: Path, resume: bool) -> Any:
        return self.session.run(callback=self._tell, progress=self.check, checkpoint=checkpoint, resume=resume)

    @property
    def notes(self) -> list[str]:
        """Sentences on how the fit began."""
        if not self.began:
            return []
        return [f"the fit went on after iteration {self.began} of the one that had not ended; its state was in "
                f"'{self.checkpoint}'"]  # fmt: skip

    def _tell(self, step: edgegrad.FitStep) -> str | None:
        if self.step is None:
            self.began = step.iteration - 1
        self.losses.append(step.loss)
        self.step = step
        if time.monotonic() >= self._due:
            self.draw()
        began = time.monotonic()
        self.wait_while_paused()
        self._waited += time.monotonic() - began
        return self.ending

    def serve(self, occupied: str = "", seconds: float = 0.0) -> None:
        relay = self.session.relay
        if relay is None:
            return
        # An evaluation beside a render would fail, and the fit would lose what it has reached.
        waits_for = occupied if relay.wanted else ""
        if waits_for and not self.waits_for:
            self._waits_since = time.monotonic()
        elif self.waits_for and not waits_for:
            self._waited += time.monotonic() - self._waits_since
        self.waits_for = waits_for
        if not occupied:
            self.session.serve(seconds)

    def end(self, how: str, reason: str = "") -> None:
        super().end(how, reason)
        if how == RESTORE and self.session.relay is not None:
            self.session.relay.close()  # a thread that waits for the end of a render would not see it

    def wait(self) -> None:
        """Wait until the thread has ended; Blender is no longer evaluated for it."""
        if self.session.relay is not None:
            self.session.relay.close()
        super().wait()

    # ---- what the panel shows ----
    @property
    def pace(self) -> float:
        """Seconds of each iteration, without pauses and waits; 0 before the first."""
        step = self.step
        return 0.0 if step is None else max(step.seconds - self._waited, 0.0) / step.iteration

    def news(self) -> bool:
        """Whether there is a picture that was not shown yet."""
        told, self._told = self._told, self._drawn
        return self._drawn != told

    def draw(self) -> None:
        """Write a false-color picture of render minus target, for the last target that was rendered, and pixels."""
        began, step = time.monotonic(), self.step
        if step is None:
            return
        # A picture that can't be written must not end the fit.
        with contextlib.suppress(OSError):
            write_codes(self.file, images.derivative_image(step.picture - step.target))
            for path, (name, codes) in self._pixels.items():
                pixels = np.clip(step.values[path], 0.0, 1.0)
                shown = pixels if codes else images.linear_to_srgb(pixels)
                write_codes(self.textures[name], (255.0 * shown + 0.5).astype(np.uint8))
        self._drawn = step.iteration
        ended = time.monotonic()
        self._due = ended + max(NEWS_SECONDS, SHARE * (ended - began))

    @property
    def moves_shapes(self) -> bool:
        """Whether the fit may move meshes, which `shapes` returns; those that properties move are not known before."""
        session = self.session
        return (session.relay is not None or session.field is not None
                or any(path.startswith("meshes.") for path in session.wrt))  # fmt: skip

    def shapes(self) -> dict[str, NDArray[np.float64]]:
        """World-space vertices of the exported meshes that the fit has moved, by name."""
        scene, moved = self.session.export.scene, {}
        relay = self.session.relay
        latest: dict[str, Any] = {} if relay is None or relay.latest is None else dict(relay.latest.parameters)
        latest |= {} if self.step is None else {
            path: value for path, value in self.step.values.items() if path.startswith("meshes.")}  # fmt: skip
        for name, mesh in scene.meshes.items():
            vertices, matrix = latest.get(f"meshes.{name}.vertices"), latest.get(f"meshes.{name}.transform")
            if vertices is None and matrix is None:
                continue
            points = np.asarray(mesh.vertices if vertices is None else vertices)
            matrix = np.asarray(mesh.transform if matrix is None else matrix)
            moved[name] = points @ matrix[:3, :3].T + matrix[:3, 3]
        return moved


def trend(losses: list[float]) -> str:
    """Arrow for the change of the loss over the last iterations."""
    if len(losses) < 2:
        return ""
    count = min(TREND_OVER, len(losses) // 2)
    before, after = np.mean(losses[-2 * count : -count]), np.mean(losses[-count:])
    if abs(after - before) <= CONSTANT * abs(before):
        return "→"
    return "↓" if after < before else "↑"


def duration(seconds: float) -> str:
    """Write a time as a person reads it."""
    if seconds < 10.0:
        return f"{seconds:.2g} s"
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"


def fit_text(job: FitJob) -> str:
    """Text of the progress bar of a fit."""
    step = job.step
    if job.waits_for:
        done = "" if step is None else f"{step.iteration} / {step.iterations}   "
        return f"{done}Waiting for the end of {job.waits_for}"
    if step is None:
        return "Trying several starts" if job.session.request.restarts else "First iteration"
    if step.iteration == step.iterations:  # the rest takes a while, and no iteration tells how long
        return f"{step.iteration} / {step.iterations}   finishing"
    left = (step.iterations - step.iteration) * job.pace
    if job.session.request.film is not None and job.fraction > 0.0:  # whose last iterations take longest
        left = job.pace * step.iteration * (1.0 / job.fraction - 1.0)
    return f"{step.iteration} / {step.iterations}   {duration(job.pace)} each   {duration(left)} left"

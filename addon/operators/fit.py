"""The operator edgegrad.fit, and those that pause and end it."""

from __future__ import annotations

from typing import Any

import bpy

from ..problem import Problem
from ..properties import request
from ..rows import in_words, remember_effects
from ..running import kept_state
from ..running.fit_job import FitJob, duration
from ..running.guard import Guard
from ..running.job import BEST, RESTORE, Job
from ..session import Request, Session
from ..status import STATUS
from . import _common
from .background import InBackground

DIFFERENCE = "Edgegrad Difference"


class RunsFit(InBackground):
    """Part of the operators that run a fit; Blender does not allow that an operator inherits from another."""

    report: Any  # of Blender's Operator
    _scene_name = ""

    def requested(self, context: Any) -> Request:
        """Return the fit that is set in the panel."""
        return request(context)

    def prepare(self, context: Any) -> tuple[Job, Guard | None]:
        session = Session.prepare(context, self.requested(context))
        self._scene_name = context.scene.name
        _common.tell(self, session.export.report, session.notes)
        guard = Guard(session, context.scene)
        problem = guard.problem()
        if problem is not None:
            raise Problem(f"a fit can't start, since {problem}; leave that mode first")
        # Fields have a state of their own, which checkpoints do not keep.
        kept = None if session.field is not None else kept_state.file_for(context.scene)
        return FitJob(session, _common.file_of(DIFFERENCE, ".png"), kept), guard

    def _scene(self) -> Any:
        """Return the scene of the fit, whichever the window shows; by its name, since an undo makes a new one."""
        return bpy.data.scenes.get(self._scene_name)

    def _show_progress(self, context: Any, job: Any) -> None:
        show_state(self._scene(), job)

    def finish(self, context: Any, job: Job) -> set[str]:
        assert isinstance(job, FitJob)
        job.session.write(job.result)
        for sentence in job.session.unwritten:
            _common.say(self, "ERROR", sentence)
        job.draw()
        show_state(self._scene(), job)
        notes = [*job.notes, *job.session.notes, *job.result.notes, *job.session.late_notes]
        scene = self._scene()
        _common.tell(self, job.session.export.report, notes if scene is None else in_words(scene, job.session, notes))
        losses = job.result.losses
        said = f"loss {losses[0]:.4g} → {losses[job.result.best]:.4g} in {duration(job.result.seconds)}"
        if job.step is not None:
            said += f", {job.step.iteration} iterations"
        return _common.done(self, said)


class Fit(RunsFit, bpy.types.Operator):
    """Change the chosen parameters until the pictures match their targets. Esc: back to the start"""

    bl_idname = "edgegrad.fit"
    bl_label = "Fit"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012


def show_state(scene: Any, job: FitJob) -> None:
    """Show the sensitivities in the fit's scene after the first iteration, and the newest picture of the difference."""
    if job.step is None or not job.news():
        return
    asked = job.session.request
    if job.session.field is None:  # the pictures of fields take another time than those of other fits
        STATUS.cost = job.pace / (asked.samples * (asked.views_per_iteration or len(job.session.targets)))
    if scene is not None:
        remember_effects(scene, job.session, job.step.effects)
    for name, file in {DIFFERENCE: job.file, **job.textures}.items():
        if file.is_file():
            _common.show_file(name, file, open_editor=False)


class _Running:
    """Operator on the running fit."""

    bl_options = {"INTERNAL"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        return STATUS.job is not None


class Pause(_Running, bpy.types.Operator):
    """Let the fit wait after its present iteration, or go on"""

    bl_idname = "edgegrad.fit_pause"
    bl_label = "Pause"

    def execute(self, context: Any) -> set[str]:
        assert STATUS.job is not None
        STATUS.job.pause(not STATUS.job.paused)
        return {"FINISHED"}


class Stop(_Running, bpy.types.Operator):
    """End the fit after its present iteration, and keep the best values so far"""

    bl_idname = "edgegrad.fit_stop"
    bl_label = "Stop"

    def execute(self, context: Any) -> set[str]:
        assert STATUS.job is not None
        STATUS.job.end(BEST)
        return {"FINISHED"}


class Cancel(_Running, bpy.types.Operator):
    """End what is running and go back to the start, as Esc does"""

    bl_idname = "edgegrad.cancel"
    bl_label = "Cancel"

    def execute(self, context: Any) -> set[str]:
        assert STATUS.job is not None
        STATUS.job.end(RESTORE)
        return {"FINISHED"}


class ShowDifference(bpy.types.Operator):
    """Show the picture of the difference, render minus target, in an Image Editor: red is too bright, blue too dark"""

    bl_idname = "edgegrad.show_difference"
    bl_label = "Difference"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        return DIFFERENCE in bpy.data.images

    def execute(self, context: Any) -> set[str]:
        _common.open_image(bpy.data.images[DIFFERENCE])
        return {"FINISHED"}


CLASSES: tuple[Any, ...] = (Fit, Pause, Stop, Cancel, ShowDifference)

"""The operator edgegrad.fit."""

from __future__ import annotations

import threading
from typing import Any

import bpy

import edgegrad

from ..properties import request
from ..session import Request, Session
from ..status import STATUS, redraw
from . import _common

POLL_SECONDS = 0.1
# A fit of animatable properties waits in each iteration until Blender is evaluated for it.
SERVE_SECONDS = 0.01
# Events that pass to Blender while a fit runs: the user may navigate, but not edit.
NAVIGATION = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "TRACKPADPAN", "TRACKPADZOOM"}


class Job:
    """A fit in its own thread, which does not access Blender's data."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.step: Any = None
        self.result: Any = None
        self.error: BaseException | None = None
        self.stop_as: str | None = None  # "restore" or "best"
        self.fraction = 0.0
        self._thread = threading.Thread(target=self._run, name="edgegrad.fit", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self.result = self.session.run(callback=self._tell, progress=self._check)
        except BaseException as error:  # the operator reports it: Python drops exceptions of threads
            self.error = error

    def _tell(self, step: Any) -> str | None:
        self.step = step
        return self.stop_as

    def _check(self, fraction: float) -> None:
        """Cancel the fit if requested. It is called many times per iteration, so a cancellation takes effect soon."""
        self.fraction = fraction
        if self.stop_as == "restore":
            raise edgegrad.Cancelled

    @property
    def running(self) -> bool:
        """Whether the thread is alive."""
        return self._thread.is_alive()

    def wait(self) -> None:
        """Wait until the thread has ended; Blender is no longer evaluated for it."""
        if self.session.relay is not None:
            self.session.relay.close()
        self._thread.join()


class RunsFit:
    """Part of the operators that run a fit; Blender does not allow that an operator inherits from another."""

    report: Any  # of Blender's Operator
    _job: Job | None = None

    def requested(self, context: Any) -> Request:
        """Return the fit that is set in the panel."""
        return request(context)

    def execute(self, context: Any) -> set[str]:
        """Run the fit while Blender waits (background mode, scripts)."""
        try:
            session = Session.prepare(context, self.requested(context))
            result = session.run()
            session.write(result)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        for sentence in session.unwritten:
            self.report({"ERROR"}, sentence)
        _common.tell(self, session.export.report, [*result.notes, *session.late_notes])
        self.report({"INFO"}, f"loss {result.losses[0]:.4g} -> {result.losses[result.best]:.4g}")
        return {"FINISHED"}

    def invoke(self, context: Any, _: Any) -> set[str]:
        """Run the fit in a thread, with a progress bar, until it ends or the user stops it."""
        try:
            session = Session.prepare(context, self.requested(context))
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        _common.tell(self, session.export.report, session.notes)
        self._job = Job(session)
        manager = context.window_manager
        poll = POLL_SECONDS if self._job.session.driver is None else SERVE_SECONDS
        self._timer = manager.event_timer_add(poll, window=context.window)
        manager.progress_begin(0, session.request.iterations)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        job = self._job
        assert job is not None
        if event.type == "ESC" and event.value == "PRESS":
            job.stop_as = "restore"
        elif event.type in ("RET", "NUMPAD_ENTER") and event.value == "PRESS":
            job.stop_as = "best"
        if event.type == "TIMER":
            job.session.serve()
            if not job.running:
                return self._finish(context, job)
            self._show_progress(context, job)
        return {"PASS_THROUGH"} if event.type in NAVIGATION else {"RUNNING_MODAL"}

    def cancel(self, context: Any) -> None:
        """Stop the fit, since Blender closes or loads another file."""
        if self._job is not None:
            self._job.stop_as = "restore"
            self._job.wait()
            self._clean_up(context)

    def _finish(self, context: Any, job: Job) -> set[str]:
        self._clean_up(context)
        if job.error is not None:
            return _common.refuse(self, job.error)
        if job.stop_as == "restore":
            self.report({"INFO"}, "cancelled; nothing was changed")
            return {"CANCELLED"}
        try:
            job.session.write(job.result)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        for sentence in job.session.unwritten:
            self.report({"ERROR"}, sentence)
        _common.tell(self, job.session.export.report, [*job.result.notes, *job.session.late_notes])
        self.report({"INFO"}, f"loss {job.result.losses[0]:.4g} -> {job.result.losses[job.result.best]:.4g}")
        return {"FINISHED"}

    def _show_progress(self, context: Any, job: Job) -> None:
        step = job.step
        if step is None:
            text = "First iteration"
        else:
            context.window_manager.progress_update(step.iteration)
            text = (f"{step.iteration} / {step.iterations}   {step.seconds / step.iteration:.2g} s each   "
                    f"loss {step.smoothed:.4g}")  # fmt: skip
        if job.stop_as is not None:
            text += "   stopping"
        STATUS.fraction, STATUS.text = job.fraction, text
        redraw()
        context.workspace.status_text_set(f"Edgegrad: {text}   Esc: cancel   Enter: stop and keep the best")

    def _clean_up(self, context: Any) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
        STATUS.fraction = None
        redraw()
        self._job = None


class Fit(RunsFit, bpy.types.Operator):
    """Change the chosen parameters until the pictures match their targets. Esc: cancel; Enter: stop, keep the best"""

    bl_idname = "edgegrad.fit"
    bl_label = "Fit"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

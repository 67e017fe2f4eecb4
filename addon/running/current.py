"""The one job that may run: its timer, and the handlers that end it when it can no longer be right."""

from __future__ import annotations

import time
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..evaluation import occupied_by
from ..status import STATUS, redraw
from . import overlay
from .fit_job import FitJob, fit_text, trend
from .guard import Guard
from .job import RESTORE, Job

POLL_SECONDS = 0.1
# A fit of animatable properties waits in each iteration until Blender is evaluated for it.
SERVE_SECONDS = 0.01
# Each evaluation has Blender draw the window. Where that is slow, the fit would get one evaluation in each redraw; it
# gets as much time as the redraw took, up to this many seconds.
MOST_SERVED = 0.5


class _Held:
    """What a running job has in Blender, to be given back when it ends."""

    guard: Guard | None = None
    timer: Any = None
    due = 0.0
    left = 0.0  # when the last poll ended


_HELD = _Held()


def begin(context: Any, job: Job, guard: Guard | None = None) -> None:
    """Start a job, its timer, and the handlers."""
    assert STATUS.job is None, "one job at a time"
    STATUS.job, STATUS.said, STATUS.failed = job, "", False
    _HELD.left = time.monotonic()
    _HELD.guard = guard
    overlay.begin(context.scene)
    serves = isinstance(job, FitJob) and job.session.relay is not None
    _HELD.timer = context.window_manager.event_timer_add(SERVE_SECONDS if serves else POLL_SECONDS,
                                                         window=context.window)  # fmt: skip
    for handlers, handler in _HANDLERS:
        handlers.append(handler)
    job.start()


def poll(context: Any) -> bool:
    """Serve the job, look whether it can still be right, and show its progress; return whether it has ended."""
    job = STATUS.job
    if job is None:
        return True
    running = job.running  # what changes after its end is seen, too, before the result is written
    problem = None if _HELD.guard is None or job.ending == RESTORE else _HELD.guard.problem(last=not running)
    if problem is not None:
        job.end(RESTORE, problem)
    job.serve(occupied_by(), min(time.monotonic() - _HELD.left, MOST_SERVED))
    _HELD.left = time.monotonic()
    if not running:
        return True
    if time.monotonic() < _HELD.due:
        return False
    _HELD.due = time.monotonic() + POLL_SECONDS
    overlay.update(job)
    context.workspace.status_text_set(f"Edgegrad: {text_of(job)}   Esc: back to the start")
    redraw()
    return False


def text_of(job: Job) -> str:
    """Return what a running job does, in a line."""
    if not isinstance(job, FitJob):
        return f"{job.label}   {job.fraction:.0%}"
    loss = "" if job.step is None else f"   loss {job.step.smoothed:.4g} {trend(job.losses)}"
    state = "   ending" if job.ending is not None else "   paused" if job.paused and not job.waits_for else ""
    return fit_text(job) + loss + state


def close() -> None:
    """Give back what the job has in Blender. It may be called again."""
    job = STATUS.job
    STATUS.job = None
    if job is None:
        return
    manager = bpy.context.window_manager
    if _HELD.timer is not None and manager is not None:
        manager.event_timer_remove(_HELD.timer)
    _HELD.guard = _HELD.timer = None
    for handlers, handler in _HANDLERS:
        if handler in handlers:
            handlers.remove(handler)
    overlay.remove()
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(None)
    redraw(all_regions=True)


def shut_down(reason: str) -> None:
    """End the job, if one runs, and wait for it: Blender closes, loads another file, or disables the add-on."""
    job = STATUS.job
    if job is None:
        return
    job.end(RESTORE, reason)
    job.wait()
    close()
    STATUS.ended(sentence(job), failed=True)


def sentence(job: Job) -> str:
    """Say that a job was ended and why."""
    why = f", since {job.reason}" if job.reason else ""
    return f"{job.label} ended{why}; nothing was changed"


@persistent
def _undone(*_: Any) -> None:
    if STATUS.job is not None:
        STATUS.job.end(RESTORE, "undo or redo changed the scene")
        _HELD.guard = None  # its references are no longer valid


@persistent
def _loading(*_: Any) -> None:
    shut_down("another file was opened")


_HANDLERS = (
    (bpy.app.handlers.undo_post, _undone),
    (bpy.app.handlers.redo_post, _undone),
    (bpy.app.handlers.load_pre, _loading),
)

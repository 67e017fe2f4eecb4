"""What operators share whose work runs in a thread while Blender stays usable."""

from __future__ import annotations

from typing import Any

from ..running import current
from ..running.guard import Guard
from ..running.job import RESTORE, Job
from ..status import STATUS
from . import _common


class InBackground:
    """Operator whose `prepare` reads Blender's data and returns a job, and whose `finish` shows the result.

    Called by a button it is modal: every event passes through to Blender but Esc, which drops the result.
    """

    _job: Job | None = None

    @classmethod
    def poll(cls, context: Any) -> bool:
        if STATUS.job is not None:
            cls.poll_message_set(f"{STATUS.job.label} is running; stop it first")  # type: ignore[attr-defined]
            return False
        return getattr(context, "scene", None) is not None

    def prepare(self, context: Any) -> tuple[Job, Guard | None]:
        """Read Blender's data; raise a `Problem` for what the user can correct."""
        raise NotImplementedError

    def finish(self, context: Any, job: Job) -> set[str]:
        """Show or write the result."""
        raise NotImplementedError

    def execute(self, context: Any) -> set[str]:
        """Do the work while Blender waits (background mode, scripts)."""
        try:
            job, _ = self.prepare(context)
            job.start().wait()
        except _common.EXPECTED as error:
            return _common.failed(self, error)
        return self._ended(context, job)

    def invoke(self, context: Any, _: Any) -> set[str]:
        """Do the work in a thread."""
        try:
            self._job, guard = self.prepare(context)
        except _common.EXPECTED as error:
            return _common.failed(self, error)
        current.begin(context, self._job, guard)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        if self._job is None or STATUS.job is not self._job:  # it was shut down
            self._clean_up(context)
            return {"CANCELLED", "PASS_THROUGH"}
        if event.type == "ESC" and event.value == "PRESS":
            self._job.end(RESTORE)
            return {"RUNNING_MODAL"}
        if event.type == "TIMER":
            job = self._job
            if current.poll(context):
                current.close()
                self._clean_up(context)
                return self._ended(context, job)
            self._show_progress(context, job)
        return {"PASS_THROUGH"}

    def cancel(self, context: Any) -> None:
        """Stop the work, since Blender closes its window or loads another file."""
        if STATUS.job is self._job:
            current.shut_down("its window was closed")
        self._clean_up(context)

    def _show_progress(self, context: Any, job: Any) -> None:
        """Show more of a running job than its bar."""

    def _clean_up(self, context: Any) -> None:
        """Give back what `invoke` or `_show_progress` has taken; the job has ended. It may be called again."""

    def _ended(self, context: Any, job: Job) -> set[str]:
        if job.error is not None:
            if isinstance(job.error, _common.EXPECTED):
                return _common.failed(self, job.error)
            STATUS.ended(str(job.error), failed=True)
            raise job.error
        if job.ending == RESTORE:
            said = current.sentence(job)
            STATUS.ended(said, failed=bool(job.reason))
            _common.say(self, "WARNING" if job.reason else "INFO", said)
            return {"CANCELLED"}
        try:
            return self.finish(context, job)
        except _common.EXPECTED as error:
            return _common.failed(self, error)

"""Work in a thread of its own, which can be paused and ended; the thread does not access Blender's data."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import edgegrad

RESTORE, BEST = "restore", "best"


class Job:
    """Work in a thread.

    Parameters
    ----------
    label
        Name of the work in messages, such as "Fit".
    work
        Gets the job, and returns the result. It calls `check` many times.

    Attributes
    ----------
    fraction
        Completed fraction.
    result, error
        What the work returned or raised; None: nothing.
    ending
        How the work was asked to end: `RESTORE` drops its result, `BEST` keeps the best values so far; None: not asked.
    reason
        Why it was ended, if not by the user; a sentence.
    paused
        Whether the work waits for the user.
    waits_for
        What else the work waits for, such as "Blender's render"; empty: nothing.
    """

    def __init__(self, label: str, work: Callable[[Job], Any]) -> None:
        self.label = label
        self.fraction = 0.0
        self.result: Any = None
        self.error: BaseException | None = None
        self.ending: str | None = None
        self.reason = ""
        self.paused = False
        self.waits_for = ""
        self._work = work
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="edgegrad", daemon=True)

    def start(self) -> Job:
        """Start the thread."""
        self._thread.start()
        return self

    def _run(self) -> None:
        try:
            self.result = self._work(self)
        except edgegrad.Cancelled:
            self.ending = self.ending or RESTORE
        except BaseException as error:  # the operator reports it: Python drops exceptions of threads
            self.error = error

    # ---- for the thread ----
    def check(self, fraction: float) -> None:
        """Note the progress; raise `edgegrad.Cancelled` if the result is to be dropped."""
        self.fraction = fraction
        if self.ending == RESTORE:
            raise edgegrad.Cancelled

    def wait_while_paused(self) -> None:
        """Return at once, or when the job is resumed or ended."""
        with self._changed:
            self._changed.wait_for(lambda: not self.paused or self.ending is not None)

    # ---- for the main thread ----
    @property
    def running(self) -> bool:
        """Whether the thread is alive."""
        return self._thread.is_alive()

    def pause(self, paused: bool) -> None:
        """Let the work wait at its next step, or go on."""
        with self._changed:
            self.paused = paused
            self._changed.notify_all()

    def end(self, how: str, reason: str = "") -> None:
        """Ask the work to end. What was asked first stays, except that a result may still be dropped."""
        with self._changed:
            if self.ending is None or (how == RESTORE and self.ending != RESTORE):
                self.ending, self.reason = how, reason
            self._changed.notify_all()

    def serve(self, occupied: str = "", seconds: float = 0.0) -> None:
        """Do what the thread needs from the main thread in some seconds, unless Blender is occupied by something."""

    def wait(self) -> None:
        """Wait until the thread has ended."""
        self._thread.join()

"""Evaluation of Blender in its main thread, for a fit that runs in another one."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from edgegrad.fitting.driven import Numbers, Placement, Variable
from edgegrad.rendering.renderer import Cancelled

from .driver import Driver


class Relay:
    """Driven variables whose `place` may be called in any thread; the main thread has to call `serve`.

    Attributes
    ----------
    latest
        The last placement; None: there was none.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self.latest: Placement | None = None
        self._wanted: Callable[[], Placement | None] | None = None
        self._answer: tuple[Placement | BaseException | None] | None = None
        self._changed = threading.Condition()
        self._closed = False

    @property
    def variables(self) -> Sequence[Numbers | Variable]:
        """The variables of the driver."""
        return self._driver.variables

    def place(self, values: Mapping[str, Any], views: Sequence[int] | None = None) -> Placement:
        """Set the variables and return what follows for some of the pictures; None: for all."""
        placed = self._served(lambda: self._driver.place(values, views))
        assert placed is not None
        return placed

    def look(self, values: Mapping[str, Any]) -> Placement | None:
        """Return what would follow from some values (`edgegrad.fitting.driven.Looking`)."""
        return self._served(lambda: self._driver.look(values))

    def _served(self, work: Callable[[], Placement | None]) -> Placement | None:
        """Return what a call gives in the main thread."""
        if threading.current_thread() is threading.main_thread():
            return work()
        with self._changed:
            self._wanted = work
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._answer is not None or self._closed)
            answer, self._answer = self._answer, None
        if answer is None:
            raise Cancelled
        if isinstance(answer[0], BaseException):
            raise answer[0]
        return answer[0]

    def state(self) -> dict[str, Any]:
        """Return the state of the driver."""
        return self._driver.state()

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `state` has returned."""
        self._driver.restore(state)

    @property
    def wanted(self) -> bool:
        """Whether a thread waits for `serve`."""
        return self._wanted is not None

    def serve(self, seconds: float = 0.0) -> None:
        """Answer a waiting thread, and further calls that come within some seconds; for the main thread."""
        end = time.monotonic() + seconds
        while self._wanted is not None:
            self._serve_one()
            with self._changed:
                self._changed.wait_for(lambda: self._wanted is not None or self._closed, end - time.monotonic())
            if time.monotonic() >= end:
                return

    def _serve_one(self) -> None:
        with self._changed:
            if self._wanted is None:
                return
            work, self._wanted = self._wanted, None
        answer: Placement | BaseException | None
        try:
            answer = work()
            self.latest = answer or self.latest
        except BaseException as error:
            answer = error
        with self._changed:
            self._answer = (answer,)
            self._changed.notify_all()

    def close(self) -> None:
        """Cancel a thread that waits or will wait, since the main thread no longer serves it."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

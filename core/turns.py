"""Calls of several threads on one object, one after the other."""

from __future__ import annotations

import threading
from types import TracebackType


class Turns:
    """A lock that refuses, instead of waiting for ever, the thread that holds it already.

    Parameters
    ----------
    what
        Name of the object, for the message.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._lock = threading.Lock()
        self._holder: int | None = None

    def __enter__(self) -> None:
        """Wait for the calls of other threads.

        Raises
        ------
        RuntimeError
            If this very thread is inside already: a progress function called back.
        """
        if self._holder == threading.get_ident():
            raise RuntimeError(f"{self._what}: its progress function can't use it while it computes; make another one")
        self._lock.acquire()
        self._holder = threading.get_ident()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let the next one in."""
        self._holder = None
        self._lock.release()

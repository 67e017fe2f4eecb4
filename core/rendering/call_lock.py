"""A lock that serialises the calls of several threads on one object."""

from __future__ import annotations

import os
import threading
import weakref


class Turns:
    """A lock that raises an error, instead of a deadlock, if its own thread takes it again.

    Parameters
    ----------
    what
        Name of the locked object, for messages.

    Notes
    -----
    Use it as ``with turns.lock():``. The ``with`` statement enters Python's own lock. A context manager written in
    Python would not be safe: Ctrl-C may interrupt it after it has taken the lock and before it returns.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._lock = threading.RLock()
        self._left_behind = False
        _all.add(self)

    def lock(self) -> threading.RLock:
        """Return the lock for a ``with`` statement, which waits for the calls of other threads.

        Raises
        ------
        RuntimeError
            If this thread holds the lock already (a progress function uses the object), or if another thread held it
            when this process was forked, since that thread does not exist here and never releases the lock.
        """
        if self._left_behind:
            raise RuntimeError(f"{self._what}: another thread was using it when this process was forked; "
                               "make another one")
        if self._is_mine():
            raise RuntimeError(f"{self._what}: its progress function can't use it while it computes; make another one")
        return self._lock

    def _is_mine(self) -> bool:
        return bool(self._lock._is_owned())  # type: ignore[attr-defined]  # as threading.Condition does

    def _after_fork(self) -> None:
        if self._is_mine():
            return
        if self._lock.acquire(blocking=False):
            self._lock.release()
        else:
            self._left_behind = True


_all: weakref.WeakSet[Turns] = weakref.WeakSet()


def _after_fork() -> None:
    for turns in list(_all):
        turns._after_fork()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)

"""Calls of several threads on one object, one after the other."""

from __future__ import annotations

import os
import threading
import weakref


class Turns:
    """A lock that refuses, instead of waiting for ever, the thread that holds it already.

    Parameters
    ----------
    what
        Name of the object, for messages.

    Notes
    -----
    It is entered as ``with turns.lock():``. The ``with`` is that of Python's own lock, since no Python function can
    enter and leave a lock safely: Ctrl-C may end it between the lock's being taken and its return.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._lock = threading.RLock()
        self._left_behind = False
        _all.add(self)

    def lock(self) -> threading.RLock:
        """The lock, for ``with``: waits for the calls of other threads.

        Raises
        ------
        RuntimeError
            If this very thread is inside already (a progress function called back), or if another thread was inside
            when this process was forked: it will never leave.
        """
        if self._left_behind:
            raise RuntimeError(f"{self._what}: another thread was using it when this process was forked; "
                               "make another one")
        if self._is_mine():
            raise RuntimeError(f"{self._what}: its progress function can't use it while it computes; make another one")
        return self._lock

    @property
    def left_behind(self) -> bool:
        """Whether a thread that this forked process doesn't have was inside."""
        return self._left_behind

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

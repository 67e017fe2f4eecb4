"""How long rendered views rest between their work while a job runs, which needs the same processor."""

from __future__ import annotations

from ..status import STATUS

# How much longer a view rests than it has worked.
SHARE = 20.0


def rest(seconds: float) -> float:
    """Return the seconds that a view rests after work that took some seconds: none, unless a job runs."""
    job = STATUS.job
    return 0.0 if job is None or job.paused else SHARE * seconds

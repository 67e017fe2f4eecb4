"""The iterations of a film: a few frames first, one after the other, then those between them, at last all together.

An object may move far within a film, so that a frame that started from the first one would find nothing of it. Hence
each frame starts from one that is done: the coarse frames from the one before, or where the motion of the two before
leads to, if that looks more like the picture; all others between their neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..schedule import Start, Turn, in_turns, shortened

# Iterations of each frame in each stage, as parts of those of the first frame.
CHAINED, BETWEEN, TOGETHER = 0.75, 0.25, 0.25
# Length of the first steps, and the progress of the loss, of frames that start between neighbours.
NEAR_STEP, NEAR_PROGRESS = 0.4, 0.5


@dataclass(frozen=True)
class _Stage:
    """Frames that are fitted together.

    Attributes
    ----------
    frames
        Their indices.
    starts
        Ways to begin (`Turn.starts`).
    known
        All frames that have begun, in order.
    iterations
        Steps of each frame.
    near
        Whether they are near their values, so that steps may be short.
    """

    frames: tuple[int, ...]
    starts: tuple[tuple[Start, ...], ...]
    known: tuple[int, ...]
    iterations: int
    near: bool


class FilmSchedule:
    """The iterations of a film (`schedule.Schedule`).

    Parameters
    ----------
    of_views
        Index of each target's frame.
    first_every
        Distance of the frames that are fitted first.
    steps
        Steps of the first frame; all others have fewer.
    per_iteration
        Targets of each iteration; None: all of a stage.
    seed
        Seed of the order of the targets.
    """

    def __init__(self, of_views: Sequence[int], first_every: int, steps: int, per_iteration: int | None,
                 seed: int) -> None:  # fmt: skip
        self._stages = _stages(max(of_views) + 1, first_every, steps)
        self._orders, self._counts, self._first = [], [], [0]
        self.complete_after = 0
        seen: set[int] = set()
        random = np.random.default_rng(seed)
        for stage in self._stages:
            views = [j for j, frame in enumerate(of_views) if frame in stage.frames]
            count = len(views) if per_iteration is None else min(per_iteration, len(views))
            full = -(-len(views) // count)
            self._orders.append(random.permutation(views))
            self._counts.append(count)
            if len(seen) < len(of_views):
                self.complete_after = self._first[-1] + full
            seen.update(views)
            self._first.append(self._first[-1] + stage.iterations * full)
        self.iterations = self._first[-1]

    def turn(self, k: int) -> Turn:
        """Return iteration k, counted from 0."""
        at = int(np.searchsorted(self._first, k, side="right")) - 1
        at = min(at, len(self._stages) - 1)
        stage, own = self._stages[at], k - self._first[at]
        length = self._first[at + 1] - self._first[at]
        part = min(own / max(length - 1, 1), 1.0)
        return Turn(
            in_turns(self._orders[at], own, self._counts[at]),
            shortened(min(own, length), length) * (NEAR_STEP if stage.near else 1.0),
            NEAR_PROGRESS + (1.0 - NEAR_PROGRESS) * part if stage.near else part,
            stage.starts if own == 0 else (),
            stage.known,
        )


def _stages(count: int, first_every: int, steps: int) -> list[_Stage]:
    def part(of: float) -> int:
        return max(1, round(of * steps))

    chain = sorted({*range(0, count, first_every), count - 1})
    out = []
    for n, frame in enumerate(chain):
        # All later frames follow, so that a fit that is stopped leaves no frame at the start.
        ways = []
        if n > 0:
            ways.append(tuple(Start(later, chain[n - 1], chain[n - 1], 0.0) for later in range(frame, count)))
        if n > 1:
            a, b = chain[n - 2 : n]
            ways.append((*ways[0][1:], Start(frame, a, b, (frame - a) / (b - a))))
        out.append(_Stage((frame,), tuple(ways), tuple(chain[: n + 1]), steps if n == 0 else part(CHAINED), False))
    done = chain
    while len(done) < count:
        starts = tuple(Start((a + b) // 2, a, b, ((a + b) // 2 - a) / (b - a))
                       for a, b in zip(done, done[1:], strict=False) if b > a + 1)  # fmt: skip
        new = tuple(start.frame for start in starts)
        done = sorted({*done, *new})
        out.append(_Stage(new, (starts,), tuple(done), part(BETWEEN), True))
    if count > 1:
        out.append(_Stage(tuple(range(count)), (), tuple(range(count)), part(TOGETHER), True))
    return out

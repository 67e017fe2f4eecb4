"""Division of lists of different lengths into parts that fit into the cache."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

I64 = NDArray[np.int64]

# Pairs that are computed at once: more need memory, fewer leave numpy's calls without work.
PAIRS = 1 << 18


def parts(count: I64, most: int = PAIRS) -> Iterator[slice]:
    """Divide lists of `count` entries into runs of lists with about `most` entries together."""
    total = np.cumsum(count)
    first = 0
    while first < len(count):
        before = int(total[first - 1]) if first else 0
        end = max(int(np.searchsorted(total, before + most, side="right")), first + 1)
        yield slice(first, end)
        first = end

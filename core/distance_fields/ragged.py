"""Lists of different lengths as flat arrays, and their division into parts that fit into the cache."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

I64 = NDArray[np.int64]

# Pairs that are computed at once: more need memory, fewer leave numpy's calls without work.
PAIRS = 1 << 18


def rows_and_places(count: I64) -> tuple[I64, I64]:
    """Return for each entry of lists of `count` entries the number of its list, and its place in that list."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)


def parts(count: I64, most: int = PAIRS) -> Iterator[slice]:
    """Divide lists of `count` entries into runs of lists with about `most` entries together."""
    total = np.cumsum(count)
    first = 0
    while first < len(count):
        before = int(total[first - 1]) if first else 0
        end = max(int(np.searchsorted(total, before + most, side="right")), first + 1)
        yield slice(first, end)
        first = end


def connected(a: I64, b: I64, count: int) -> I64:
    """Label (count,) nodes by the smallest node that pairs a - b connect them with."""
    label = np.arange(count)
    while len(a):
        before = label.copy()
        least = np.minimum(label[a], label[b])
        np.minimum.at(label, label[a], least)
        np.minimum.at(label, label[b], least)
        label = label[label]
        if np.array_equal(before, label):
            break
    return label

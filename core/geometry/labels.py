"""Labels of things that belong together, sums by label, and lists of different lengths as flat arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def merge(label: NDArray[np.int64], members: NDArray[np.int64], group: NDArray[np.int64]) -> NDArray[np.int64]:
    """Propagate the smallest label through shared labels and, for `members`, shared groups, until nothing changes.

    Parameters
    ----------
    label
        (n,) labels, each the index of a thing.
    members, group
        (k,) things, and a group of each, counted from 0.
    """
    while True:
        least = np.full(int(group.max(initial=-1)) + 1, np.iinfo(np.int64).max)
        np.minimum.at(least, group, label[members])
        by_label = np.arange(len(label))
        np.minimum.at(by_label, label[members], least[group])
        # Twice, so that labels go along chains in fewer steps than these have links
        merged = by_label[by_label[label]]
        if np.array_equal(merged, label):
            return label
        label = merged


def connected(a: NDArray[np.int64], b: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Label (count,) things by the smallest one that pairs a - b connect them with."""
    return merge(np.arange(count), np.concatenate([a, b]), np.tile(np.arange(len(a)), 2))


def rows_and_places(count: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return for each entry of lists of `count` entries the number of its list, and its place in that list."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)


def summed(label: NDArray[np.integer[Any]], rows: NDArray[np.floating[Any]], count: int = 0) -> NDArray[np.float64]:
    """(m, c) sum of the (n, c) rows with each label (n,); m is `count`, or more if a label needs it."""
    return np.stack([np.bincount(label, column, count) for column in rows.T], axis=1)

"""Labels of things that belong together."""

from __future__ import annotations

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

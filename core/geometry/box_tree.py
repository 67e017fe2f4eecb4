"""Pairs of overlapping boxes, found by a bounding box tree.

The traversal is vectorised: it tests all pairs of nodes of one level in one array operation.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Largest number of node pairs that are tested at once; longer lists are split, which bounds the memory.
_BLOCK = 1 << 18
# Cells along each axis of the grid whose Z-order curve sorts the boxes.
_CELLS = 1 << 20


class BoxTree:
    """A binary tree over boxes, sorted along a Z-order curve through their centres.

    Parameters
    ----------
    low, high
        (n, 3) corners of the boxes, n >= 1.
    """

    def __init__(self, low: F64, high: F64) -> None:
        self.order = _along_curve(0.5 * (low + high))
        depth = max(len(low) - 1, 0).bit_length()
        empty = (1 << depth) - len(low)
        # The padding boxes are empty and overlap no box.
        lows = np.concatenate([low[self.order], np.full((empty, 3), np.inf)])
        highs = np.concatenate([high[self.order], np.full((empty, 3), -np.inf)])
        levels = [(lows, highs)]
        while len(levels[-1][0]) > 1:
            lows, highs = levels[-1]
            levels.append((np.minimum(lows[::2], lows[1::2]), np.maximum(highs[::2], highs[1::2])))
        self.levels = levels[::-1]  # the root first

    def children(self, node: I64, level: int) -> list[I64]:
        """Children of nodes of a level; a leaf is its own child, since another tree may be deeper."""
        return [2 * node, 2 * node + 1] if level + 1 < len(self.levels) else [node]

    def corners(self, node: I64, level: int) -> tuple[F64, F64]:
        """(n, 3) lower and upper corners of the boxes of nodes of a level."""
        low, high = self.levels[min(level, len(self.levels) - 1)]
        return low[node], high[node]


def meeting(one: BoxTree, other: BoxTree | None = None) -> Iterator[tuple[I64, I64]]:
    """Yield index pairs of boxes of two trees that overlap or touch, in blocks.

    With one tree, each pair i < j of its boxes is found once.
    """
    itself = other is None
    other = one if other is None else other
    last = max(len(one.levels), len(other.levels)) - 1
    stack = [(0, np.zeros(1, np.int64), np.zeros(1, np.int64))]
    while stack:
        level, a, b = stack.pop()
        if len(a) > _BLOCK:
            middle = len(a) // 2
            stack += [(level, a[middle:], b[middle:]), (level, a[:middle], b[:middle])]
            continue
        (low_a, high_a), (low_b, high_b) = one.corners(a, level), other.corners(b, level)
        met = ((low_a <= high_b) & (low_b <= high_a)).all(axis=1)
        a, b = a[met], b[met]
        if level < last:
            pairs = [(x, y) for x in one.children(a, level) for y in other.children(b, level)]
            a, b = (np.concatenate([pair[k] for pair in pairs]) for k in (0, 1))
            if itself:
                a, b = a[a <= b], b[a <= b]
            if len(a):
                stack.append((level + 1, a, b))
            continue
        if itself:
            a, b = a[a != b], b[a != b]
        i, j = one.order[a], other.order[b]
        if len(i):
            yield (np.minimum(i, j), np.maximum(i, j)) if itself else (i, j)


def _along_curve(points: F64) -> I64:
    low = points.min(axis=0)
    size = np.ptp(points, axis=0)
    cell = ((points - low) / np.where(size > 0.0, size, 1.0) * (_CELLS - 1)).astype(np.uint64)
    key = np.zeros(len(points), np.uint64)
    for axis in range(3):
        key |= _spread(cell[:, axis]) << np.uint64(axis)
    return np.argsort(key, kind="stable")


def _spread(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Spread the lowest 21 bits: two zero bits between neighbouring bits."""
    for shift, mask in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F),
                        (4, 0x10C30C30C30C30C3), (2, 0x1249249249249249)):  # fmt: skip
        x = (x | (x << np.uint64(shift))) & np.uint64(mask)
    return x

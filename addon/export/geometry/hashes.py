"""Cycles' hashes of words and names, from which it takes the random numbers of objects, particles and strands."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

WORD = 0xFFFFFFFF


def name_hash(name: str) -> int:
    """Cycles' random number of an object that is not an instance."""
    text = 0
    for byte in name.encode():
        text = (text * 37 + byte) & WORD
    return int(hash_words(np.array([text], np.uint32), 0)[0])


def hash_words(first: NDArray[Any], second: int | None = None) -> NDArray[np.uint32]:
    """Hash of one or two 32-bit words each: the final mix of lookup3 (Jenkins 2006)."""
    start = np.uint32((0xDEADBEEF + ((1 if second is None else 2) << 2) + 13) & WORD)
    a = np.asarray(first, np.uint32) + start
    b = np.full_like(a, (int(start) + (second or 0)) & WORD)
    c = np.full_like(a, start)
    for k in (14, 11, 25, 16, 4, 14, 24):
        # The roles of the three words rotate: c changes by b, then a by c, then b by a.
        turned = (b << np.uint32(k)) | (b >> np.uint32(32 - k))
        a, b, c = b, (c ^ b) - turned, a
    return b

"""Random numbers of islands: the connected parts of a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .hashes import WORD, hash_words
from .normals import as_rendered


def island_randoms(mesh: Any) -> NDArray[np.float32]:
    """(c, 1) random number of the island of each corner.

    Cycles hashes the vertex that represents an island. Which one that is depends on the order of the edges.
    """
    parts = as_rendered(mesh)
    of_vertex = hash_words(representatives(parts.edges, parts.vertices)) / WORD
    return of_vertex[parts.corners, None].astype(np.float32)


def representatives(edges: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """(count,) vertex that represents the island of each vertex: Cycles' disjoint sets, with union by rank."""
    parent, rank = list(range(count)), [0] * count

    def root(vertex: int) -> int:
        while parent[vertex] != vertex:
            parent[vertex] = parent[parent[vertex]]  # the root stays the same
            vertex = parent[vertex]
        return vertex

    for one, two in edges.tolist():
        a, b = root(one), root(two)
        if a == b:
            continue
        if rank[a] < rank[b]:
            a, b = b, a
        parent[b] = a
        rank[a] += rank[a] == rank[b]
    return np.fromiter(map(root, range(count)), np.int64, count)

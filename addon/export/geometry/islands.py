"""Random numbers of islands: the connected parts of a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .hashes import WORD, hash_words


def island_randoms(mesh: Any) -> NDArray[np.float32]:
    """(n, 1) random number of the island of each vertex.

    Cycles hashes the vertex that represents an island. Which one that is depends on the order of the edges.
    """
    edges = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", edges.ravel())
    return (hash_words(representatives(edges, len(mesh.vertices))) / WORD)[:, None].astype(np.float32)


def representatives(edges: NDArray[np.int32], count: int) -> NDArray[np.int64]:
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

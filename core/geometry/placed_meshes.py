"""Meshes in world space, and queries for pairs of them that are near each other or intersect."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..scene.mesh import Mesh
from ..scene.placement import placed_meshes
from ..scene.scene import Scene
from .box_tree import BoxTree, meeting
from .mesh_batches import corners
from .shape import TOLERANCE, copy_boxes, may_cross, thickness

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Largest number of mesh pairs that a query returns.
MOST_PAIRS = 100_000

Pair = tuple[str, str]


class PlacedMeshes(dict[str, Mesh]):
    """Meshes by name. They must not change: results for all meshes are computed once and kept."""

    @staticmethod
    def of(scene: Scene) -> PlacedMeshes:
        """The meshes of a validated scene."""
        return PlacedMeshes(zip(scene.meshes, placed_meshes(scene), strict=True))

    @cached_property
    def boxes(self) -> tuple[F64, F64]:
        """(n, 3) lower and upper corners of the bounding box of each mesh with all its instances."""
        meshes = list(self.values())
        low, high = corners(meshes)
        for k in np.flatnonzero(self._placed):
            lows, highs = copy_boxes(meshes[k])
            low[k], high[k] = lows.min(axis=0), highs.max(axis=0)
        return low, high

    def near(self, names: Collection[str], low: F64, high: F64) -> list[str]:
        """Names, out of `names`, of the meshes whose bounding boxes overlap a box, in order."""
        lows, highs = self.boxes
        meets = set(np.flatnonzero(((lows <= high) & (highs >= low)).all(axis=1)).tolist())
        among = set(names)
        return [name for k, name in enumerate(self) if k in meets and name in among] if meets else []

    @cached_property
    def crossing(self) -> list[Pair]:
        """Pairs of meshes that may intersect each other, in order; at most `MOST_PAIRS`.

        A pair of a mesh with itself stands for two of its instances.
        """
        return self._named(self._crossing())

    def close(self, first: Collection[str], second: Collection[str]) -> list[Pair]:
        """Pairs of a mesh in `first` and a mesh in `second` whose bounding boxes overlap, in order.

        At most `MOST_PAIRS`; meshes with instances are left out.
        """
        return self._named(self._close(set(first), set(second))) if first and second else []

    def _named(self, blocks: Iterator[I64]) -> list[Pair]:
        rows: list[list[int]] = []
        for block in blocks:
            rows += block[: MOST_PAIRS - len(rows)].tolist()
            if len(rows) == MOST_PAIRS:
                break
        names = list(self)
        return [(names[i], names[j]) for i, j in sorted(rows)]

    @cached_property
    def _placed(self) -> NDArray[np.bool_]:
        """(n,) whether each mesh has instances."""
        return np.array([mesh.instances is not None for mesh in self.values()], bool)

    def _crossing(self) -> Iterator[I64]:
        """Yield blocks (k, 2) of index pairs of meshes that may intersect."""
        if not self:
            return
        meshes = list(self.values())
        low, high = self.boxes
        placed = self._placed
        yield np.array([[k, k] for k in np.flatnonzero(placed) if may_cross(meshes[k], meshes[k], same=True)],
                       np.int64).reshape(-1, 2)
        size = TOLERANCE * np.linalg.norm(high - low, axis=1)
        for i, j in meeting(BoxTree(low, high)):
            slack = np.maximum(size[i], size[j])
            apart = ((low[i] >= high[j] - slack[:, None]) | (low[j] >= high[i] - slack[:, None])).any(axis=1)
            copies = placed[i] | placed[j]
            i, j, slack, copies = (x[copies | ~apart] for x in (i, j, slack, copies))
            if not len(i):
                continue
            # If neither mesh is flat, overlapping bounding boxes are taken as an intersection.
            crosses = ~copies & (np.minimum(self._thickness[i], self._thickness[j]) > slack)
            for k in np.flatnonzero(~crosses):
                crosses[k] = may_cross(meshes[i[k]], meshes[j[k]])
            yield np.stack([i[crosses], j[crosses]], axis=1)

    @cached_property
    def _thickness(self) -> F64:
        """(n,) `shape.thickness` of each mesh, metres."""
        return thickness(list(self.values()))

    def _close(self, first: set[str], second: set[str]) -> Iterator[I64]:
        among_first, among_second = (np.array([name in some for name in self], bool) for some in (first, second))
        low, high = self.boxes
        # The gap between two boxes may be TOLERANCE times the size of their union. The union of nearby boxes is hardly
        # larger than the sum of their sizes, so boxes that are enlarged by TOLERANCE times their own size overlap.
        slack = 1.01 * TOLERANCE * np.linalg.norm(high - low, axis=1, keepdims=True)
        for i, j in meeting(BoxTree(low - slack, high + slack)):
            kept = (among_first[i] & among_second[j]) | (among_first[j] & among_second[i])
            kept &= ~(self._placed[i] | self._placed[j])
            i, j = i[kept], j[kept]
            both = np.maximum(high[i], high[j]) - np.minimum(low[i], low[j])
            apart = TOLERANCE * np.linalg.norm(both, axis=1, keepdims=True)
            kept = ((low[i] <= high[j] + apart) & (low[j] <= high[i] + apart)).all(axis=1)
            yield np.stack([i[kept], j[kept]], axis=1)

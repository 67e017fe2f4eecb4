"""Ray queries with embreex, with faces that a ray ignores.

embreex has no filter functions. After a hit on an ignored face, the ray is traced again from just behind it. This also
skips a surface in contact with the ignored face, within a few float32 rounding errors. The native engine uses a filter
function and does not have this limit.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from ..tables.tables import Tables
from .surfaces import Bools, Floats, Ints

# Rays per call of embreex. Smaller batches distribute better over threads; larger ones have less overhead.
BATCH = 1 << 14


class Rays:
    """Closest hits and occlusion among the visible triangles of a scene."""

    def __init__(self, tables: Tables, threads: int) -> None:
        mesh = np.repeat(np.arange(len(tables.visible)), np.diff(tables.mesh_first_face))
        self._face = np.flatnonzero(tables.visible[mesh])
        self._scale = float(np.abs(tables.vertices).max(initial=1e-6))
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self._scene: Any = None
        if len(self._face):
            self._scene = EmbreeScene(robust=True)
            TriangleMesh(self._scene, tables.vertices, tables.faces[self._face].astype(np.int32))
            self._query(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), np.ones(1, np.float32), "OCCLUDED")

    def closest(
        self, origin: Floats, direction: Floats, near: Floats, far: Floats, ignore: Ints | None = None
    ) -> tuple[Ints, Floats]:
        """Find the first face between `near` and `far` along each ray that is not ignored.

        Parameters
        ----------
        origin, direction
            (n, 3); directions of unit length.
        near, far
            (n,) distances; far may be infinite.
        ignore
            (n, k) faces that each ray ignores; -1: none.

        Returns
        -------
        (n,) face (-1: none) and (n,) distance of the hit of each ray.
        """
        face = np.full(len(origin), -1, np.int64)
        distance = np.full(len(origin), np.inf)
        ray = np.arange(len(origin))
        start = np.array(near, np.float64)
        step = np.full(len(origin), 1e-6) * (self._scale + np.abs(start))
        while len(ray) and self._scene is not None:
            o = origin[ray] + start[ray, None] * direction[ray]
            hit, length = self._intersect(o, direction[ray], far[ray] - start[ray])
            found = np.flatnonzero(hit >= 0)
            ray, hit, length = ray[found], hit[found], start[ray[found]] + length[found]
            again = np.zeros(len(ray), bool) if ignore is None else (ignore[ray] == hit[:, None]).any(axis=1)
            face[ray[~again]], distance[ray[~again]] = hit[~again], length[~again]
            ray = ray[again]
            start[ray] = length[again] + step[ray]
            step[ray] *= 2.0  # else a grazing ray could hit the same face for ever
            ray = ray[start[ray] < far[ray]]
        return face, distance

    def blocked(self, origin: Floats, direction: Floats, far: Floats, ignore: Ints) -> Bools:
        """Whether each ray hits a face that is not ignored within the distance `far`."""
        out = np.zeros(len(origin), bool)
        if self._scene is None or len(origin) == 0:
            return out
        single = (origin.astype(np.float32), direction.astype(np.float32), _reach(far))
        maybe = np.flatnonzero(self._batched(*single, "OCCLUDED")["primID"] >= 0)
        face, _ = self.closest(origin[maybe], direction[maybe], np.zeros(len(maybe)), far[maybe], ignore[maybe])
        out[maybe] = face >= 0
        return out

    def _intersect(self, origin: Floats, direction: Floats, far: Floats) -> tuple[Ints, Floats]:
        hit = self._batched(origin.astype(np.float32), direction.astype(np.float32), _reach(far), "INTERSECT")
        local = hit["primID"]
        return np.where(local >= 0, self._face[local], -1), hit["tfar"].astype(np.float64)

    def _batched(self, o: NDArray[np.float32], d: NDArray[np.float32], far: NDArray[np.float32], query: str) -> Any:
        parts = [slice(k, k + BATCH) for k in range(0, len(o), BATCH)] or [slice(0, 0)]
        run = map if self._pool is None else self._pool.map
        found = list(run(lambda s: self._query(o[s], d[s], far[s], query), parts))
        return {key: np.concatenate([f[key] for f in found]) for key in found[0]}

    def _query(self, o: NDArray[np.float32], d: NDArray[np.float32], far: NDArray[np.float32], query: str) -> Any:
        if query == "OCCLUDED":
            # embreex returns 0 for blocked and -1 for free.
            return {"primID": self._scene.run(o, d, far, query=query)}
        hit = self._scene.run(o, d, far, output=1)
        return {"primID": hit["primID"], "tfar": hit["tfar"]}


def _reach(far: Floats) -> NDArray[np.float32]:
    """Clip ray lengths: embreex accepts neither infinite nor negative lengths."""
    return np.clip(far, 0.0, 1e30).astype(np.float32)

"""The float arrays of an export, and how far they are moved from each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad.scene import parameters
from edgegrad.scene.changes import changed_fields, changes

from ..export import Export

F64 = NDArray[np.float64]
# Values below this are compared with it instead of with themselves.
LEAST_SIZE = 0.1
# Key of an array: number of the view for fields of a camera, else -1, and the parameter's path.
Key = tuple[int, str]
Arrays = dict[Key, Any]
CAMERA = "camera."


def moved(before: Export, after: Export) -> Arrays:
    """Return the arrays of `after` that differ from those of `before`.

    Raises
    ------
    StructureChange
        If more than float arrays differ.
    """
    # The scene's own camera is the first of the views.
    out: Arrays = {(-1, path): value for path, value in changes(before.scene, after.scene).items()
                   if not path.startswith(CAMERA)}  # fmt: skip
    for k, (old, new) in enumerate(zip(before.views, after.views, strict=True)):
        out |= {(k, CAMERA + name): value for name, value in changed_fields(old, new, "camera").items()}
    return out


def value_of(export: Export, key: Key) -> F64:
    """Return the value of an array in an export."""
    view, path = key
    if view < 0:
        return np.asarray(parameters.get(export.scene, path), np.float64)
    return np.asarray(getattr(export.views[view], path[len(CAMERA) :]), np.float64)


_PLACES = (".to_world", ".transform", ".instances")


@dataclass
class Sizes:
    """Sizes of the arrays of an export, with which their changes are compared."""

    export: Export

    def __post_init__(self) -> None:
        self._found: dict[Key, float] = {}

    def of(self, key: Key) -> float:
        """Size of an array: of vertices their extent, of a place its distance from the nearest mesh, of values the
        largest one.
        """
        if key not in self._found:
            self._found[key] = self._size(key)
        return self._found[key]

    def _size(self, key: Key) -> float:
        path, value = key[1], value_of(self.export, key)
        if path.endswith(".vertices"):
            return float(np.linalg.norm(np.ptp(value, axis=0))) or 1.0
        if path.endswith((".transform", ".instances")):
            vertices = self.export.scene.meshes[parameters.split(path)[1]].vertices
            return float(np.linalg.norm(np.ptp(vertices, axis=0))) or 1.0
        if path.endswith((".to_world", ".position")):
            return self._distance(value[:3, 3] if value.ndim == 2 else value)
        if path.endswith((".normals", ".direction", ".rotation")):
            return 1.0
        if value.size > 64:  # texels and attributes: the largest may be far from the rest
            return max(float(np.sqrt(np.mean(value**2))), LEAST_SIZE)
        return max(float(np.abs(value).max(initial=0.0)), LEAST_SIZE)

    def _distance(self, point: F64) -> float:
        """Distance of a place from most of the mesh that is nearest to it, by which its picture or light scales."""
        found = [float(np.median(np.linalg.norm(mesh.vertices - point, axis=1)))
                 for mesh in self.export.scene.meshes.values() if mesh.is_single]  # fmt: skip
        return min((one for one in found if one > 0.0), default=1.0)

    def change(self, key: Key, difference: F64) -> float:
        """Largest change of an array, relative to its size; of a place, also its turn in radians."""
        if key[1].endswith(_PLACES):
            turn, move = np.abs(difference[..., :3, :3]).max(), np.abs(difference[..., :3, 3]).max()
            return float(max(turn, move / self.of(key)))
        return float(np.abs(difference).max()) / self.of(key)

    def squares(self, key: Key, difference: Any) -> float:
        """Mean square of a difference of arrays, each entry relative to its size."""
        change = np.square(np.asarray(difference, np.float64))
        if key[1].endswith(_PLACES) and change.ndim:
            change = change.copy()
            change[..., :3, 3] /= self.of(key) ** 2
            return float(change.mean())
        return float(change.mean()) / self.of(key) ** 2

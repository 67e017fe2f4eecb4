"""What a rendered view keeps of its last export: the meshes that Blender has not changed since."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..export.geometry.attributes import ObjectValues, is_of_object, read_attributes
from ..export.geometry.group import Group
from ..export.geometry.memory import Memory
from ..export.geometry.mesh import MeshArrays, positions, read_mesh

F32 = NDArray[np.float32]


@dataclass
class _Kept:
    """An evaluated mesh as it was read last."""

    arrays: MeshArrays
    attributes: dict[str, F32]


@dataclass
class _Built:
    """A mesh of the scene, and what it was built from."""

    arrays: MeshArrays
    matrices: list[NDArray[np.float64]]
    attributes: dict[str, F32]
    own: dict[str, Any]
    settings: Any
    mesh: edgegrad.Mesh


class ViewMemory(Memory):
    """Meshes of a view, by object and address: Blender says which objects it has evaluated anew.

    Unlike those of `Memory`, the exports of a view need not have the same topology.
    """

    def __init__(self) -> None:
        super().__init__()
        self._stale: Callable[[str], bool] = lambda name: True
        self._meshes: dict[tuple[str, int], _Kept] = {}
        self._used: dict[tuple[str, int], _Kept] = {}
        self._of_arrays: dict[int, _Kept] = {}
        self._parts: dict[str, _Built] = {}
        self._used_parts: dict[str, _Built] = {}

    def expect(self, stale: Callable[[str], bool]) -> None:
        """Say which objects, by name, have changed their geometry since the last export."""
        self._stale = stale

    def begin(self) -> None:
        """Begin the next export."""
        self._used, self._used_parts, self._of_arrays = {}, {}, {}

    def end(self) -> None:
        """Forget what the export that ends has not used."""
        self._meshes, self._parts = self._used, self._used_parts

    def read(self, name: str, mesh: Any) -> MeshArrays:
        """Read an evaluated mesh of the object of this name, unless it is that of the last export."""
        key = name, mesh.as_pointer()
        kept = None if self._stale(name) else self._meshes.get(key)
        if kept is None or not np.array_equal(kept.arrays.positions, positions(mesh)):
            kept = _Kept(read_mesh(mesh), {})
        self._used[key] = self._of_arrays[id(kept.arrays)] = kept
        return kept.arrays

    def attributes(self, mesh: Any, arrays: MeshArrays, names: list[str], of: ObjectValues) -> dict[str, F32]:
        """Read attributes of a mesh that `read` has returned, as `read_attributes` does."""
        kept = self._of_arrays[id(arrays)].attributes
        new = [name for name in names if is_of_object(name) or name not in kept]
        found = read_attributes(mesh, arrays, new, of)
        kept |= {name: value for name, value in found.items() if not is_of_object(name)}
        return {name: found[name] if name in found else kept[name] for name in names if name in found or name in kept}

    def built(self, name: str, group: Group, matrices: list[Any],
              build: Callable[[bool | None, bool | None], edgegrad.Mesh]) -> edgegrad.Mesh:  # fmt: skip
        """Return the mesh of the last export if nothing has changed; else build it."""
        settings = group.slots, group.visible, group.terminator, group.framed, group.own_space
        known = self._parts.get(name)
        if known is None or not (
            known.arrays is group.arrays and known.own == group.own and known.settings == settings
            and len(known.matrices) == len(matrices) and all(map(np.array_equal, known.matrices, matrices))
            and known.attributes.keys() == group.attributes.keys()
            and all(_equal(known.attributes[key], value) for key, value in group.attributes.items())
        ):  # fmt: skip
            known = _Built(group.arrays, matrices, dict(group.attributes), dict(group.own), settings,
                           build(None, None))
        self._used_parts[name] = known
        return known.mesh


def _equal(one: F32, other: F32) -> bool:
    return one is other or np.array_equal(one, other)

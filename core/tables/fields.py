"""Distance fields as kernels read them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene.field import Field
from ..scene.scene import Scene


@dataclass(frozen=True)
class FieldTable:
    """The coefficients and the place of a field. Engines copy both."""

    values: NDArray[np.float32]  # (nx, ny, nz), the scene's own array
    to_world: NDArray[np.float64]  # (3, 4) from grid coordinates, relative to the origin of the tables
    digest: bytes  # of the coefficients at the time of the table, since the scene may change them in place

    def same_values(self, other: FieldTable) -> bool:
        """Whether another table has the same coefficients and place."""
        return (self.values.shape == other.values.shape and self.digest == other.digest
                and np.array_equal(self.to_world, other.to_world))


def field_tables(scene: Scene, origin: NDArray[np.float64]) -> tuple[FieldTable, ...]:
    """Return the fields of a validated scene, in order."""
    return tuple(_table(one, origin) for one in scene.fields.values())


def _table(one: Field, origin: NDArray[np.float64]) -> FieldTable:
    to_world = one.grid_to_world()
    to_world[:, 3] -= origin
    digest = hashlib.blake2b(one.values.data, digest_size=16).digest()
    return FieldTable(one.values, np.ascontiguousarray(to_world), digest)

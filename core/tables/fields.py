"""Distance fields as kernels read them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene.field import Field
from ..scene.scene import Scene

try:
    from .. import _native
except ImportError:  # the reference engine needs no native module
    _native = None  # type: ignore[assignment]

# Binary exponents of the largest value that kernels compute with as it is. The squares of steeper or flatter slopes
# could leave the range of single precision.
_ORDINARY = (-20, 20)


@dataclass(frozen=True)
class FieldTable:
    """The coefficients and the place of a field. Engines copy both."""

    values: NDArray[np.float32]  # (nx, ny, nz), the scene's own array, or that times `scale`
    to_world: NDArray[np.float64]  # (3, 4) from grid coordinates, relative to the origin of the tables
    digest: bytes | int  # of the coefficients at the time of the table, since the scene may change them in place
    scale: float = 1.0  # a power of two, which moves no zero

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
    digest = (hashlib.blake2b(one.values.data, digest_size=16).digest() if _native is None
              else _native.fingerprint(one.values))
    scale = _scale(one.values)
    values = one.values if scale == 1.0 else np.ldexp(one.values, int(np.log2(scale)))
    return FieldTable(values, np.ascontiguousarray(to_world), digest, scale)


def _scale(values: NDArray[np.float32]) -> float:
    """The power of two that brings values of an extreme size to about 1; 1 for all others."""
    largest = max(float(values.max()), -float(values.min()))
    exponent = int(np.frexp(largest)[1])
    return 1.0 if largest == 0.0 or _ORDINARY[0] <= exponent <= _ORDINARY[1] else 2.0**-exponent

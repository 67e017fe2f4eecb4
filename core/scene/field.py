"""Distance fields: surfaces given by the sign of a spline on a grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import LARGEST_LENGTH, RAYS, array, mapping, rays, text
from .._fields import Check, Checked, by

# Fewest coefficients along an axis: those that one cell reads.
LEAST_SIZE = 4
# Kernels number bricks in 32 bits, and Embree has fewer than that.
LARGEST_SIZE = 1 << 14


def _values(where: str, name: str, value: Any) -> NDArray[np.float32]:
    shape = (None, None, None)
    if getattr(value, "dtype", None) != np.float32:  # values that single precision does not hold would become infinite
        value = array(where, name, value, shape, np.float64)
    out = array(where, name, value, shape, np.float32)
    if min(out.shape) < LEAST_SIZE or max(out.shape) > LARGEST_SIZE:
        raise ValueError(f"{where}: {name} must have {LEAST_SIZE} to {LARGEST_SIZE:,} coefficients along each axis, "
                         f"not the shape {out.shape}; sample the field on another grid")
    return out


def _attribute(where: str, name: str, value: Any) -> NDArray[np.float32]:
    out = array(where, name, value, (None, None, None, None), np.float32)
    if 0 in out.shape or max(out.shape[:3]) > LARGEST_SIZE or out.shape[3] > 4:
        raise ValueError(f"{where}: {name} must have the shape (ax, ay, az, c) with 1 to {LARGEST_SIZE:,} values along "
                         f"each axis, of 1 to 4 numbers, not {out.shape}")
    return out


@dataclass
class Field(Checked):
    """A surface where a distance field is zero. The field is negative inside and positive outside.

    The field is a cubic B-spline of coefficients on a regular grid. It need not be a true distance: only its zeros and,
    for normals, its gradient matter. A grid of (nx, ny, nz) coefficients has (nx - 3, ny - 3, nz - 3) cells, which fill
    the box from `lower` to `upper`. The coefficient (i, j, k) stands at `lower + (i - 1, j - 1, k - 1) * spacing`: the
    outermost ones lie one cell outside of the box. A surface that leaves the box ends there, like a mesh with an open
    border.

    Derivatives exist by `values`, `attributes`, `transform`, `lower` and `upper`. They have the motion of hits and
    normals; the plan names what they lack (`edgegrad.plan`).

    Attributes
    ----------
    values
        (nx, ny, nz) coefficients, at least 4 along each axis.
    material
        Name of the material in the scene. It must not emit light. Its textures may use positions, normals and the
        field's `attributes`, but nothing that needs a UV map (normal maps, anisotropy).
    lower, upper
        (3,) corners of the box in the field's own space. The cells need not be cubes.
    transform
        (4, 4) affine transform from the field's own space to the world. The last row is ignored.
    attributes
        Name -> (ax, ay, az, c) values on a grid of its own, c = 1 to 4, for `expression.Attribute`: colours, roughness
        and other values. The value (i, j, k) stands at the fractions i / (ax - 1), j / (ay - 1), k / (az - 1) of the
        box; values in between are interpolated linearly along each axis. One value along an axis is constant there.
    visible_to
        Kinds of rays that can hit the field: a subset of "camera", "diffuse", "glossy", "transmission", "shadow".
    """

    values: NDArray[np.float32]
    material: str
    lower: NDArray[np.float64] = field(default_factory=lambda: np.full(3, -1.0))
    upper: NDArray[np.float64] = field(default_factory=lambda: np.ones(3))
    transform: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    attributes: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    visible_to: frozenset[str] = frozenset(RAYS)

    checks: ClassVar[Mapping[str, Check]] = {
        "values": _values,
        "material": text,
        "lower": by(array, (3,), np.float64, most=LARGEST_LENGTH),
        "upper": by(array, (3,), np.float64, most=LARGEST_LENGTH),
        "transform": by(array, (4, 4), np.float64, most=LARGEST_LENGTH),
        "attributes": by(mapping, _attribute),
        "visible_to": rays,
    }

    @property
    def cells(self) -> NDArray[np.int64]:
        """(3,) numbers of cells along the axes."""
        return np.array(self.values.shape, np.int64) - (LEAST_SIZE - 1)

    @property
    def spacing(self) -> NDArray[np.float64]:
        """(3,) sides of a cell in the field's own space."""
        return (self.upper - self.lower) / self.cells

    def grid_to_world(self) -> NDArray[np.float64]:
        """(3, 4) rows of the map from grid coordinates, which count cells from `lower`, to the world."""
        spacing = self.spacing
        out = np.empty((3, 4), np.result_type(spacing, self.transform))  # complex for derivatives (complex_step)
        out[:, :3] = self.transform[:3, :3] * spacing
        out[:, 3] = self.transform[:3, :3] @ self.lower + self.transform[:3, 3]
        return out

    def corners(self) -> NDArray[np.float64]:
        """(8, 3) corners of the box in the world."""
        own = np.stack(np.meshgrid(*np.stack([self.lower, self.upper], axis=1), indexing="ij"), axis=-1).reshape(-1, 3)
        return np.asarray(own @ self.transform[:3, :3].T + self.transform[:3, 3])

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the field and the wrong value."""
        where = f"field '{name}'"
        self.check_fields(where)
        if not np.all(self.lower < self.upper):
            raise ValueError(f"{where}: lower must be below upper along each axis; swap them, or widen the box")
        size = self.grid_to_world()[:, :3]
        if not abs(np.linalg.det(size)) > 1e-30:
            raise ValueError(f"{where}: transform flattens the box; give it three independent axes")
        reach = float(np.abs(self.corners()).max())
        if not reach <= LARGEST_LENGTH:
            raise ValueError(f"{where}: transform places the box up to {reach:.3g} m away; the limit is "
                             f"{LARGEST_LENGTH:.3g} m; scale the scene down")

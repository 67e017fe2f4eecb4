"""The field that a fit begins with: the shape of an exported mesh, or a ball in a box."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import distance_fields
from edgegrad.distance_fields.mesh_sampling import MULTIPLE, PADDING, memory
from edgegrad.fitting.fields.variables import LEAST_CELLS

from ..problem import Problem

F64 = NDArray[np.float64]

# Radius of the ball as a fraction of the half box. Surfaces must meet before a hole opens, so it is rather too small.
BALL = 0.7
# Bytes that a field may need while it is made and fitted.
MOST_MEMORY = 4e9
# Grids that are coarser than the field's own, with which a fit from a ball begins, if the field has enough cells.
COARSER = 2


@dataclass(frozen=True)
class Box:
    """A box that is turned and moved, not sheared.

    Attributes
    ----------
    transform
        (4, 4) rigid transform from the box's space to the world.
    half
        (3,) half of its sides, in metres; its centre is the origin of its space.
    """

    transform: F64
    half: F64


def box_of_empty(ob: Any) -> Box:
    """Return the cube that an empty shows.

    Raises
    ------
    Problem
        If it shows another shape, or has no volume.
    """
    where = f"object '{ob.name}'"
    if ob.empty_display_type != "CUBE":
        raise Problem(f"{where}: is an empty that does not show a box; set Display As to Cube in its data properties")
    matrix = np.array(ob.matrix_world, np.float64)
    sides = np.linalg.norm(matrix[:3, :3], axis=0)
    if not sides.min() * ob.empty_display_size > 0.0:
        raise Problem(f"{where}: its box has no volume; scale it up")
    transform = matrix.copy()
    transform[:3, :3] /= sides
    if np.abs(transform[:3, :3].T @ transform[:3, :3] - np.eye(3)).max() > 1e-4:
        raise Problem(f"{where}: its box is sheared by its parents; clear the parent and keep the transformation")
    return Box(transform, sides * ob.empty_display_size)


def box_around(mesh: edgegrad.Mesh) -> Box:
    """Return the box around an exported mesh, along the world's axes."""
    points = mesh.vertices @ mesh.transform[:3, :3].T + mesh.transform[:3, 3]
    least, greatest = points.min(axis=0), points.max(axis=0)
    transform = np.eye(4)
    transform[:3, 3] = 0.5 * (least + greatest)
    # A flat side still gets a few cells.
    half = 0.5 * (greatest - least)
    return Box(transform, np.maximum(half, 0.05 * half.max()))


def ball_in(box: Box, resolution: int, material: str, where: str) -> edgegrad.Field:
    """Return the field of an ellipsoid in the box, with `resolution` cells along its longest side.

    Raises
    ------
    Problem
        If the field needs too much memory.
    """
    spacing = 2.0 * box.half.max() / _rounded(resolution)
    cells = np.maximum(_rounded(np.ceil(2.0 * box.half / spacing - 1e-9)), LEAST_CELLS)
    check_memory(cells, where)
    half = 0.5 * cells * spacing
    places = [np.linspace(-h - spacing, h + spacing, n + 3) for h, n in zip(half, cells, strict=True)]
    radii = BALL * box.half
    points = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1)
    values = (np.linalg.norm(points / radii, axis=-1) - 1.0) * radii.min()
    return edgegrad.Field(values.astype(np.float32), material, -half, half, box.transform)


def shape_of(mesh: edgegrad.Mesh, resolution: int, where: str) -> tuple[edgegrad.Field, list[str]]:
    """Return the distance field of an exported mesh, and notes on what it lacks.

    Raises
    ------
    Problem
        If the mesh encloses no volume, or if the field needs too much memory.
    """
    half = box_around(mesh).half
    spacing = 2.0 * half.max() / (_rounded(resolution) - 2 * PADDING)
    check_memory(_rounded(np.ceil(2.0 * half / spacing) + 2 * PADDING), where)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            field = distance_fields.from_mesh(mesh, resolution, most_memory=MOST_MEMORY)
        except ValueError as error:
            raise Problem(f"{where}: has no distance field: {str(error).removeprefix('from_mesh: ')}") from error
    return field, [f"{where}: {str(one.message).removeprefix('from_mesh: ')}" for one in said]


def with_room(field: edgegrad.Field, cells: int) -> edgegrad.Field:
    """Return the field in a box that is larger by `cells` cells on each side, so that its surface has room to grow."""
    values = np.pad(np.asarray(field.values, np.float64), cells, mode="edge")
    spacing = field.spacing
    # Beyond the old box the distance grows; a constant would leave the new cells without a direction.
    for axis in range(3):
        away = np.maximum(cells - np.arange(values.shape[axis]), np.arange(values.shape[axis])
                          - (values.shape[axis] - 1 - cells)).clip(min=0)  # fmt: skip
        values += (spacing[axis] * away).reshape([-1 if k == axis else 1 for k in range(3)])
    return replace(field, values=values.astype(np.float32), lower=field.lower - cells * spacing,
                   upper=field.upper + cells * spacing)  # fmt: skip


def coarser_grids(field: edgegrad.Field) -> int:
    """Return how many coarser grids a fit of the field can begin with, at most `COARSER`."""
    return max(k for k in range(COARSER + 1)
               if not np.any(field.cells % 2**k) and not np.any(field.cells >> k < LEAST_CELLS))  # fmt: skip


def needed_memory(cells: NDArray[Any]) -> float:
    """Return about how many bytes the conversion and the fit of a field of so many cells need at most."""
    nodes = np.asarray(cells, np.int64) + 3
    return float(memory((int(nodes[0]), int(nodes[1]), int(nodes[2]))))


def check_memory(cells: NDArray[Any], where: str) -> None:
    """Raise `Problem` if a field of so many cells needs too much memory."""
    if (needed := needed_memory(cells)) > MOST_MEMORY:
        count = " x ".join(str(int(n)) for n in cells)
        raise Problem(f"{where}: its field of {count} cells needs about {needed / 1e9:.2g} GB, more than "
                      f"{MOST_MEMORY / 1e9:.2g} GB; lower the resolution")  # fmt: skip


def _rounded(cells: Any) -> Any:
    """Round numbers of cells up to multiples of `MULTIPLE`, which can be halved."""
    return (-(-np.asarray(cells, np.int64) // MULTIPLE) * MULTIPLE).astype(np.int64)

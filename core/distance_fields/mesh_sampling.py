"""Fields from meshes: signed distances at the nodes of a grid, and the spline through them."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import LARGEST_LENGTH, array, instance, number, whole, wholes
from ..geometry import topology
from ..scene.field import LARGEST_SIZE, LEAST_SIZE, Field
from ..scene.mesh import Mesh
from ..scene.placement import expanded
from . import spline, sweeping
from .closest import SMALL_PIECE, near_distances, pieces
from .winding import Surface

F64 = NDArray[np.float64]

# Cells between the mesh and the border of its grid.
PADDING = 4
# Grids without a box of their own have a multiple of this number of cells: a fit may begin three levels coarser.
MULTIPLE = 8
# Offset of such a grid, in cells: the faces of a box would else lie on nodes, and the signs there be rounding.
_OFF_NODES = np.array([0.31, 0.37, 0.43])
# Distance from the mesh, in cells, up to which distances are exact. They are of first order beyond.
_BAND = 2.0
# Offset, in cells, at which both sides of a face are looked at.
_BESIDE = 1e-3
# Memory per node of the largest step.
_BYTES = 500
_CHECKED = 20_000  # pieces of the mesh on which the field is checked


def from_mesh(
    mesh: Mesh,
    cells: int | tuple[int, int, int] = 64,
    *,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    material: str | None = None,
    most_memory: float = 4e9,
) -> Field:
    """Make the distance field of a mesh.

    A point is inside where the generalised winding number of the mesh is above 1/2. Meshes may be open, intersect
    themselves, lie in each other, and have faces twice: the surface of the field is the border of the inside. It closes
    holes, and has no walls within. Features thinner than about a cell are lost.

    Parameters
    ----------
    mesh
        The mesh. Its faces are counter-clockwise seen from outside. Its transform and instances are applied.
    cells
        Number of cells along the longest axis of the box, at least 16; or, with `lower` and `upper`, the numbers along
        the three axes.
    lower, upper
        (3,) corners of the box in the world. The box must contain the mesh, with a cell of margin, and its cells must
        be cubes. None: the mesh's bounding box and four cells around it, in numbers of cells that are multiples of 8.
    material
        Name of the field's material; None: the mesh's first one.
    most_memory
        Bytes that the conversion may need.

    Returns
    -------
    A field in world space, in metres. At the nodes of the grid it is the distance from the surface, exact within two
    cells, and accurate to first order of the size of a cell beyond.

    Raises
    ------
    ValueError
        If the mesh has no faces or encloses nothing, if it does not fit into the box, if the grid is too coarse for it
        or needs more memory than `most_memory`.

    Warns
    -----
    RuntimeWarning
        If a part of the surface is lost since it is thinner than a cell.
    """
    instance("from_mesh", "mesh", mesh, Mesh)
    mesh.validate("from_mesh")
    name = mesh.materials[0] if material is None else material
    mesh = expanded(mesh)
    label = topology.weld(mesh.vertices)
    vertices = mesh.vertices[topology.first_of_labels(label)]
    faces = label[mesh.faces.astype(np.int64)]
    low, spacing, count = _grid(vertices[np.unique(faces)], cells, lower, upper)
    shape = (int(count[0]) + 1, int(count[1]) + 1, int(count[2]) + 1)
    most = number("from_mesh", "most_memory", most_memory, above=0.0)
    if (needed := memory(shape)) > most:
        raise ValueError(f"from_mesh: a grid of {count[0]} x {count[1]} x {count[2]} cells needs about "
                         f"{needed / 1e9:.2g} GB, more than most_memory ({most / 1e9:.2g} GB); use fewer cells or "
                         "raise most_memory")
    surface = Surface.closed((vertices - low) / spacing, faces)
    values, kept = _signed_distances(surface, shape)
    found = spline.coefficients(values)
    _warn_of_losses(found, kept)
    return Field((found * spacing).astype(np.float32), name, low, low + spacing * count)


def memory(shape: tuple[int, int, int]) -> int:
    """Bytes that `from_mesh` needs for a grid of so many nodes, about."""
    return _BYTES * int(np.prod(np.array(shape, np.int64)))


def _grid(
    points: F64, cells: int | tuple[int, int, int], lower: ArrayLike | None, upper: ArrayLike | None
) -> tuple[F64, float, NDArray[np.int64]]:
    """Lower corner, size of a cell, and numbers of cells."""
    least, greatest = points.min(axis=0), points.max(axis=0)
    if lower is None and upper is None:
        across = whole("from_mesh", "cells", cells, 16, LARGEST_SIZE - LEAST_SIZE)
        extent = greatest - least
        if not extent.max() > 0.0:
            raise ValueError("from_mesh: all vertices of the mesh are at one place; separate them")
        across = -(-across // MULTIPLE) * MULTIPLE
        spacing = float(extent.max()) / (across - 2 * PADDING)
        needed = np.ceil(extent / spacing - 1e-9).astype(np.int64) + 2 * PADDING
        count = -(-needed // MULTIPLE) * MULTIPLE
        return 0.5 * (least + greatest) - (0.5 * count + _OFF_NODES) * spacing, spacing, count
    if lower is None or upper is None:
        raise ValueError("from_mesh: lower and upper need each other; give both or none")
    low = array("from_mesh", "lower", lower, (3,), np.float64, most=LARGEST_LENGTH)
    high = array("from_mesh", "upper", upper, (3,), np.float64, most=LARGEST_LENGTH)
    count = np.array(wholes("from_mesh", "cells", cells, 3, 1, LARGEST_SIZE - LEAST_SIZE))
    if not np.all(low < high):
        raise ValueError("from_mesh: lower must be below upper along each axis; swap them, or widen the box")
    size = (high - low) / count
    spacing = float(size.mean())
    if np.ptp(size) > 1e-6 * spacing:
        raise ValueError(f"from_mesh: the cells must be cubes, but have the sides {size[0]:.4g}, {size[1]:.4g} and "
                         f"{size[2]:.4g} m; choose other numbers of cells or another box")
    if np.any(least < low + spacing) or np.any(greatest > high - spacing):
        raise ValueError("from_mesh: the surface leaves the grid: the mesh needs a cell of margin within the box; "
                         "widen the box")
    return low, spacing, count


def _signed_distances(surface: Surface, shape: tuple[int, int, int]) -> tuple[F64, F64]:
    """Signed distances at nodes, and (n, 3, 3) the pieces of the mesh from which they are. In cells."""
    winding = surface.at_nodes(shape)
    inside = winding > 0.5
    corner, _ = pieces(surface.vertices[surface.faces])
    kept = _on_border(surface, corner)
    if not inside.any():
        if len(kept):
            raise ValueError("from_mesh: the grid is too small: no node of it is inside of the mesh, which is thinner "
                             "than a cell everywhere; use more cells")
        raise ValueError("from_mesh: the mesh encloses nothing: its winding number is nowhere above 1/2; close its "
                         "holes, or turn its faces round if they look inwards")
    for axis in range(3):
        ends = np.moveaxis(inside, axis, 0)
        if ends[0].any() or ends[-1].any():
            raise ValueError("from_mesh: the surface leaves the grid: a hole of the mesh is closed outside of the box; "
                             "close the hole, or widen the box")
    distance = near_distances(kept, shape, _BAND)
    _add_membranes(distance, winding, inside)
    distance = sweeping.distances(distance, np.ones(3))
    return np.where(inside, -distance, distance), kept


def _on_border(surface: Surface, corner: F64) -> F64:
    """Select the pieces of the mesh that have the inside on one side only. Others are walls within, or overlap."""
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    corner, offset = corner[length[:, 0] > 0.0], (_BESIDE * normal / np.where(length > 0.0, length, 1.0))[
        length[:, 0] > 0.0]  # fmt: skip
    middle = corner.mean(axis=1)
    on = _borders_at(surface, middle, offset)
    if on.all():
        return corner
    # Pieces that cross another part of the mesh are divided once more.
    crossing = np.zeros(len(corner), bool)
    for k in range(3):
        crossing |= _borders_at(surface, 0.1 * middle + 0.9 * corner[:, k], offset) != on
    small, number = pieces(corner[crossing], SMALL_PIECE)
    on_small = _borders_at(surface, small.mean(axis=1), offset[crossing][number])
    return np.concatenate([corner[on & ~crossing], small[on_small]])


def _borders_at(surface: Surface, places: F64, offset: F64) -> NDArray[np.bool_]:
    """Whether the inside is on one side only, at places of the mesh with an offset along the normal."""
    return (surface.at_points(places + offset) > 0.5) != (surface.at_points(places - offset) > 0.5)


def _add_membranes(distance: F64, winding: F64, inside: NDArray[np.bool_]) -> None:
    """Add the distances of nodes from the surface where it closes holes: there, the winding number is 1/2.

    Across the mesh the winding number jumps by 1; across a membrane it is smooth, and linear between two nodes. The
    distance from a plane that cuts the axes at a, b and c is (1 / a^2 + 1 / b^2 + 1 / c^2)^(-1/2).
    """
    square = np.zeros(distance.shape)
    for axis in range(3):
        w, within = np.moveaxis(winding, axis, 0), np.moveaxis(inside, axis, 0)
        total = np.moveaxis(square, axis, 0)
        changes = within[1:] != within[:-1]
        smooth = changes & (np.abs(np.diff(w, axis=0)) < 0.5)
        step = np.where(smooth, w[1:] - w[:-1], 1.0)
        t = np.where(smooth, np.clip((0.5 - w[:-1]) / step, 1e-3, 1.0 - 1e-3), np.inf)
        near = np.full(w.shape, np.inf)
        near[:-1] = t
        near[1:] = np.minimum(near[1:], np.where(smooth, 1.0 - t, np.inf))
        total += near**-2
    found = square > 0.0
    if found.any():
        # Also nodes near the mesh may be nearer to a membrane.
        reach = np.full(distance.shape, np.inf)
        reach[found] = square[found] ** -0.5
        reach = sweeping.distances(reach, np.ones(3))
        near = np.isfinite(distance) | found
        distance[near] = np.minimum(distance[near], reach[near])
    # Where the sign changes, both distances together are at most the way between the two nodes: also beside the border
    # of a hole, where the winding number is not linear, and where no piece was found.
    for axis in range(3):
        within, d = np.moveaxis(inside, axis, 0), np.moveaxis(distance, axis, 0)
        changes = within[1:] != within[:-1]
        one, other = np.minimum(d[:-1], 1.0), np.minimum(d[1:], 1.0)
        scale = 1.0 / np.maximum(one + other, 1.0)
        d[:-1] = np.where(changes, one * scale, d[:-1])
        d[1:] = np.where(changes, np.minimum(d[1:], other * scale), d[1:])


def _warn_of_losses(values: F64, kept: F64) -> None:
    """Warn of a part of the mesh that the field does not have. Everything in cells."""
    if len(kept) == 0:
        return
    chosen = kept[:: max(len(kept) // _CHECKED, 1)]
    normal = np.cross(chosen[:, 1] - chosen[:, 0], chosen[:, 2] - chosen[:, 0])
    area = np.linalg.norm(normal, axis=1)
    below = chosen.mean(axis=1) - 0.5 * normal / area[:, None]
    lost = float(area[spline.evaluate(values, below)[0] >= 0.0].sum() / area.sum())
    if lost > 0.001:
        warnings.warn(f"from_mesh: about {lost:.1%} of the surface is thinner than a cell and is lost; use more cells",
                      RuntimeWarning, stacklevel=3)

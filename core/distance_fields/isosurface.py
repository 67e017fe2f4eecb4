"""Meshes from fields: marching cubes, with the vertices at the zeros of the spline."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._check import flag, instance, number, whole
from ..geometry.labels import rows_and_places
from ..scene.field import Field
from ..scene.mesh import Mesh
from . import linear, spline
from .cell_cases import EDGES, triangles

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Vertices stay this fraction of an edge away from its ends, so that no two coincide.
_MARGIN = 1e-4
_STEPS = 40  # of Newton's method or bisection; a few suffice
# Memory per node of the grid on which the surface is sought.
_BYTES = 120


def to_mesh(
    field: Field,
    *,
    finer: int = 0,
    open_border: bool = False,
    most_memory: float = 4e9,
) -> Mesh:
    """Make a triangle mesh of the surface of a field.

    Each vertex is a zero of the field on an edge of its grid. The mesh is a manifold without gaps, and its faces look
    outward. Its shading normals are those of the field.

    Parameters
    ----------
    field
        The field. Its transform is applied.
    finer
        How often the cells are halved before: 0 to 4. Features between two nodes of the grid are missed.
    open_border
        Whether the surface may leave the box of the field: the mesh then has an open border there.
    most_memory
        Bytes that the conversion may need.

    Returns
    -------
    A mesh in world space, with the material of the field, and with its attributes at the vertices.

    Raises
    ------
    ValueError
        If the field has no surface, if it leaves the box and `open_border` is False, or if the grid needs more memory
        than `most_memory`.
    """
    instance("to_mesh", "field", field, Field)
    field.validate("to_mesh")
    finer = whole("to_mesh", "finer", finer, 0, 4)
    most = number("to_mesh", "most_memory", most_memory, above=0.0)
    count = field.cells << finer
    if (needed := _BYTES * int(np.prod(count + 1))) > most:
        raise ValueError(f"to_mesh: a grid of {count[0]} x {count[1]} x {count[2]} cells needs about "
                         f"{needed / 1e9:.2g} GB, more than most_memory ({most / 1e9:.2g} GB); lower finer or raise "
                         "most_memory")
    values = field.values.astype(np.float64)
    for _ in range(finer):
        values = spline.refined(values)
    grid, faces = zeros(values)
    if len(faces) == 0:
        raise ValueError("to_mesh: the field has no surface: its sign is the same at all nodes of its grid; shift its "
                         "values, or raise finer")
    if not flag("to_mesh", "open_border", open_border) and np.any((grid == 0.0) | (grid == count)):
        raise ValueError("to_mesh: the surface leaves the grid; sample the field on a larger box, or set open_border "
                         "for a mesh with an open border")
    to_world = field.grid_to_world()
    to_world[:, :3] /= 2**finer
    vertices = grid @ to_world[:, :3].T + to_world[:, 3]
    normals = spline.evaluate(values, grid)[1] @ np.linalg.inv(to_world[:, :3])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    usable = bool(length.min() > 0.0)
    if np.linalg.det(to_world[:, :3]) < 0.0:
        faces = faces[:, ::-1]
    corners = np.ascontiguousarray(faces, np.int32)
    held = {name: linear.sampled(layer, grid / count)[corners] for name, layer in field.attributes.items()}
    return Mesh(vertices, corners, (field.material,), smoothing=corners, normals=normals / length if usable else None,
                attributes=held, visible_to=field.visible_to)


def zeros(values: F64) -> tuple[F64, I64]:
    """Find the zeros of a spline.

    Returns
    -------
    (n, 3) vertices in grid coordinates, and (m, 3) faces that look to where the spline is positive.
    """
    # Coefficients are in single precision. Values within its rounding count as positive: a plane of nodes at which the
    # field is 0 would else have many small handles.
    inside = spline.node_values(values) < -float(np.finfo(np.float32).eps) * np.abs(values).max()
    shape = np.array(inside.shape)
    points: list[F64] = []
    number: list[I64] = []
    first = 0
    for axis in range(3):
        crossed = np.diff(np.moveaxis(inside, axis, 0).astype(np.int8), axis=0) != 0
        crossed = np.moveaxis(crossed, 0, axis)
        edges = np.argwhere(crossed)
        numbers = np.full(crossed.shape, -1, np.int64)
        numbers[tuple(edges.T)] = first + np.arange(len(edges))
        first += len(edges)
        number.append(numbers)
        points.append(edges.astype(np.float64))
        points[axis][:, axis] += _zero_on_edges(values, edges, axis)
    case = np.zeros(shape - 1, np.int64)
    for bits in range(8):
        x, y, z = (bits >> k & 1 for k in range(3))
        case |= inside[x : shape[0] - 1 + x, y : shape[1] - 1 + y, z : shape[2] - 1 + z].astype(np.int64) << bits
    cells = np.argwhere((case != 0) & (case != 255))
    count, table = triangles()
    which = case[tuple(cells.T)]
    row, place = rows_and_places(count[which])
    edge = EDGES[table[which[row], place]]  # (m, 3, 4)
    at = cells[row][:, None] + edge[..., 1:]
    faces = np.zeros((len(row), 3), np.int64)
    for axis in range(3):
        chosen = edge[..., 0] == axis
        faces[chosen] = number[axis][tuple(at[chosen].T)]
    return np.concatenate(points), faces


def _zero_on_edges(values: F64, edges: I64, axis: int) -> F64:
    """(n,) places in (0, 1) along edges at whose ends the spline has different signs.

    Along an edge the spline is a cubic polynomial with four coefficients. Newton's method, with bisection where it
    leaves the bracket of the zero.
    """
    for other in range(3):
        if other != axis:
            values = np.asarray(spline.filtered(values, other, spline.NODE_WEIGHTS), np.float64)
    lines = np.moveaxis(values, axis, 0)
    order = [axis, *(k for k in range(3) if k != axis)]
    i, j, k = edges[:, order].T
    c = np.stack([lines[i + step, j, k] for step in range(4)])
    low, high = np.zeros(len(edges)), np.ones(len(edges))
    begin = np.einsum("kn,kn->n", spline.basis(low)[0], c)
    end = np.einsum("kn,kn->n", spline.basis(high)[0], c)
    t = np.clip(begin / np.where(begin != end, begin - end, 1.0), 0.0, 1.0)
    for _ in range(_STEPS):
        weight, slope = spline.basis(t)
        value, steep = np.einsum("kn,kn->n", weight, c), np.einsum("kn,kn->n", slope, c)
        before = (value < 0.0) == (begin < 0.0)
        low, high = np.where(before, t, low), np.where(before, high, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            new = t - value / steep
        new = np.where((new > low) & (new < high), new, 0.5 * (low + high))
        if np.all(np.abs(new - t) < 1e-14):
            break
        t = new
    return np.clip(t, _MARGIN, 1.0 - _MARGIN)

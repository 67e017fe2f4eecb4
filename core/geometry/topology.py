"""Edge topology from positions: which faces share which edge.

A mesh may store one vertex several times (at sharp edges, at UV seams, or once per corner). Such a mesh must have the
same edges as the same surface with shared vertices: a seam that is counted as two open borders doubles its derivative.
Therefore coincident vertices are welded before edges are matched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .collinear import ROUNDING, collinear_faces, lines, pieces
from .junctions import junctions
from .labels import merge
from .points_on_edges import points_on_edges, sharp

# Distance, as a fraction of the size of the mesh, below which vertices are welded.
WELD_TOLERANCE = 1e-7
# Copies of a vertex are together up to this fraction of their coordinates: a few times the rounding of positions.
TOGETHER = 1e-6


@dataclass
class Edges:
    """Undirected edges of one or more meshes and the faces along them (any number per edge).

    Attributes
    ----------
    vertices
        (E, 2) indices of the end points into the stored, unwelded vertices. If copies of an end point exist,
        the index is that of the edge's first face.
    face_first
        (E + 1,) offsets into `faces`.
    faces
        Face indices; the faces of edge k are ``faces[face_first[k]:face_first[k + 1]]``.
    opposite
        Vertex index of the corner opposite the edge, for each entry of `faces`.
    copies
        (k, 2) vertices that were welded: each copy, and the first vertex at its place.
    collinear
        (k,) faces that were left out since their corners lie on one line.
    junctions
        (k, 3) vertices: the ends of a border, and a vertex on it at which it was divided (`geometry/junctions.py`).
    sharing
        (E,) number of edges of different meshes in the same place, of whose faces each has all
        (`geometry/joint_edges.py`); empty: each edge has its own faces.
    touching
        (k, 2) pairs of meshes whose edges lie on each other, whether they move alike or not.
    """

    vertices: NDArray[np.uint32]
    face_first: NDArray[np.uint32]
    faces: NDArray[np.uint32]
    opposite: NDArray[np.uint32]
    copies: NDArray[np.uint32]
    collinear: NDArray[np.uint32]
    junctions: NDArray[np.uint32]
    sharing: NDArray[np.uint8] = field(default_factory=lambda: np.zeros(0, np.uint8))
    touching: NDArray[np.uint32] = field(default_factory=lambda: np.zeros((0, 2), np.uint32))

    def __len__(self) -> int:
        return len(self.vertices)


def together(vertices: NDArray[np.floating[Any]], pairs: NDArray[np.integer[Any]]) -> NDArray[np.bool_]:
    """Return whether the two vertices of each of the (k, 2) pairs are in one place."""
    one, other = vertices[pairs[:, 0]], vertices[pairs[:, 1]]
    return np.asarray((np.abs(one - other) <= TOGETHER * np.abs(one).max(axis=1, initial=0.0)[:, None]).all(axis=1))


def weld(
    vertices: NDArray[np.float64], tolerance: float = WELD_TOLERANCE, of: NDArray[np.int64] | None = None
) -> NDArray[np.int64]:
    """Give each vertex a label such that coincident vertices have the same label.

    Parameters
    ----------
    vertices
        (n, 3) positions.
    tolerance
        Distance below which two vertices coincide, as a fraction of the diagonal of the mesh's bounding box.
    of
        (n,) index of the mesh of each vertex, counted from 0 without gaps, and ascending. Vertices of different
        meshes are never welded. None: all vertices belong to one mesh.

    Returns
    -------
    (n,) labels 0 … k - 1, in the order of the first vertex with each label.
    """
    if len(vertices) == 0:
        return np.zeros(0, np.int64)
    # Coincident vertices are nearly always exact copies. Hashing finds these first, and only one of each remains.
    of = np.zeros(len(vertices), np.int64) if of is None else of
    distinct, copy_of = _distinct_rows(_marked(vertices + 0.0, of))  # + 0.0: -0 is 0
    points, of = vertices[distinct], of[distinct]
    low, high = _bounds(points, of)
    size = np.linalg.norm(high - low, axis=1)
    step = np.maximum(size * tolerance, float(np.finfo(np.float32).tiny))[of][:, None]
    # Points in the same cell of a grid are candidates. A cell wall may separate a close pair along some axes, but then
    # the pair shares a cell of the grid that is shifted by half a cell along these axes. Hence eight shifted grids find
    # every pair closer than half a cell.
    scaled = (points - low[of]) / (2.0 * step)
    label = np.arange(len(points))
    near = _maybe_near(scaled, np.sqrt(3.0), of * (2.0 / tolerance))
    for shift in np.ndindex(2, 2, 2):
        if len(near) == 0:
            break
        cell = np.floor(scaled[near] + 0.5 * np.asarray(shift)).astype(np.int64)
        members, group = _shared_cells(_marked(cell, of[near]))
        if len(members):
            label = merge(label, near[members], group)
    label = label[copy_of]
    first = first_of_labels(label)[label]
    return (np.cumsum(first == np.arange(len(first))) - 1)[first]


def first_of_labels(label: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first vertex with each label, in the order of the labels; that of a label without a vertex is 0."""
    first = np.zeros(int(label.max(initial=-1)) + 1, np.int64)
    first[label[::-1]] = np.arange(len(label))[::-1]  # in reversed order, the first vertex is written last
    return first


def is_closed(faces: NDArray[np.signedinteger[Any]], label: NDArray[np.int64]) -> bool:
    """Return whether a mesh has no open border: whether each edge has two faces or more."""
    return bool((np.diff(edges(faces, label).face_first.astype(np.int64)) > 1).all())


def _marked(rows: NDArray[Any], of: NDArray[np.int64]) -> NDArray[Any]:
    """Append the mesh index to each row, if there are several meshes."""
    return np.column_stack([rows, of]) if of.any() else rows


def _bounds(points: NDArray[np.float64], of: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(k, 3) lower and upper corners of the points of each mesh."""
    order = np.argsort(of, kind="stable")
    first = np.searchsorted(of[order], np.arange(int(of.max()) + 1))
    return np.minimum.reduceat(points[order], first), np.maximum.reduceat(points[order], first)


def _maybe_near(
    points: NDArray[np.float64], distance: float, offset: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Indices of points that may have a neighbour within `distance`: all that have one, and few others.

    Neighbouring points have neighbouring projections on any line. Each projection costs one sort, and drops most points
    without a neighbour; its directions are chosen so that they are not symmetry axes of common meshes. `offset` is
    added to the projections and keeps the points of different meshes apart.
    """
    found = np.arange(len(points))
    for direction in ([0.7013, 0.5441, 0.4606], [-0.3931, 0.8217, 0.4126], [0.4909, -0.3457, 0.7997]):
        along = points[found] @ (np.asarray(direction) / np.linalg.norm(direction)) + offset[found]
        order = np.argsort(along)
        close = np.diff(along[order]) <= distance * 1.001
        kept = np.zeros(len(found), bool)
        kept[order[1:][close]] = True
        kept[order[:-1][close]] = True
        found = found[kept]
    return found


def _hash(rows: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """A 64 bit key per row (multiply and xor-shift, after MurmurHash3's finaliser)."""
    key = np.zeros(len(rows), np.uint64)
    for axis in range(rows.shape[1]):
        key ^= rows[:, axis]
        key *= np.uint64(0xFF51AFD7ED558CCD)
        key ^= key >> np.uint64(33)
    return key


def _distinct_rows(rows: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find distinct rows: the index of one row of each value, and for each row the number of its value."""
    key = _hash(rows.view(np.uint64))
    order = np.argsort(key)
    ordered = key[order]
    first_of_key = np.concatenate([[True], ordered[1:] != ordered[:-1]])
    found, copy_of = order[first_of_key], np.empty(len(rows), np.int64)
    copy_of[order] = np.cumsum(first_of_key) - 1
    if not np.array_equal(rows[found][copy_of], rows):  # a hash collision
        _, found, copy_of = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return found, copy_of.reshape(-1)


def _shared_cells(cell: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices of the rows that share their cell with another row, and the number of the cell of each."""
    key = _hash(cell.view(np.uint64))
    ordered = np.sort(key)
    repeated = ordered[1:][ordered[1:] == ordered[:-1]]
    if len(repeated) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    at = np.minimum(np.searchsorted(repeated, key), len(repeated) - 1)
    members = np.flatnonzero(repeated[at] == key)
    _, group = np.unique(cell[members], axis=0, return_inverse=True)
    return members, group.reshape(-1)


def edges(
    faces: NDArray[np.signedinteger[Any]], label: NDArray[np.int64], vertices: NDArray[np.floating[Any]] | None = None,
    of: NDArray[np.int64] | None = None,
) -> Edges:
    """Find the edges of a mesh and the faces along each, from the labels of the welded vertices.

    Parameters
    ----------
    faces
        (m, 3) vertex indices.
    label
        Labels of `weld`.
    vertices
        (n, 3) positions, by which faces with all corners on one line are left out (`geometry/collinear.py`). None:
        they count as others do.
    of
        (n,) index of the mesh of each vertex, as for `weld`.

    Returns
    -------
    The edges, in the order of the first face of each. Neighbours in this order are often neighbours in space, which
    keeps rays from them coherent. Faces with two corners at one place have no area and are left out: on no side of
    their edges is there anything, as in a cube whose scale along an axis is zero.
    """
    found = _edges(faces, label, vertices, np.zeros((0, 3), faces.dtype))
    if vertices is None:
        return found
    closing = _ends_of_other_parts(found, faces, label, vertices, np.zeros(len(label), np.int64) if of is None else of)
    open_border = np.diff(found.face_first.astype(np.int64)) == 1
    if open_border.any():
        place = first_of_labels(label)
        borders = junctions(vertices[place].astype(np.float64), label[found.vertices[open_border]])
        closing = np.concatenate([closing, place[borders]])
    return _edges(faces, label, vertices, closing.astype(faces.dtype)) if len(closing) else found


def _ends_of_other_parts(
    found: Edges, faces: NDArray[np.signedinteger[Any]], label: NDArray[np.int64],
    vertices: NDArray[np.floating[Any]], of: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Return (k, 3) ends of edges and points on these, where edges of other parts of the mesh end that go along them.

    Parts have ranges of the stored vertices of their own, as bricks that were joined to one mesh.
    """
    none = np.zeros((0, 3), np.int64)
    if len(faces) == 0:
        return none
    # A part ends behind a vertex where all faces have ended that began
    low, high = (limit(limit(faces[:, 0], faces[:, 1]), faces[:, 2]) for limit in (np.minimum, np.maximum))
    pending = np.cumsum(np.bincount(low, minlength=len(label)) - np.bincount(high, minlength=len(label)))
    part = np.cumsum(np.concatenate([[0], pending[:-1] == 0]))
    with_faces = np.bincount(part[low]) > 0
    mesh_of_part = np.zeros(len(with_faces), np.int64)
    mesh_of_part[part[low]] = of[low]
    several = np.bincount(mesh_of_part[with_faces]) > 1
    if not several.any():
        return none
    begin, ends = found.face_first.astype(np.int64), found.vertices.astype(np.int64)
    rows = np.flatnonzero(several[of[ends[:, 0]]])
    rows = rows[sharp(vertices, ends[rows], begin[rows], np.diff(begin)[rows], found.opposite)]
    point, edge = points_on_edges(vertices, ends[rows], label, part[ends[rows, 0]], of[ends[rows, 0]],
                                  ROUNDING * float(np.abs(vertices).max()))
    return np.column_stack([ends[rows[edge]], point])


def _edges(
    faces: NDArray[np.signedinteger[Any]], label: NDArray[np.int64], vertices: NDArray[np.floating[Any]] | None,
    closing: NDArray[np.signedinteger[Any]],
) -> Edges:
    """Find the edges as if triangles without area, of the vertices `closing` (k, 3), belonged to the mesh."""
    if len(faces) == 0:
        none, pairs = np.zeros(0, np.uint32), np.zeros((0, 2), np.uint32)
        return Edges(pairs, np.zeros(1, np.uint32), none, none, pairs, none, np.zeros((0, 3), np.uint32))
    real_faces = len(faces)
    faces = np.concatenate([faces, closing])
    # Corner k of a face represents the edge from corner k to the next corner: a, b, and the opposite corner.
    a, b, opposite = (np.roll(faces, -k, axis=1).ravel() for k in range(3))
    face = np.repeat(np.arange(len(faces), dtype=np.uint32), 3)
    one, other = label[a], label[b]
    real = np.repeat((one != other).reshape(-1, 3).all(axis=1), 3)
    if not real.all():
        a, b, opposite, face, one, other = (x[real] for x in (a, b, opposite, face, one, other))
    collinear = np.zeros(0, np.uint32)
    if vertices is not None:
        flat = collinear_faces(vertices, faces[face[::3]]) | (face[::3] >= real_faces)
        if flat.any():
            collinear = face[::3][flat & (face[::3] < real_faces)]
            a, b, opposite, face = _without(np.repeat(flat, 3), label, vertices, (a, b, opposite, face))
            one, other = label[a], label[b]
    key = _keys(one, other, label)
    order, ordered = _sorted(key)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(ordered) != 0]) if len(key) else np.zeros(0, bool))
    count = np.diff(starts, append=len(key))
    first = order[starts]  # the first corner of each edge
    is_first = np.zeros(len(key), bool)
    is_first[first] = True
    rank = np.cumsum(is_first)[first] - 1 if len(key) else first  # number of each edge in the order of first corners
    by_rank = np.empty_like(count)
    by_rank[rank] = count
    face_first = np.concatenate([[0], np.cumsum(by_rank)])
    place = np.repeat(face_first[rank] - starts, count) + np.arange(len(key))
    listed = np.empty_like(order)
    listed[place] = order
    at = first_of_labels(label)[label]
    copies = np.flatnonzero(at != np.arange(len(label)))
    return Edges(
        np.stack([a[is_first], b[is_first]], axis=1).astype(np.uint32),
        face_first.astype(np.uint32),
        face[listed],
        opposite[listed].astype(np.uint32),
        np.stack([copies, at[copies]], axis=1).astype(np.uint32),
        collinear,
        closing.astype(np.uint32),
    )


def _keys(one: NDArray[np.int64], other: NDArray[np.int64], label: NDArray[np.int64]) -> NDArray[np.int64]:
    """A number of the edge between two labels, whatever its direction."""
    return np.minimum(one, other) * (int(label.max()) + 1) + np.maximum(one, other)


def _without(
    flat: NDArray[np.bool_], label: NDArray[np.int64], vertices: NDArray[np.floating[Any]],
    sides: tuple[NDArray[Any], ...],
) -> tuple[NDArray[Any], ...]:
    """Leave out the sides of collinear faces (`flat`, by side), and cut those of their neighbours at their corners.

    `sides` are two ends, the opposite corner and the face of each side, by vertex.
    """
    a, b, opposite, face = sides
    key = _keys(label[a], label[b], label)
    line = lines(key[flat])
    known, which = np.unique(key[flat], return_index=True)
    at = np.minimum(np.searchsorted(known, key), len(known) - 1)
    beside = ~flat & (known[at] == key)
    vertex = first_of_labels(label)
    cut, ends = pieces(
        vertices[vertex].astype(np.float64), label[a[flat]].astype(np.int64), np.repeat(line, 3),
        np.stack([label[a[beside]], label[b[beside]]], axis=1), np.repeat(line, 3)[which[at[beside]]],
    )  # fmt: skip
    side = np.flatnonzero(beside)[cut]
    whole = np.flatnonzero(~flat & ~beside)
    order = np.argsort(np.concatenate([whole, side]), kind="stable")
    new = vertex[ends].astype(a.dtype)
    return (np.concatenate([a[whole], new[:, 0]])[order], np.concatenate([b[whole], new[:, 1]])[order],
            np.concatenate([opposite[whole], opposite[side]])[order], np.concatenate([face[whole], face[side]])[order])


def _sorted(key: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sort keys stably: return the permutation and the sorted keys."""
    bits = max(len(key) - 1, 1).bit_length()
    if len(key) == 0 or int(key.max()).bit_length() + bits > 63:
        order = np.argsort(key, kind="stable")
        return order, key[order]
    # Pack key and index into one integer: a sort of values is faster than an argsort.
    joined = np.sort((key << bits) | np.arange(len(key)))
    return joined & ((1 << bits) - 1), joined >> bits


def join(parts: list[Edges], vertex_first: Sequence[int], face_first: Sequence[int]) -> Edges:
    """Join the edges of several meshes; indices refer to the concatenated vertices and faces."""
    if not parts:
        return edges(np.zeros((0, 3), np.int32), np.zeros(0, np.int64))
    offset = np.cumsum([0] + [len(p.faces) for p in parts])
    return Edges(
        np.concatenate([p.vertices + np.uint32(v) for p, v in zip(parts, vertex_first, strict=False)]),
        np.concatenate([p.face_first[:-1] + np.uint32(o) for p, o in zip(parts, offset, strict=False)]
                       + [np.array([offset[-1]], np.uint32)]),
        np.concatenate([p.faces + np.uint32(f) for p, f in zip(parts, face_first, strict=False)]),
        np.concatenate([p.opposite + np.uint32(v) for p, v in zip(parts, vertex_first, strict=False)]),
        np.concatenate([p.copies + np.uint32(v) for p, v in zip(parts, vertex_first, strict=False)]),
        np.concatenate([p.collinear + np.uint32(f) for p, f in zip(parts, face_first, strict=False)]),
        np.concatenate([p.junctions + np.uint32(v) for p, v in zip(parts, vertex_first, strict=False)]),
    )

"""Shape queries of meshes, which decide whether a mesh can occlude or intersect itself or another mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.mesh import Mesh
from . import topology
from .box_tree import BoxTree, meeting
from .mesh_batches import joined

# Distances below this fraction of the size of a mesh count as contact.
TOLERANCE = 1e-6
# Products of three distances below this fraction of the cubed size count as rounding errors.
ROUNDING = 1e-12
# Largest number of vertex-face pairs that `convex` tests; it returns False for larger meshes.
MOST_PAIRS = 50_000_000
# Largest number of instance pairs with overlapping boxes that `may_cross` tests; it returns True beyond.
MOST_COPIES = 100


def face_normals(mesh: Mesh) -> NDArray[np.float64]:
    """(m, 3) unit normals; 0 for faces without area."""
    return normals_of(mesh.vertices, mesh.faces)


def normals_of(vertices: NDArray[np.float64], faces: NDArray[np.integer[Any]]) -> NDArray[np.float64]:
    """(m, 3) unit normals of faces (m, 3); 0 for faces without area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return normal / np.where(length > 0.0, length, 1.0)


def convex(mesh: Mesh) -> bool:
    """Whether the mesh is a flat sheet or a closed convex body, so that it casts no shadow on itself.

    An open part of a convex body (a bowl) is neither: its rim casts a shadow on its inside. Returns False without a
    test for meshes of more than `MOST_PAIRS` vertex-face pairs.
    """
    if len(mesh.faces) * len(mesh.vertices) > MOST_PAIRS:
        return False
    normal = face_normals(mesh)
    used = mesh.vertices[np.unique(mesh.faces)]
    middle = used.mean(axis=0)
    used = used - middle
    slack = TOLERANCE * float(np.linalg.norm(np.ptp(used, axis=0)))
    at = np.einsum("ij,ij->i", normal, mesh.vertices[mesh.faces[:, 0]] - middle)
    low, high = np.inf, -np.inf
    for rows in np.array_split(np.arange(len(normal)), max(1, len(normal) // 1000)):
        height = normal[rows] @ used.T - at[rows, None]
        low, high = min(low, float(height.min())), max(high, float(height.max()))
    if high <= slack and low >= -slack:
        return True
    closed = bool((np.diff(topology.edges(mesh.faces, topology.weld(mesh.vertices)).face_first.astype(int)) == 2).all())
    return closed and (high <= slack or low >= -slack)


def star_shaped(mesh: Mesh) -> bool:
    """Whether a closed mesh is star-shaped about the centre of its bounding box; then it cannot intersect itself.

    False if the test is not certain. The proof stands in native/boundary/meshes/star_shaped.h.
    """
    if len(mesh.faces) == 0:
        return False
    used = mesh.vertices[np.unique(mesh.faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    size = float(np.linalg.norm(high - low))
    at = mesh.vertices - 0.5 * (low + high)
    p, q, r = (at[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(q - p, r - p)
    height = np.einsum("ij,ij->i", normal, p)
    side = 1.0 if height[0] >= 0.0 else -1.0
    if not (side * height > TOLERANCE * size * np.linalg.norm(normal, axis=1)).all():
        return False
    way = (p[0] + q[0] + r[0]) / 3.0
    inside = np.all([side * (np.cross(u, v) @ way) > -ROUNDING * size**3 for u, v in ((p, q), (q, r), (r, p))], axis=0)
    if np.count_nonzero(inside) != 1:
        return False
    edges = topology.edges(mesh.faces, topology.weld(mesh.vertices))
    if (np.diff(edges.face_first.astype(np.int64)) != 2).any():
        return False
    # Two faces of the same winding must lie on different sides of the plane through their edge and the centre.
    along = np.cross(at[edges.vertices[:, 0]], at[edges.vertices[:, 1]])
    sides = [np.einsum("ij,ij->i", along, at[edges.opposite[k::2]]) > 0.0 for k in (0, 1)]
    return bool((sides[0] != sides[1]).all())


def pierces(a: Mesh, b: Mesh) -> bool:
    """Whether two meshes may intersect: False only if they certainly do not."""
    corners = [(m.vertices.min(axis=0), m.vertices.max(axis=0)) for m in (a, b)]
    (low_a, high_a), (low_b, high_b) = corners
    slack = TOLERANCE * max(float(np.linalg.norm(high - low)) for low, high in corners)
    if (low_a >= high_b - slack).any() or (low_b >= high_a - slack).any():
        return False  # apart, or touching
    return not (_one_sided(a, b, slack) or _one_sided(b, a, slack))


def pair_words(one: str, other: str) -> str:
    """Describe a pair of intersecting meshes for a sentence."""
    return f"'{one}' and '{other}'" if one != other else f"instances of '{one}'"


def may_cross(a: Mesh, b: Mesh, *, same: bool = False) -> bool:
    """Whether instances of two meshes may intersect or, with `same`, two different instances of one mesh."""
    if a.instances is None and b.instances is None:
        return not same and pierces(a, b)
    tried = []
    for i, j in meeting(BoxTree(*copy_boxes(a)), None if same else BoxTree(*copy_boxes(b))):
        tried += list(zip(i[: MOST_COPIES + 1].tolist(), j[: MOST_COPIES + 1].tolist(), strict=True))
        if len(tried) > MOST_COPIES:
            return True
    return any(pierces(_copy(a, i), _copy(b, j)) for i, j in tried)


def copy_boxes(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(k, 3) lower and upper corners of the bounding boxes of the instances of a mesh."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    if mesh.instances is None:
        return low[None], high[None]
    middle = mesh.instances[:, :3, :3] @ (0.5 * (low + high)) + mesh.instances[:, :3, 3]
    half = np.abs(mesh.instances[:, :3, :3]) @ (0.5 * (high - low))
    return middle - half, middle + half


def copies_near(mesh: Mesh, low: NDArray[np.float64], high: NDArray[np.float64]) -> Iterator[Mesh]:
    """Instances of a mesh, as meshes, whose bounding boxes overlap a box."""
    lows, highs = copy_boxes(mesh)
    return (_copy(mesh, int(i)) for i in np.flatnonzero(((lows <= high) & (highs >= low)).all(axis=1)))


def _copy(mesh: Mesh, number: int) -> Mesh:
    if mesh.instances is None:
        return mesh
    place = mesh.instances[number]
    return Mesh(mesh.vertices @ place[:3, :3].T + place[:3, 3], mesh.faces, ())


def hide_nothing(placed: Sequence[Mesh]) -> bool:
    """Whether no point of some opaque meshes can be occluded from another: one convex mesh, or two disjoint ones.

    A segment between two disjoint convex bodies has no point inside either of them.
    """
    if len(placed) > 2 or any(mesh.instances is not None for mesh in placed):
        return False
    return (len(placed) < 2 or not pierces(*placed)) and all(convex(mesh) for mesh in placed)


def _one_sided(sheet: Mesh, other: Mesh, slack: float) -> bool:
    """Whether `sheet` is flat and `other` lies on one side of its plane; contact is allowed."""
    normal = face_normals(sheet)
    normal = normal[np.argmax(np.abs(normal).sum(axis=1))]
    at = sheet.vertices[sheet.faces[0, 0]]
    if np.abs((sheet.vertices - at) @ normal).max() > slack:
        return False
    height = (other.vertices - at) @ normal
    return bool(height.min() >= -slack or height.max() <= slack)


def thickness(meshes: Sequence[Mesh]) -> NDArray[np.float64]:
    """(n,) largest distance of the vertices of each mesh from the plane of one of its non-degenerate faces."""
    out = np.empty(len(meshes))
    for batch in joined(meshes):
        normal = normals_of(batch.vertices, batch.faces)
        area = np.abs(normal).sum(axis=1)
        largest = np.maximum.reduceat(area, batch.first_face[:-1])
        found = np.flatnonzero(area == largest[batch.mesh_of_face])
        face = found[np.searchsorted(found, batch.first_face[:-1])]  # the first such face of each mesh
        of = batch.mesh_of_vertex
        at = batch.vertices[batch.faces[batch.first_face[:-1], 0]]
        height = np.abs(np.einsum("ij,ij->i", batch.vertices - at[of], normal[face][of]))
        out[batch.first : batch.last] = np.maximum.reduceat(height, batch.first_vertex[:-1])
    return out

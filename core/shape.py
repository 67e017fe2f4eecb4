"""Questions about the shape of meshes that decide whether something can hide or pierce something else."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from . import topology
from .mesh import Mesh

# Distances below this fraction of the size count as touching.
TOLERANCE = 1e-6
# Vertex and face pairs beyond which `convex` gives up and answers no.
MOST_PAIRS = 50_000_000


def face_normals(mesh: Mesh) -> NDArray[np.float64]:
    """(m, 3) unit normals; 0 for faces without area."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return normal / np.where(length > 0.0, length, 1.0)


def convex(mesh: Mesh) -> bool:
    """Whether the mesh is a flat sheet or a closed convex body, so that it hides no light from itself.

    An open part of a convex body (a bowl) is neither: its rim shades its inside. For a mesh so large
    that the test would take long the answer is False.
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


def pierces(a: Mesh, b: Mesh) -> bool:
    """Whether two meshes may pass through each other: False only if they certainly do not."""
    corners = [(m.vertices.min(axis=0), m.vertices.max(axis=0)) for m in (a, b)]
    (low_a, high_a), (low_b, high_b) = corners
    slack = TOLERANCE * max(float(np.linalg.norm(high - low)) for low, high in corners)
    if (low_a >= high_b - slack).any() or (low_b >= high_a - slack).any():
        return False  # apart, or touching
    return not (_one_sided(a, b, slack) or _one_sided(b, a, slack))


def crossing_pairs(placed: Mapping[str, Mesh]) -> list[tuple[str, str]]:
    """Names of meshes that may pass through each other; instances are not looked at."""
    alone = [name for name in placed if placed[name].instances is None]
    return [(one, other) for one, other in combinations(alone, 2) if pierces(placed[one], placed[other])]


def close_pairs(placed: Mapping[str, Mesh], pairs: Collection[tuple[str, str]]) -> list[tuple[str, str]]:
    """Those of some pairs of meshes whose bounding boxes meet, in the order of `placed`, without instances."""
    return [(one, other) for one, other in combinations(placed, 2)
            if {(one, other), (other, one)} & set(pairs) and _boxes_meet(placed[one], placed[other])]


def _boxes_meet(a: Mesh, b: Mesh) -> bool:
    if a.instances is not None or b.instances is not None:
        return False
    (low_a, high_a), (low_b, high_b) = ((m.vertices.min(axis=0), m.vertices.max(axis=0)) for m in (a, b))
    slack = TOLERANCE * float(np.linalg.norm(np.maximum(high_a, high_b) - np.minimum(low_a, low_b)))
    return bool((low_a <= high_b + slack).all() and (low_b <= high_a + slack).all())


def hide_nothing(placed: Sequence[Mesh]) -> bool:
    """Whether nothing is between any two points of some opaque meshes: one or two convex ones, apart from each other.

    A straight line from one to the other has left the first and hasn't met the second.
    """
    if len(placed) > 2 or any(mesh.instances is not None for mesh in placed):
        return False
    return (len(placed) < 2 or not pierces(*placed)) and all(convex(mesh) for mesh in placed)


def _one_sided(sheet: Mesh, other: Mesh, slack: float) -> bool:
    """Whether `sheet` is flat and `other` stays on one side of its plane (it may stand on it)."""
    normal = face_normals(sheet)
    normal = normal[np.argmax(np.abs(normal).sum(axis=1))]
    at = sheet.vertices[sheet.faces[0, 0]]
    if np.abs((sheet.vertices - at) @ normal).max() > slack:
        return False
    height = (other.vertices - at) @ normal
    return bool(height.min() >= -slack or height.max() <= slack)

"""What a mesh is as a surface, and how far two surfaces are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._check import instance, whole
from ..geometry.labels import connected
from ..geometry.topology import weld
from ..scene.mesh import Mesh
from ..scene.placement import expanded
from .closest import nearest

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class Topology:
    """The topology of a mesh whose coincident vertices are welded.

    Attributes
    ----------
    components
        Number of connected parts.
    euler_number
        Vertices - edges + faces: 2 for a sphere, 0 for a torus, -2 for a surface with two holes.
    open_edges
        Edges with one face.
    crowded_edges
        Edges with more than two faces.
    turned_edges
        Edges whose two faces look to different sides.
    pinched_vertices
        Vertices at which several fans of faces meet.
    """

    components: int
    euler_number: int
    open_edges: int
    crowded_edges: int
    turned_edges: int
    pinched_vertices: int

    @property
    def is_closed_manifold(self) -> bool:
        """Whether the mesh is the oriented border of a solid."""
        return not (self.open_edges or self.crowded_edges or self.turned_edges or self.pinched_vertices)

    @property
    def genus(self) -> int:
        """Number of handles, in all components together. Of a closed manifold only."""
        if not self.is_closed_manifold:
            raise ValueError("genus: the mesh is not a closed manifold, so it has no genus; look at its open, crowded "
                             "and turned edges")
        return (2 * self.components - self.euler_number) // 2


def topology(mesh: Mesh) -> Topology:
    """Count components, borders and handles of a mesh.

    Faces without an area between welded vertices are left out.
    """
    instance("topology", "mesh", mesh, Mesh)
    mesh.validate("topology")
    label = weld(mesh.vertices)
    faces = label[mesh.faces.astype(np.int64)]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    count = int(label.max(initial=-1)) + 1
    start, end = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    key = np.minimum(start, end) * count + np.maximum(start, end)
    edge, of = np.unique(key, return_inverse=True)
    of = of.reshape(-1)
    sides = np.bincount(of, minlength=len(edge))
    net = np.bincount(of, np.where(start < end, 1.0, -1.0), minlength=len(edge))
    used = np.unique(faces)
    group = connected(start, end, count)
    # Fans: corners (a face at a vertex) are connected where two faces share an edge at the vertex.
    corner = np.concatenate([np.arange(len(start)), (np.arange(len(start)) // 3) * 3 + (np.arange(len(start)) + 1) % 3])
    at = np.concatenate([start, end]) * len(edge) + np.concatenate([of, of])
    order = np.argsort(at, kind="stable")
    same = at[order][1:] == at[order][:-1]
    fans = connected(corner[order][:-1][same], corner[order][1:][same], len(start))
    fan_at = np.unique(np.stack([start, fans], axis=1), axis=0)[:, 0]
    return Topology(
        len(np.unique(group[used])), len(used) - len(edge) + len(faces), int((sides == 1).sum()),
        int((sides > 2).sum()), int(((sides == 2) & (net != 0.0)).sum()),
        int((np.bincount(fan_at, minlength=count)[used] > 1).sum()),
    )  # fmt: skip


def chamfer_distance(one: Mesh, other: Mesh, *, samples: int = 10_000, seed: int = 0) -> float:
    """Return the Chamfer distance of two surfaces, in metres.

    It is the mean distance of points of one surface from the other surface, averaged over both directions. The points
    are uniform over the area. The distances are exact, so that equal surfaces have the distance 0.

    Parameters
    ----------
    one, other
        Meshes; their transforms and instances are applied.
    samples
        Number of points on each.
    seed
        Seed of the points.
    """
    samples = whole("chamfer_distance", "samples", samples, 1, 10_000_000)
    rng = np.random.default_rng(whole("chamfer_distance", "seed", seed, 0, 0xFFFFFFFF))
    corners = []
    for name, mesh in (("one", one), ("other", other)):
        instance("chamfer_distance", name, mesh, Mesh)
        mesh.validate(name)
        placed = expanded(mesh)
        corners.append(placed.vertices[placed.faces])
    means = [nearest(_points_on(a, samples, rng), b)[2].mean() for a, b in (corners, corners[::-1])]
    return float(np.mean(means))


def _points_on(corner: F64, count: int, rng: np.random.Generator) -> F64:
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    total = np.cumsum(area)
    face = np.searchsorted(total, rng.uniform(0.0, total[-1], count), side="right").clip(0, len(corner) - 1)
    u, v = np.sqrt(rng.uniform(size=count)), rng.uniform(size=count)
    weight = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
    return np.asarray(np.einsum("nk,nkj->nj", weight, corner[face]))

"""Meshes that absorb light or hold a medium, and what stands in the way of Beer's law within them.

Light is absorbed where it arrives at the back of a surface that absorbs. So a mesh must be closed, and light that
arrives at another object within it is not absorbed. Media must be closed, too. This is found on the exported scene and
reported.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.distance_fields.winding import Surface
from edgegrad.geometry import topology
from edgegrad.scene.placement import places

from ..exported import Export

F64 = NDArray[np.float64]

# Places of a mesh, and vertices of each other mesh, that are tested at most.
MOST_PLACES, MOST_POINTS = 16, 64


def warn_about_absorbing(out: Export) -> None:
    """Report open meshes that absorb light, and objects within meshes that do."""
    for name, mesh in out.scene.meshes.items():
        absorbs = any(_absorbs(out.scene, material) for material in mesh.materials)
        media = media_of(out.scene, name)
        filled = media != [None]
        if not absorbs and not filled:
            continue
        where = f"object '{out.meshes[name].object}'"
        if len(media) > 1:
            out.report.warn(where, "holds a volume, but not all of its faces have a material with that volume: rays "
                            "that pass the others get wrong ways in it; give all faces the same volume")  # fmt: skip
        label = topology.weld(mesh.vertices)
        is_closed = topology.is_closed(mesh.faces, label)
        if filled and not is_closed:
            out.report.warn(where, "holds a volume, but its mesh has open borders: rays that pass them get wrong ways "
                            "in the volume; close them")  # fmt: skip
        if not absorbs:
            continue
        if not is_closed:
            out.report.warn(where, "absorbs light, but its mesh has open borders: light that leaves by them is not "
                            "absorbed; close them")  # fmt: skip
        for other in _within(out.scene, name, label):
            out.report.warn(where, f"absorbs light, but not on its way to object '{out.meshes[other].object}', which "
                            "stands in it")  # fmt: skip


def media_of(scene: edgegrad.Scene, name: str) -> list[edgegrad.Medium | None]:
    """The different media of the materials of a mesh; None is that of a material without a medium."""
    found = (one.medium for material in scene.meshes[name].used_materials for one in scene.closures(material))
    return list(dict.fromkeys(found))


def _absorbs(scene: edgegrad.Scene, name: str) -> bool:
    material = scene.materials[name]
    if isinstance(material, edgegrad.Material):
        return bool(np.any(material.absorption > 0.0))
    return any(_absorbs(scene, part) for part in material.parts)


def _within(scene: edgegrad.Scene, name: str, label: NDArray[np.int64]) -> list[str]:
    """Names of the meshes of which a vertex is inside of another mesh, whose coincident vertices have equal labels."""
    mesh = scene.meshes[name]
    vertices = np.asarray(mesh.vertices, np.float64)[topology.first_of_labels(label)]
    surface = Surface.closed(vertices, label[mesh.faces])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    found = []
    for other, there in scene.meshes.items():
        if other == name or len(there.vertices) == 0:
            continue
        points = _points(there)
        for place in places(mesh)[:MOST_PLACES]:
            inside = (points - place[:, 3]) @ np.linalg.pinv(place[:, :3]).T
            inside = inside[((inside > low) & (inside < high)).all(axis=1)][:MOST_POINTS]
            if len(inside) and (np.abs(surface.at_points(inside)) > 0.5).any():
                found.append(other)
                break
    return found


def _points(mesh: edgegrad.Mesh) -> F64:
    """Some of the vertices of all places of a mesh, in world space."""
    step = -(-len(mesh.vertices) // MOST_POINTS)
    chosen = np.asarray(mesh.vertices, np.float64)[::step]
    placed = places(mesh)[:MOST_PLACES]
    return np.concatenate([chosen @ place[:, :3].T + place[:, 3] for place in placed])

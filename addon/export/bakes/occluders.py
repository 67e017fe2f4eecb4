"""What Ambient Occlusion nodes see beside the object that is baked: all other meshes of the export, as one mesh."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..geometry.group import Group
from ..nodes.links import reached

# The copy of more triangles would need too much memory for a bake.
MOST_TRIANGLES = 10_000_000


def sees_others(materials: Iterable[Any]) -> bool:
    """Whether a material has an Ambient Occlusion node that sees other objects."""
    return any(node.type == "AMBIENT_OCCLUSION" and not node.only_local
               for material in materials for node in reached(material.node_tree))  # fmt: skip


class Occluders:
    """The triangles around an object, in world space.

    Parameters
    ----------
    groups
        All meshes of the export.
    own
        The group of the object, which is the first of its instances.
    """

    def __init__(self, groups: Sequence[Group], own: Group) -> None:
        places = [(group.arrays, source.matrix) for group in groups if "shadow" in group.visible
                  for k, source in enumerate(group.sources) if group is not own or k > 0]  # fmt: skip
        self.count = sum(len(arrays.faces) for arrays, _ in places)
        points, faces, first = [np.zeros((0, 3))], [np.zeros((0, 3), np.int32)], 0
        for arrays, matrix in places if self.count <= MOST_TRIANGLES else ():
            points.append(arrays.positions @ matrix[:3, :3].T + matrix[:3, 3])
            faces.append(arrays.faces + first)
            first += len(arrays.positions)
        self.points: NDArray[np.float32] = np.concatenate(points).astype(np.float32)
        self.faces: NDArray[np.int32] = np.concatenate(faces).astype(np.int32)

    def key(self) -> bytes:
        """Hash of the triangles."""
        return hashlib.sha256(self.points.tobytes() + self.faces.tobytes()).digest()

    def mesh(self) -> Any:
        """Return a new mesh of Blender with the triangles."""
        made = bpy.data.meshes.new("Edgegrad bake")
        made.vertices.add(len(self.points))
        made.vertices.foreach_set("co", self.points.ravel())
        made.loops.add(self.faces.size)
        made.loops.foreach_set("vertex_index", self.faces.ravel())
        made.polygons.add(len(self.faces))
        made.polygons.foreach_set("loop_start", np.arange(0, self.faces.size, 3, dtype=np.int32))
        made.update(calc_edges=True)
        return made

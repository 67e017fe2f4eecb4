"""The edges of a scene as they were found, and whether they still are what they were after vertices have moved."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from ..geometry.collinear import collinear_faces
from ..geometry.joint_edges import joint_edges, with_faces_of_all
from ..geometry.topology import Edges, together
from ..tables.tables import Tables


class SceneEdges:
    """The edges of all meshes.

    Parameters
    ----------
    tables
        Of the scene.
    copies
        (k, 2) vertices that were welded at first, if the edges of the scene have been found before: they may meet
        again.
    """

    def __init__(self, tables: Tables, copies: NDArray[np.int64] | None = None) -> None:
        self._all = tables.edges()
        self._origin = tables.origin
        self.copies = self._all.copies.astype(np.int64) if copies is None else copies
        self._together = together(tables.vertices, self.copies)
        self._collinear = np.concatenate([tables.faces[self._all.collinear], self._all.junctions]).astype(np.int64)
        own_face = self._all.faces[self._all.face_first[:-1]]
        mesh = np.searchsorted(tables.mesh_first_face, own_face, side="right") - 1
        # Faces of meshes that other rays meet, or other lights light, are not one surface
        meshes = len(tables.mesh_names)
        kind = (tables.mesh_receivers[:meshes].astype(np.int64) << 32) + tables.mesh_mask[:meshes]
        kind[tables.instance_mesh] = -1  # their vertices are in a space of their own
        self._joint = joint_edges(self._all, tables.vertices, tables.mesh_first_vertex, mesh, kind)
        self._met = together(tables.vertices, self._joint.vertices)
        self._groups = np.zeros(len(self._joint.first) - 1, np.bool_)
        self.current = self._all

    def for_moving(self, moving: Collection[int]) -> Edges:
        """Return the edges for a derivative by which some meshes move."""
        groups = self._joint.alike(moving)
        if not np.array_equal(groups, self._groups):
            self._groups = groups
            self.current = with_faces_of_all(self._all, self._joint, groups)
        return self.current

    def hold(self, vertices: NDArray[np.floating], first: int = 0) -> bool:
        """Return whether the edges are the same for other positions.

        Faces along edges change if copies of vertices move apart or meet again, if a face on a line comes to have an
        area, if a vertex leaves the border that it divides, or if edges of several meshes move apart.

        Parameters
        ----------
        vertices
            (n, 3) positions of all vertices, or of those of one mesh.
        first
            Number of the first of them.
        """
        copies, corners = ((rows >= first).all(axis=1) & (rows < first + len(vertices)).all(axis=1)
                           for rows in (self.copies, self._collinear))
        if not np.array_equal(together(vertices, self.copies[copies] - first), self._together[copies]):
            return False
        if not collinear_faces(vertices, self._collinear[corners] - first, self._origin).all():
            return False
        used = self._groups[self._joint.group_of_pair]
        pairs = self._joint.vertices[used]
        moved = (pairs >= first) & (pairs < first + len(vertices))
        if not moved.any():
            return True
        # Where the other mesh is now, only the positions of all tell
        return bool(moved.all()) and np.array_equal(together(vertices, pairs - first), self._met[used])

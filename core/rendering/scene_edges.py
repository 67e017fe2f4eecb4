"""The edges of a scene as they were found, and whether they still are what they were after vertices have moved."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..geometry.collinear import collinear_faces
from ..geometry.joint_edges import joined
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

    Attributes
    ----------
    vertices
        (n, 3) positions by which edges of several meshes are joined.
    """

    def __init__(self, tables: Tables, copies: NDArray[np.int64] | None = None) -> None:
        self._all = tables.edges()
        self._origin = tables.origin
        self.copies = self._all.copies.astype(np.int64) if copies is None else copies
        self._together = together(tables.vertices, self.copies)
        self._collinear = np.concatenate([tables.faces[self._all.collinear], self._all.junctions]).astype(np.int64)
        own_face = self._all.faces[self._all.face_first[:-1]]
        self._mesh = np.searchsorted(tables.mesh_first_face, own_face, side="right") - 1
        # Faces of meshes that other rays meet, or other lights light, are not one surface
        meshes = len(tables.mesh_names)
        rays, lights = tables.mesh_mask[:meshes], tables.mesh_receivers[:meshes]
        self._kind = np.unique(np.stack([rays, lights], axis=1), axis=0, return_inverse=True)[1].reshape(-1)
        self._kind[tables.instance_mesh] = -1  # their vertices are in a space of their own
        self.vertices, self._mesh_first_vertex = tables.vertices, tables.mesh_first_vertex
        self.current = self._all
        self._moving, self._may_be_joined = np.zeros(0, np.bool_), True
        self._pairs, self._on_lines = np.zeros((0, 2), np.int64), np.zeros((0, 3), np.int64)
        self._touching = np.zeros((0, 2), np.uint32)  # of meshes, if all moved alike
        self._met = np.zeros(0, np.bool_)
        self._touching = self.for_moving(()).touching
        self._may_be_joined = self.current is not self._all

    def are_for(self, moving: Collection[int]) -> bool:
        """Return whether the current edges are those for a derivative by which some meshes move."""
        return not self._may_be_joined or np.array_equal(self._moves(moving), self._moving)

    def _moves(self, moving: Collection[int]) -> NDArray[np.bool_]:
        moves = np.zeros(len(self._kind), np.bool_)
        moves[list(moving)] = True
        return moves

    def for_moving(self, moving: Collection[int]) -> Edges:
        """Return the edges for a derivative by which some meshes move, with those joined that move alike."""
        if not self.are_for(moving):
            self._moving = moves = self._moves(moving)
            kind = np.where(self._kind < 0, -1, 2 * self._kind + moves)
            self.current, self._pairs, self._on_lines = joined(
                self._all, self.vertices, self._mesh_first_vertex, self._mesh, kind)  # fmt: skip
            if len(self._touching):
                self.current = replace(self.current, touching=self._touching)
            self._met = together(self.vertices, self._pairs)
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
        within = [(rows >= first) & (rows < first + len(vertices)) for rows in (self._pairs, self._on_lines)]
        if not any(moved.any() for moved in within):
            return True
        # Where the other meshes are now, only the positions of all tell
        return (all(moved.all() for moved in within)
                and np.array_equal(together(vertices, self._pairs - first), self._met)
                and bool(collinear_faces(vertices, self._on_lines - first, self._origin).all()))

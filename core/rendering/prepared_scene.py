"""A scene in an engine, which follows the scene's changes.

The engine has its own copy of the scene: tables, a BVH, edges. A change of values is passed on as narrowly as possible,
so that a step of an optimiser costs little beside its pictures.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import names
from ..derivatives.decisions import Decisions
from ..derivatives.table_derivatives import ParameterMap, shows_environment, with_requested
from ..geometry.topology import Edges
from ..reference.simplify import obstacles
from ..scene import parameters
from ..scene.camera import Camera
from ..scene.light import AreaLight
from ..scene.placement import is_moved
from ..scene.scene import Scene
from ..tables import tables as flat
from .engine import EngineLike
from .options import RenderOptions
from .scene_edges import SceneEdges
from .taken_over import TakenOver


@dataclass(frozen=True)
class Derivative:
    """The derivative by some parameters of a scene after a number of changes.

    Attributes
    ----------
    wrt, scene, changes
        The parameters; the scene, and the number of its changes.
    tables, map
        The tables that the derivative needs, and their derivative by the parameters.
    decisions
        What the engine has decided on it, by the options of the call.
    """

    wrt: tuple[str, ...]
    scene: Scene
    changes: int
    tables: flat.Tables
    map: ParameterMap
    decisions: dict[RenderOptions, Decisions]


# Parameters that neither change textures nor are changed by them.
_UNTEXTURED = ("camera.", "world.", "lights.")


class PreparedScene:
    """A scene with its tables and its engine, for which `update` passes on changes.

    Parameters
    ----------
    scene, threads, wrt, watched
        As for `Renderer`, checked.
    kind
        The engine's class.
    """

    def __init__(self, scene: Scene, threads: int, kind: type[EngineLike], wrt: Sequence[str], watched: bool) -> None:
        self.scene = scene
        self._wrt = tuple(wrt)
        self._tables = with_requested(scene, flat.flatten(scene), self._wrt)
        self._edges: SceneEdges | None = None
        self._engine_edges: Edges | None = None  # those that the engine has
        self._copies: NDArray[np.int64] | None = None  # pairs of vertices that were welded at first
        self._obstacles: list[str] | None = None
        self._derivative: Derivative | None = None  # of the last call, until a change
        self._moving: tuple[tuple[str, ...], list[int]] = (), []  # parameters, and the meshes that move by them
        self._changes = 0  # number of changes of the engine
        self._moved = False  # the engine has vertex positions that the tables lack
        self._unfinished = False  # an update has failed half-way, so the engine's state is inconsistent
        self._engine_class, self._threads = kind, threads
        self._engine = kind(self._tables, threads)
        self._taken_over = TakenOver(scene) if watched else None

    @property
    def narrow(self) -> bool:
        """Whether its engine has derivatives of flat, diffuse, directly lit scenes alone."""
        return self._engine.narrow

    @property
    def tables(self) -> flat.Tables:
        """The tables of the scene."""
        return self._tables

    @property
    def obstacles(self) -> list[str]:
        """What of the scene has no derivatives in a narrow engine, in words; found at the first use."""
        if self._obstacles is None:
            self._obstacles = list(obstacles(self.scene)) if self._engine.narrow else []
        return self._obstacles

    def find_edges(self, wrt: Collection[str] | None = None) -> None:
        """Find the edges at the first use, and give the engine those for derivatives with respect to `wrt`.

        None: any of them will do, as for pictures. Then the engine keeps those that it has, and what it knows of them.
        """
        if self._edges is None:
            self._edges = SceneEdges(self._tables, self._copies)
            self._copies = self._edges.copies
            self._engine_edges = None
        elif wrt is None and self._engine_edges is not None:
            return
        moving = self._moving_by(tuple(wrt or ()))
        if self._moved and not self._edges.are_for(moving):
            self.update()  # the tables lack positions
            self.find_edges(wrt)
            return
        edges = self._edges.for_moving(moving)
        if edges is not self._engine_edges:
            self._engine.set_edges(edges)
            self._engine_edges = edges

    def _moving_by(self, wrt: tuple[str, ...]) -> list[int]:
        """Return the numbers of the meshes whose vertices or placements are parameters."""
        if self._moving[0] != wrt:
            numbers = self._tables.mesh_number
            self._moving = wrt, sorted(numbers[name] for name in _moving(wrt) if name in numbers)
        return self._moving[1]

    def _derivative_by(self, wrt: tuple[str, ...]) -> Derivative:
        """Return the derivative with respect to `wrt`, which is kept until a change: there may be many parameters."""
        known, changes = self._derivative, self._changes
        if known is None or known.scene is not self.scene or known.changes != changes or known.wrt != wrt:
            self._derivative = None  # it may be large
            tables = with_requested(self.scene, self._tables, (*self._wrt, *wrt))
            known = Derivative(wrt, self.scene, changes, tables, ParameterMap(self.scene, tables, wrt), {})
            self._derivative = known
        return known

    def adopt(self, scene: Scene) -> bool:
        """Switch to another scene if its geometry has the same bits; otherwise change nothing and return False."""
        tables = with_requested(scene, flat.flatten(scene), self._wrt)
        if self._moved or self._unfinished or not tables.same_geometry(self._tables):
            return False
        with self._change():
            self.scene, self._tables = scene, tables
            self.watched = self.watched  # record the values of the other scene
            self._obstacles = None
            self._engine.update(tables)
        return True

    def update(self, paths: Collection[str] | None = None) -> None:
        """Update the renderer after changes of the scene's values.

        Parameters
        ----------
        paths
            Paths of the changed parameters. Only these are read, and only meshes with changed vertices get a refitted
            BVH. None: find all changes by a comparison.

        Raises
        ------
        ValueError
            For wrong values, which it names, or if the topology has changed.
        """
        if paths is not None:
            paths = names("update", "paths", paths, "parameter paths")
            if not self._unfinished and self._update_named(paths):
                if self._taken_over is not None:
                    self._taken_over.note(self.scene, paths)
                return
        textures = None if paths is None or any(map(_changes_textures, paths)) else self._tables.textures
        tables = flat.flatten(self.scene, self._tables.origin, textures)
        tables = with_requested(self.scene, tables, self._wrt)
        same = np.array_equal(tables.faces, self._tables.faces) and tables.mesh_names == self._tables.mesh_names
        same = same and tables.same_fields(self._tables)
        if not same or len(tables.vertices) != len(self._tables.vertices):
            raise ValueError("scene: its topology has changed; make a new Renderer")
        # Engines can update vertices and values. Any other change of a mesh needs a new engine.
        built_anew = not tables.same_but_vertices(self._tables)
        with self._change():
            self._obstacles = None
            if built_anew:
                engine = self._engine_class(tables, self._threads)
                if self._engine_edges is not None:
                    engine.set_edges(self._engine_edges)
                self._engine = engine
            else:
                self._engine.update(tables)
            self._tables = tables
            if self._edges is not None and self._edges.hold(tables.vertices):
                self._edges.vertices = tables.vertices
            else:
                self._edges = None
            self._moved = self._unfinished = False
        self.watched = self.watched  # record the changed values

    @contextmanager
    def _change(self) -> Iterator[None]:
        """Guard a change of the engine: if it fails (out of memory, Ctrl-C), the next call repeats it."""
        try:
            yield
        except BaseException:
            self._unfinished = True
            raise
        finally:
            self._changes += 1  # other threads may be at work on a derivative
            self._derivative = None

    @property
    def watched(self) -> bool:
        """Whether each call checks for changes of the scene since the last update.

        The check compares fields, and some entries of each array. False saves its time, for a scene that no other code
        changes.
        """
        return self._taken_over is not None

    @watched.setter
    def watched(self, watched: bool) -> None:
        self._taken_over = TakenOver(self.scene) if watched else None

    def _settle(self, camera: Camera | None) -> None:
        """Repeat an unfinished change, and refuse a scene that has changed since the last update."""
        if self._unfinished:
            self.update()
        if self._taken_over is not None:
            self._taken_over.check(self.scene, camera=camera is None)

    def _update_named(self, paths: Collection[str]) -> bool:
        """Update the named parameters alone; return False, without a change, if the whole scene must be read again."""
        moved = [name for path in paths if (name := _vertices_of(path)) is not None]
        values = [path for path in paths if _vertices_of(path) is None]
        for path in paths:
            parameters.get(self.scene, path)
        if any(mesh.instances is not None or is_moved(mesh) for mesh in (self.scene.meshes[name] for name in moved)):
            return False
        if self._tables.textures is not None and not all(path.startswith(_UNTEXTURED) for path in paths):
            return False
        if any(self._changes_geometry(path) for path in values):
            return False
        image = flat.shows_image(self.scene) or shows_environment(self.scene, self._wrt)
        if image == (self._tables.environment_pixels is None):
            return False
        for name in moved:
            mesh, k = self.scene.meshes[name], self._tables.mesh_names.index(name)
            count = int(self._tables.mesh_first_vertex[k + 1] - self._tables.mesh_first_vertex[k])
            mesh.check_vertices(name, count)
            first = int(self._tables.mesh_first_vertex[k])
            if self._edges is not None and not self._edges.hold(mesh.vertices, first):
                return False
        tables = self._tables
        if values:
            tables = with_requested(self.scene, flat.with_values(self.scene, tables, values), self._wrt)
        with self._change():
            for name in moved:
                self._moved = True
                k, vertices = self._tables.mesh_names.index(name), self.scene.meshes[name].vertices
                self._engine.move_vertices(k, vertices, self._tables)
            if values:
                self._tables = tables
                self._obstacles = None
                self._engine.update_values(tables)
        return True

    def _changes_geometry(self, path: str) -> bool:
        """Whether a parameter other than vertices may change the geometry or the images in the engine."""
        if path.startswith(("meshes.", "images.", "fields.")) or isinstance(_held(self.scene, path), AreaLight):
            return True
        # The instances of an emissive mesh are separate meshes in world space, so emission changes the geometry.
        instanced = any(mesh.instances is not None for mesh in self.scene.meshes.values())
        return instanced and path.startswith("materials.") and path.endswith(".emission")


def _vertices_of(path: str) -> str | None:
    """Return the name of the mesh if the path means its vertices, else None."""
    collection, name, field = parameters.split(path)
    return name if collection == "meshes" and field == "vertices" else None


def _moving(wrt: Collection[str]) -> set[str]:
    """The names of the meshes whose vertices or placements are parameters."""
    parts = [parameters.split(path) for path in wrt]
    return {name for collection, name, field in parts
            if collection == "meshes" and field in ("vertices", "transform", "instances")}


def _changes_textures(path: str) -> bool:
    """Whether a parameter may be a part of the images or attributes that textures read."""
    collection, _, field = parameters.split(path)
    if collection == "fields":
        return parameters.layer_of(field) is not None
    return collection == "images" or (collection == "meshes" and field != "vertices")


def _held(scene: Scene, path: str) -> Any:
    return parameters.owner(scene, path)[0]

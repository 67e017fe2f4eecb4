"""The renderer: a scene with its acceleration structures, for many pictures, derivatives and updates.

A `Renderer` flattens the scene to tables, which the engine reads. A forward derivative maps a tangent of the parameters
to a tangent of the tables, which the engine pushes to a derivative picture. A backward derivative runs the transposed
maps: the engine pulls an adjoint picture back to a gradient by the tables, then `derivatives` pulls that back to the
parameters.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array, flag, instance, mapping, names, whole
from ..derivatives.decisions import Decisions, joined
from ..derivatives.table_derivatives import (
    Requested,
    pull_back_of,
    push_forward,
    requested_tables,
    shows_environment,
    with_requested,
)
from ..geometry.topology import Edges
from ..reference import diffuse_tables
from ..reference.simplify import obstacles
from ..scene import parameters
from ..scene.bounces import MAX_DEPTH, Bounces
from ..scene.camera import Camera
from ..scene.fixed_scene import FixedScene
from ..scene.light import AreaLight
from ..scene.placement import is_moved
from ..scene.scene import Scene
from ..tables import tables as flat
from ..tables.materials import LAMBERTIAN
from ..tables.picture_facts import PictureFacts
from .engine import engine_class
from .learning import Gradient, Learning
from .non_finite import warn_of_gradients, warn_of_picture
from .options import (
    MOST_THREADS,
    TERMS,
    Progress,
    RenderOptions,
    checked_options,
    checked_progress,
    checked_terms,
)
from .taken_over import TakenOver

# Largest path length with derivatives in the reference engine: emission seen directly, and direct illumination.
MAX_DERIVATIVE_DEPTH = 2
# If a scene consists of one mesh with at most this many faces, its edges are found before a render. They show whether
# the mesh is convex, in which case the engine skips its shadow rays. For larger meshes, the search for edges costs
# more.
CONVEXITY_FACES = 20_000

# Derivatives combine the seed with this constant, so that their random numbers differ from those of a picture with the
# same seed. Otherwise, an adjoint computed from that picture would be correlated with the derivative, which biases
# gradients.
DERIVATIVE_STREAM = 0xBB67AE85

# Parameters that neither change textures nor are changed by them.
_UNTEXTURED = ("camera.", "world.", "lights.")


class Cancelled(RuntimeError):
    """Raised by a progress callback to stop a render or a fit."""


class Renderer:
    """A scene with its BVH and edges, to be rendered and differentiated many times.

    Parameters
    ----------
    scene
        The scene. After a change of its values (not its topology), call `update`. Calls on a scene that has changed
        since the last update raise an error, as far as a spot check detects the change (see `watched`).
    threads
        Number of threads; 0: one per core. Results have the same bits for any number of threads.
    engine
        "auto", "native" or "reference" (see `engine_class`).
    learn
        Whether gradients adapt the sampling of the next gradients of the same view (see `learning`). Useful for fits,
        whose gradients are similar. The result of `render_backward` then depends on the calls before it: equal seeds
        give equal bits for equal sequences of calls. A change of the number of vertices, lights or pixels resets the
        sampling. `render_forward` uses the sampling of gradients by the same parameters, but does not adapt it. The
        reference engine ignores `learn`.
    wrt
        Parameters of later derivatives, as in a fit. Pictures then use the same tables as these derivatives, so that
        no call changes the engine's scene. Such a picture may differ by rounding errors from one without `wrt`.
    watched
        See the attribute of this name.

    Raises
    ------
    ValueError
        For a wrong scene; names the object and the field.
    """

    def __init__(self, scene: Scene, *, threads: int = 0, engine: str = "auto", learn: bool = False,
                 wrt: Sequence[str] = (), watched: bool = True) -> None:
        threads = whole("renderer", "threads", threads, 0, MOST_THREADS)
        learn = flag("renderer", "learn", learn)
        self.scene = scene
        self._wrt = names("renderer", "wrt", wrt, "parameter paths")
        self._tables = with_requested(scene, flat.flatten(scene), self._wrt)
        self._edges: Edges | None = None
        self._obstacles: list[str] | None = None
        self._fixed: FixedScene | None = None
        self._moved = False  # the engine has vertex positions that the tables lack
        self._unfinished = False  # an update has failed half-way, so the engine's state is inconsistent
        self._engine_class, self._threads = engine_class(engine), threads
        self._engine = self._engine_class(self._tables, threads)
        self._taken_over = TakenOver(scene) if flag("renderer", "watched", watched) else None
        self._learning: Learning | None = None
        self.last_decisions: Decisions = ()
        if learn and not self._engine.narrow:
            from .native_engine import learned_sampling

            self._learning = Learning(learned_sampling)

    @property
    def narrow(self) -> bool:
        """Whether its engine has derivatives of flat, diffuse, directly lit scenes alone."""
        return self._engine.narrow

    @property
    def tables(self) -> flat.Tables:
        """The tables of the scene."""
        return self._tables

    @property
    def fixed_scene(self) -> FixedScene:
        """The scene since the last update, with answers to questions about all its meshes, each found once."""
        if self._fixed is None:
            self._fixed = FixedScene.of(self.scene)
        return self._fixed

    @property
    def edges(self) -> Edges:
        """The edges of the scene; found at the first use."""
        if self._edges is None:
            edges = self._tables.edges()
            self._engine.set_edges(edges)
            self._edges = edges
        return self._edges

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
        images = paths is None or any(path.startswith(("images.", "meshes.")) and _vertices_of(path) is None
                                      for path in paths)
        tables = flat.flatten(self.scene, self._tables.origin, None if images else self._tables.textures)
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
                if self._edges is not None:
                    engine.set_edges(self._edges)
                self._engine = engine
            else:
                self._engine.update(tables)
            self._tables = tables
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
            self._fixed = None

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

    def render(
        self,
        *,
        spp: int,
        max_depth: int = 2,
        seed: int = 0,
        bounces: Bounces | None = None,
        camera: Camera | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Render the picture; see `edgegrad.render`."""
        options = checked_options(spp, max_depth, seed, bounces)
        progress = checked_progress("render", progress)
        self._settle(camera)
        if self._may_be_convex():
            _ = self.edges
        picture = self._engine.render(self._seen(self._tables, camera), options, progress=progress)
        warn_of_picture(picture, "render")
        return picture

    def render_caustics(
        self,
        *,
        spp: int,
        max_depth: int,
        seed: int = 0,
        bounces: Bounces | None = None,
        camera: Camera | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Render only the caustics: light that reaches surfaces through mirrors or smooth glass.

        Derivatives lack the boundary terms of some of this light (see `plan`). With equal seeds, `render` and this
        method trace the same paths, so the difference of the two pictures is the picture without caustics. Parameters
        and errors are those of `edgegrad.render`.

        Returns
        -------
        (height, width, 3) float32, linear Rec.709 radiance.
        """
        options = replace(checked_options(spp, max_depth, seed, bounces), caustics_alone=True)
        progress = checked_progress("render_caustics", progress)
        self._settle(camera)
        tables = self._seen(self._tables, camera)
        picture = self._engine.render(tables, options, progress=progress)
        warn_of_picture(picture, "render_caustics")
        return picture

    def render_forward(
        self,
        tangent: Mapping[str, ArrayLike],
        *,
        spp: int,
        max_depth: int = 2,
        seed: int = 0,
        bounces: Bounces | None = None,
        terms: Sequence[str] = TERMS,
        camera: Camera | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Render the derivative of the picture along a tangent; see `edgegrad.render_forward`."""
        tangent = mapping("render_forward", "tangent", tangent)
        self._settle(camera)
        options = self._derivative_options(tuple(tangent), spp, max_depth, seed, bounces, terms)
        progress = checked_progress("render_forward", progress)
        tables, requested = self._requested(tuple(tangent), camera)
        velocity = push_forward(self.scene, tables, tangent)
        learned = {}
        if self._learning is not None:
            learned["learned"] = self._learning.view(tables, camera, tuple(tangent), options).sampling
        image = self._engine.forward(tables, velocity, requested, options, **learned, progress=progress)
        self.last_decisions = self._engine.decided
        if not np.isfinite(image).all():
            # Compute each term separately to find the terms that are not finite.
            alone = {
                t: self._engine.forward(tables, velocity, requested, replace(options, terms=(t,)), progress=progress)
                for t in options.terms
            }
            warn_of_picture(image, "render_forward", [t for t, part in alone.items() if not np.isfinite(part).all()])
        return image

    def render_backward(
        self,
        adjoint: ArrayLike,
        wrt: Sequence[str],
        *,
        spp: int,
        max_depth: int = 2,
        seed: int = 0,
        bounces: Bounces | None = None,
        terms: Sequence[str] = TERMS,
        camera: Camera | None = None,
        progress: Progress | None = None,
    ) -> dict[str, NDArray[np.float64]]:
        """Compute the gradient of sum(adjoint * picture); see `edgegrad.render_backward`."""
        wrt = names("render_backward", "wrt", wrt, "parameter paths")
        self._settle(camera)
        progress = checked_progress("render_backward", progress)
        options = self._derivative_options(wrt, spp, max_depth, seed, bounces, terms)
        tables, requested = self._requested(wrt, camera)
        # The copy keeps the gradient valid if the progress function changes its arrays.
        image = array("render_backward", "adjoint", adjoint, (tables.height, tables.width, 3), np.float32).copy()
        pull = pull_back_of(self.scene, tables, wrt)
        calls: list[Decisions] = []

        def gradients(options: RenderOptions, progress: Progress | None = progress, **learned: Any) -> Gradient:
            gradient = self._engine.backward(tables, image, requested, options, **learned, progress=progress)
            calls.append(self._engine.decided)
            return pull(gradient)

        if self._learning is None:
            found = gradients(options)
        else:
            known = self._learning.view(tables, camera, wrt, options)

            def part(terms: Collection[str], seed: int, k: int, of: int) -> Gradient:
                report = None if progress is None else lambda fraction: progress((k + fraction) / of)
                return gradients(replace(options, terms=tuple(terms), seed=seed), report, learned=known.sampling)

            found = known.gradient(part, options.terms, options.seed)
        self.last_decisions = joined(calls)
        if not all(np.isfinite(gradient).all() for gradient in found.values()):
            alone = {t: gradients(replace(options, terms=(t,))) for t in options.terms}
            warn_of_gradients(found, lambda path: [t for t in alone if not np.isfinite(alone[t][path]).all()])
        return found

    def picture_facts(self) -> PictureFacts:
        """Return the facts by which the engine skips work in pictures."""
        self._settle(None)
        return self._engine.picture_facts(self._tables)

    def decide(
        self, wrt: Sequence[str], *, max_depth: int = 2, bounces: Bounces | None = None, terms: Sequence[str] = TERMS
    ) -> Decisions:
        """Return what the derivative with respect to some parameters consists of, without computing it.

        The engine keeps what it looks for to know that, and the next derivative uses it. `last_decisions` has the
        same of the last derivative that was computed, with its samples and seconds. Parameters are those of
        `render_backward`.
        """
        wrt = names("decide", "wrt", wrt, "parameter paths")
        self._settle(None)
        tables, requested = self._requested(wrt, None)
        _ = self.edges
        options = replace(checked_options(1, max_depth, 0, bounces), terms=checked_terms(terms))
        parameters = [requested_tables(self.scene, tables, [path]) for path in wrt]
        return self._engine.decide(tables, requested, options, parameters)

    def _requested(self, wrt: Collection[str], camera: Camera | None) -> tuple[flat.Tables, Requested]:
        """Return the tables for derivatives with respect to `wrt`, seen by a camera, and the rows that `wrt` needs."""
        tables = with_requested(self.scene, self._tables, (*self._wrt, *wrt))
        requested = requested_tables(self.scene, tables, wrt)
        if self._engine.narrow:
            diffuse_tables.check(wrt)
        if "camera" in requested and not self._own(camera):
            raise ValueError("camera: derivatives with respect to the camera need a picture of the scene's own "
                             "camera; leave out the argument camera")
        return self._seen(tables, camera), requested

    def _derivative_options(
        self,
        wrt: Collection[str],
        spp: Any,
        max_depth: Any,
        seed: Any,
        bounces: Bounces | None,
        terms: Sequence[str],
    ) -> RenderOptions:
        narrow = self._engine.narrow
        if self._obstacles is None:
            self._obstacles = list(obstacles(self.scene)) if narrow else []
        computed = checked_terms(terms)
        if self._obstacles:
            raise ValueError("this scene has no exact derivatives in this version; edgegrad.differentiable(scene) "
                             f"returns a similar scene that has, where {'; '.join(self._obstacles)}")
        _ = self.edges
        deepest = MAX_DERIVATIVE_DEPTH if narrow else MAX_DEPTH
        options = checked_options(spp, max_depth, seed, bounces, deepest)
        return replace(options, seed=options.seed ^ DERIVATIVE_STREAM, terms=computed)

    def _may_be_convex(self) -> bool:
        faces = int(self._tables.mesh_first_face[-1])
        return (
            len(self._tables.mesh_names) == 1
            and faces <= CONVEXITY_FACES
            and not len(self._tables.corner_normal)
            and bool((self._tables.materials.flags & LAMBERTIAN).all())
        )

    def _own(self, camera: Camera | None) -> bool:
        return camera is None or camera is self.scene.camera

    def _seen(self, tables: flat.Tables, camera: Camera | None) -> flat.Tables:
        if camera is None:
            return tables
        instance("render", "camera", camera, Camera).validate()
        return replace(tables, **flat.camera_fields(camera, tables.origin))


def _vertices_of(path: str) -> str | None:
    """Return the name of the mesh if the path means its vertices, else None."""
    collection, name, field = parameters.split(path)
    return name if collection == "meshes" and field == "vertices" else None


def _held(scene: Scene, path: str) -> Any:
    return parameters.owner(scene, path)[0]

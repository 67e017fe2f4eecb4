"""The renderer: a scene prepared for many pictures, derivatives and updates."""

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
from ..scene.light import AreaLight
from ..scene.placement import is_moved
from ..scene.scene import Scene
from ..tables import tables as flat
from ..tables.materials import LAMBERTIAN
from .engine import Progress, engine_class
from .learning import Gradient, Learning
from .non_finite import warn_of_gradients, warn_of_picture
from .options import MOST_THREADS, TERMS, checked_options, checked_progress, checked_terms
from .taken_over import TakenOver

# Path segments of which this version has derivatives: light seen directly, and direct illumination.
MAX_DERIVATIVE_DEPTH = 2
# Up to so many faces a lone mesh's edges are worth knowing for its picture alone: if it turns out to be a
# convex body, its light needs no shadow rays.
CONVEXITY_FACES = 20_000

# Derivatives have random numbers of their own. An adjoint picture that comes from a picture of the same seed
# would otherwise be correlated with the derivative, and the gradient of a loss of a noisy picture be biased.
DERIVATIVE_STREAM = 0xBB67AE85

# Parameters that neither change textures nor are changed by them.
_UNTEXTURED = ("camera.", "world.", "lights.")


class Cancelled(RuntimeError):
    """Raised by a progress callback to stop a render or a fit."""


class Renderer:
    """A scene with its BVH and edges, ready to be rendered and differentiated many times.

    Parameters
    ----------
    scene
        What to render. Change its values (not its topology) and call `update`: renders of a scene that has changed
        since the last update are refused, as far as that shows without looking at all numbers (see `watched`).
    threads
        Threads to use; 0: one per core. Results are the same bits for any number.
    engine
        "auto", "native" or "reference" (see `engine_class`).
    learn
        Whether each gradient learns for the next ones of its view where samples are worth their while, and of which
        term; for fits, whose gradients are much alike. Then `render_backward` depends on the calls before it: equal
        seeds give equal bits for equal sequences of calls; a change of the numbers of vertices, lights or pixels
        begins anew. `render_forward` uses what gradients of the same parameters have learned, and learns nothing.
        The reference engine doesn't learn.
    wrt
        Parameters whose derivatives will be asked for, as in a fit. Pictures are then rendered from the same tables as
        these derivatives, so that neither call changes the engine's scene. A picture may differ in rounding from that
        of a renderer without `wrt`.

    Raises
    ------
    ValueError
        For a wrong scene, naming the object and the field.
    """

    def __init__(self, scene: Scene, *, threads: int = 0, engine: str = "auto", learn: bool = False,
                 wrt: Sequence[str] = ()) -> None:
        threads = whole("renderer", "threads", threads, 0, MOST_THREADS)
        learn = flag("renderer", "learn", learn)
        self.scene = scene
        self._wrt = names("renderer", "wrt", wrt, "parameter paths")
        self._tables = with_requested(scene, flat.flatten(scene), self._wrt)
        self._edges: Edges | None = None
        self._obstacles: list[str] | None = None
        self._moved = False  # vertices have moved in the engine that the tables don't know of
        self._unfinished = False  # an update has failed half-way: the engine's state is that of no scene
        self._engine_class, self._threads = engine_class(engine), threads
        self._engine = self._engine_class(self._tables, threads)
        self._taken_over: TakenOver | None = TakenOver(scene)
        self._learning: Learning | None = None
        self.last_decisions: Decisions = ()
        if learn and not self._engine.narrow:
            from .native_engine import learned_sampling

            self._learning = Learning(learned_sampling)

    @property
    def tables(self) -> flat.Tables:
        """The scene's tables."""
        return self._tables

    @property
    def edges(self) -> Edges:
        """The scene's edges; found when first needed."""
        if self._edges is None:
            edges = self._tables.edges()
            self._engine.set_edges(edges)
            self._edges = edges
        return self._edges

    def adopt(self, scene: Scene) -> bool:
        """Go on with another scene if its geometry is the same to the bit; False (and no change) if it isn't."""
        tables = with_requested(scene, flat.flatten(scene), self._wrt)
        if self._moved or self._unfinished or not tables.same_geometry(self._tables):
            return False
        with self._change():
            self.scene, self._tables = scene, tables
            self.watched = self.watched  # from now on another scene
            self._obstacles = None
            self._engine.update(tables)
        return True

    def update(self, paths: Collection[str] | None = None) -> None:
        """Take over changed values of the scene.

        Parameters
        ----------
        paths
            Parameter paths of what has changed; only that is looked at, and only meshes whose vertices
            have moved get their BVH refitted. None: whatever has changed, which is found by comparing.

        Raises
        ------
        ValueError
            For wrong values, or if the topology has changed.
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
        if not same or len(tables.vertices) != len(self._tables.vertices):
            raise ValueError("scene: its topology has changed; make a new Renderer")
        # Engines take over vertices and values; what else there is of meshes is built in.
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
        self.watched = self.watched  # from now on the changed scene

    @contextmanager
    def _change(self) -> Iterator[None]:
        """A change of the engine, which is unfinished if it fails (memory runs out, Ctrl-C)."""
        try:
            yield
        except BaseException:
            self._unfinished = True
            raise

    @property
    def watched(self) -> bool:
        """Whether each call looks for changes of the scene that no update has taken over: fields with other values, and
        arrays that were changed in place by some of their numbers. False saves the time, where nobody else has the
        scene.
        """
        return self._taken_over is not None

    @watched.setter
    def watched(self, watched: bool) -> None:
        self._taken_over = TakenOver(self.scene) if watched else None

    def _settle(self, camera: Camera | None) -> None:
        """Do an unfinished change anew, and refuse a scene of which an update is missing."""
        if self._unfinished:
            self.update()
        if self._taken_over is not None:
            self._taken_over.check(self.scene, camera=camera is None)

    def _update_named(self, paths: Collection[str]) -> bool:
        """Take over the named changes by themselves; False if that can't be done."""
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
        """Whether a value other than vertices may have changed where meshes are, or images."""
        if path.startswith(("meshes.", "images.")) or isinstance(_held(self.scene, path), AreaLight):
            return True
        # An instanced mesh stands in the world if it gives light.
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
        """The picture; see `edgegrad.render`."""
        options = checked_options(spp, max_depth, seed, bounces)
        progress = checked_progress("render", progress)
        self._settle(camera)
        if self._may_be_convex():
            _ = self.edges
        picture = self._engine.render(self._seen(self._tables, camera), **options, progress=progress)
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
        """The part of the picture that is caustics: light that surfaces receive by way of mirrors or smooth glass.

        Derivatives lack the jumps of this part (see `plan`). Equal seeds give the paths of `render`, so that the
        difference of the two is the rest of the picture. Parameters and errors are those of `edgegrad.render`.

        Returns
        -------
        (height, width, 3) float32, linear Rec.709 radiance.
        """
        options = checked_options(spp, max_depth, seed, bounces)
        progress = checked_progress("render_caustics", progress)
        self._settle(camera)
        tables = self._seen(self._tables, camera)
        picture = self._engine.render(tables, **options, caustics_alone=True, progress=progress)
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
        """The derivative of the picture along a tangent; see `edgegrad.render_forward`."""
        tangent = mapping("render_forward", "tangent", tangent)
        self._settle(camera)
        options = self._derivative_options(tuple(tangent), spp, max_depth, seed, bounces, terms)
        progress = checked_progress("render_forward", progress)
        tables, wanted = self._asked(tuple(tangent), camera)
        velocity = push_forward(self.scene, tables, tangent)
        learned = {}
        if self._learning is not None:
            learned["learned"] = self._learning.view(tables, camera, tuple(tangent), options).sampling
        image = self._engine.forward(tables, velocity, wanted, **options, **learned, progress=progress)
        self.last_decisions = self._engine.decided
        if not np.isfinite(image).all():
            # Which term it is shows if each is computed by itself.
            alone = {t: self._engine.forward(tables, velocity, wanted, **{**options, "terms": (t,)}, progress=progress)
                     for t in options["terms"]}
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
        """Gradients of sum(adjoint * picture); see `edgegrad.render_backward`."""
        wrt = names("render_backward", "wrt", wrt, "parameter paths")
        self._settle(camera)
        progress = checked_progress("render_backward", progress)
        options = self._derivative_options(wrt, spp, max_depth, seed, bounces, terms)
        tables, wanted = self._asked(wrt, camera)
        # Progress functions may change their arrays and the scene: the gradient is that of the call's beginning.
        image = array("render_backward", "adjoint", adjoint, (tables.height, tables.width, 3), np.float32).copy()
        pull = pull_back_of(self.scene, tables, wrt)
        calls: list[Decisions] = []

        def gradients(options: Mapping[str, Any], progress: Progress | None = progress) -> Gradient:
            gradient = self._engine.backward(tables, image, wanted, **options, progress=progress)
            calls.append(self._engine.decided)
            return pull(gradient)

        if self._learning is None:
            found = gradients(options)
        else:
            known = self._learning.view(tables, camera, wrt, options)

            def part(terms: Collection[str], seed: int, k: int, of: int) -> Gradient:
                report = None if progress is None else lambda fraction: progress((k + fraction) / of)
                return gradients({**options, "terms": terms, "seed": seed, "learned": known.sampling}, report)

            found = known.gradient(part, options["terms"], options["seed"])
        self.last_decisions = joined(calls)
        if not all(np.isfinite(gradient).all() for gradient in found.values()):
            alone = {t: gradients({**options, "terms": (t,)}) for t in options["terms"]}
            warn_of_gradients(found, lambda path: [t for t in alone if not np.isfinite(alone[t][path]).all()])
        return found

    def decide(
        self, wrt: Sequence[str], *, max_depth: int = 2, bounces: Bounces | None = None, terms: Sequence[str] = TERMS
    ) -> Decisions:
        """What the derivative with respect to some parameters consists of, without computing it.

        What the engine looks for to know that is kept for the next derivative. `last_decisions` has the same of the
        last derivative that was computed, with its samples and seconds. Parameters are those of `render_backward`.
        """
        wrt = names("decide", "wrt", wrt, "parameter paths")
        self._settle(None)
        tables, wanted = self._asked(wrt, None)
        _ = self.edges
        options = checked_options(1, max_depth, 0, bounces)
        return self._engine.decide(tables, wanted, max_depth=options["max_depth"], bounces=options["bounces"],
                                   terms=checked_terms(terms))

    def _asked(self, wrt: Collection[str], camera: Camera | None) -> tuple[flat.Tables, Requested]:
        """The tables that a camera's derivatives with respect to some parameters are taken of, and which rows."""
        tables = with_requested(self.scene, self._tables, (*self._wrt, *wrt))
        wanted = requested_tables(self.scene, tables, wrt)
        if self._engine.narrow:
            diffuse_tables.check(wrt)
        if "camera" in wanted and not self._own(camera):
            raise ValueError("camera: its derivatives are those of the scene's own; the picture is another camera's")
        return self._seen(tables, camera), wanted

    def _derivative_options(
        self,
        wrt: Collection[str],
        spp: Any,
        max_depth: Any,
        seed: Any,
        bounces: Bounces | None,
        terms: Sequence[str],
    ) -> dict[str, Any]:
        narrow = self._engine.narrow
        if self._obstacles is None:
            self._obstacles = list(obstacles(self.scene)) if narrow else []
        computed = checked_terms(terms)
        if self._obstacles:
            raise ValueError("this scene has no exact derivatives in this version; edgegrad.differentiable(scene) "
                             f"gives the nearest that has, where {'; '.join(self._obstacles)}")
        _ = self.edges
        deepest = MAX_DERIVATIVE_DEPTH if narrow else MAX_DEPTH
        options = checked_options(spp, max_depth, seed, bounces, deepest)
        return {**options, "seed": options["seed"] ^ DERIVATIVE_STREAM, "terms": computed}

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
    """Name of the mesh whose vertices the path is, or None."""
    collection, name, field = parameters.split(path)
    return name if collection == "meshes" and field == "vertices" else None


def _held(scene: Scene, path: str) -> Any:
    return parameters.owner(scene, path)[0]

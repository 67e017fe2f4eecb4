"""The renderer: a scene with its acceleration structures, for many pictures, derivatives and updates.

A `Renderer` flattens the scene to tables, which the engine reads. A forward derivative maps a tangent of the parameters
to a tangent of the tables, which the engine pushes to a derivative picture. A backward derivative runs the transposed
maps: the engine pulls an adjoint picture back to a gradient by the tables, then `derivatives` pulls that back to the
parameters.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array, flag, instance, mapping, names, whole
from ..derivatives.decisions import Decisions, joined
from ..derivatives.table_derivatives import ParameterMap
from ..reference import diffuse_tables
from ..scene.bounces import MAX_DEPTH, Bounces
from ..scene.camera import Camera
from ..scene.scene import Scene
from ..tables import tables as flat
from ..tables.materials import LAMBERTIAN
from ..tables.picture_facts import PictureFacts
from .engine import engine_class
from .learning import Gradient, Learning
from .non_finite import warn_of_gradients, warn_of_picture
from .options import (
    FIELD_EDGES,
    MOST_THREADS,
    TERMS,
    Progress,
    RenderOptions,
    checked_field_edges,
    checked_options,
    checked_progress,
    checked_terms,
)
from .prepared_scene import Derivative, PreparedScene

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


class Cancelled(RuntimeError):
    """Raised by a progress callback to stop a render or a fit."""


class Renderer(PreparedScene):
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
        wrt = names("renderer", "wrt", wrt, "parameter paths")
        super().__init__(scene, threads, engine_class(engine), wrt, flag("renderer", "watched", watched))
        self._learning: Learning | None = None
        self.last_decisions: Decisions = ()
        if learn and not self._engine.narrow:
            from .native_engine import learned_sampling

            self._learning = Learning(learned_sampling)

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
            self.find_edges()
        picture = self._engine.render(self._seen(self._tables, camera), options, progress=progress)
        warn_of_picture(picture, "render")
        return picture

    def add_samples(self, sums: NDArray[np.float64], first: int, spp: int, options: RenderOptions,
                    camera: Camera | None, progress: Progress | None) -> NDArray[np.float32]:  # fmt: skip
        """Render `spp` samples from number `first` on, for `Progressive`; the other options are those of all samples.

        Returns
        -------
        The picture of all samples, whose sums the engine keeps in `sums` (height, width, 3).
        """
        progress = checked_progress("progressive", progress)
        self._settle(camera)
        if self._may_be_convex():
            self.find_edges()
        tables = self._seen(self._tables, camera)
        picture = self._engine.add_samples(tables, replace(options, spp=spp), first, sums, progress=progress)
        warn_of_picture(picture, "progressive")
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
        field_edges: str = FIELD_EDGES[0],
        camera: Camera | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Render the derivative of the picture along a tangent; see `edgegrad.render_forward`."""
        tangent = mapping("render_forward", "tangent", tangent)
        self._settle(camera)
        options = self._derivative_options(tuple(tangent), spp, max_depth, seed, bounces, terms, field_edges)
        progress = checked_progress("render_forward", progress)
        tables, derivative = self._requested(tuple(tangent), camera)
        requested, velocity = derivative.requested, derivative.push_forward(tangent)
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
        field_edges: str = FIELD_EDGES[0],
        camera: Camera | None = None,
        progress: Progress | None = None,
    ) -> dict[str, NDArray[np.float64]]:
        """Compute the gradient of sum(adjoint * picture); see `edgegrad.render_backward`."""
        wrt = names("render_backward", "wrt", wrt, "parameter paths")
        self._settle(camera)
        progress = checked_progress("render_backward", progress)
        options = self._derivative_options(wrt, spp, max_depth, seed, bounces, terms, field_edges)
        tables, derivative = self._requested(wrt, camera)
        requested = derivative.requested
        # The copy keeps the gradient valid if the progress function changes its arrays.
        image = array("render_backward", "adjoint", adjoint, (tables.height, tables.width, 3), np.float32).copy()
        calls: list[Decisions] = []

        def gradients(options: RenderOptions, progress: Progress | None = progress, **learned: Any) -> Gradient:
            gradient = self._engine.backward(tables, image, requested, options, **learned, progress=progress)
            calls.append(self._engine.decided)
            return derivative.pull_back(gradient)

        if self._learning is None:
            found = gradients(options)
        else:
            known = self._learning.view(tables, camera, wrt, options)

            def part(terms: Collection[str], seed: int, k: int, of: int) -> Gradient:
                report = None if progress is None else lambda fraction: progress((k + fraction) / of)
                return gradients(replace(options, terms=tuple(terms), seed=seed), report, learned=known.sampling)

            found = known.gradient(part, options.terms, options.seed)
        self.last_decisions = joined(calls)
        # A sum needs no copy of a large gradient, and is not finite if one of its terms is not.
        if not all(np.isfinite(gradient.sum()) for gradient in found.values()):
            alone = {t: gradients(replace(options, terms=(t,))) for t in options.terms}
            warn_of_gradients(found, lambda path: [t for t in alone if not np.isfinite(alone[t][path]).all()])
        return found

    def picture_facts(self, *, settled: bool = False) -> PictureFacts:
        """Return the facts by which the engine skips work in pictures.

        `settled`: another call has just found that the scene is unchanged.
        """
        if not settled:
            self._settle(None)
        return self._engine.picture_facts(self._tables)

    def decide(
        self, wrt: Sequence[str], *, max_depth: int = 2, bounces: Bounces | None = None, terms: Sequence[str] = TERMS,
        field_edges: str = FIELD_EDGES[0],
    ) -> Decisions:  # fmt: skip
        """Return what the derivative with respect to some parameters consists of, without computing it.

        The engine keeps what it looks for to know that, and the next derivative uses it. `last_decisions` has the
        same of the last derivative that was computed, with its samples and seconds. Parameters are those of
        `render_backward`.
        """
        wrt = names("decide", "wrt", wrt, "parameter paths")
        self._settle(None)
        known = self._derivative_of(wrt)
        options = replace(checked_options(1, max_depth, 0, bounces), terms=checked_terms(terms),
                          field_edges=checked_field_edges(field_edges))
        if options not in known.decisions:
            self.find_edges(wrt)
            known = self._derivative_of(wrt)  # another one, if the edges needed an update
            known.decisions[options] = self._engine.decide(
                known.tables, known.map.requested, options, known.map.rows)
        return known.decisions[options]

    @property
    def kernels(self) -> str:
        """Instruction set of the native engine, or "reference"; others round differently."""
        return str(getattr(self._engine, "instruction_set", "reference"))

    def learned(self) -> dict[str, Any]:
        """Return what gradients have learned (see `learn`), to be stored."""
        return {} if self._learning is None else self._learning.state()

    def restore_learned(self, state: Mapping[str, Any]) -> None:
        """Take over what `learned` has returned for an equal scene: gradients go on as there."""
        if self._learning is not None:
            self._learning.restore(state)

    def _derivative_of(self, wrt: Collection[str]) -> Derivative:
        known = self._derivative_by(tuple(wrt))
        if self._engine.narrow:
            diffuse_tables.check(wrt)
        return known

    def _requested(self, wrt: Collection[str], camera: Camera | None) -> tuple[flat.Tables, ParameterMap]:
        """Return the tables for derivatives with respect to `wrt`, seen by a camera, and their derivative by `wrt`."""
        known = self._derivative_of(wrt)
        tables, derivative = known.tables, known.map
        if "camera" in derivative.requested and not self._own(camera):
            raise ValueError("camera: derivatives with respect to the camera need a picture of the scene's own "
                             "camera; leave out the argument camera")
        return self._seen(tables, camera), derivative

    def _derivative_options(
        self,
        wrt: Collection[str],
        spp: Any,
        max_depth: Any,
        seed: Any,
        bounces: Bounces | None,
        terms: Sequence[str],
        field_edges: str,
    ) -> RenderOptions:
        narrow = self._engine.narrow
        computed, edges = checked_terms(terms), checked_field_edges(field_edges)
        if self.obstacles:
            raise ValueError("this scene has no exact derivatives in this version; edgegrad.differentiable(scene) "
                             f"returns a similar scene that has, where {'; '.join(self.obstacles)}")
        self.find_edges(wrt)
        deepest = MAX_DERIVATIVE_DEPTH if narrow else MAX_DEPTH
        options = checked_options(spp, max_depth, seed, bounces, deepest)
        return replace(options, seed=options.seed ^ DERIVATIVE_STREAM, terms=computed, field_edges=edges)

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

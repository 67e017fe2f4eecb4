"""The reference engine: the reference estimators behind the interface of the native engine."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..derivatives.decisions import Decision, Decisions, EdgeCounts, Effects
from ..derivatives.table_derivatives import ParameterRows, Requested, TableDerivative
from ..geometry.topology import Edges
from ..rendering.options import RenderOptions
from ..tables.lights import RADIANCE
from ..tables.picture_facts import PictureFacts
from ..tables.tables import Tables
from . import diffuse_tables as narrow
from .blocks import Forward, Reverse, Sink
from .edges import EdgeTable, seen_edges
from .film import Film
from .interior import interior
from .light import Lighting
from .primary import primary
from .radiance import Progress, render
from .rays import Rays
from .shadow import shadow
from .surfaces import Floats, Surfaces

# Those that it computes. The indirect term is zero, since paths have two segments at most.
TERMS = ("interior", "primary", "shadow")


class Engine:
    """Renders and differentiates a scene with numpy and embreex.

    Paths have at most two segments and no surface is transparent, so bounce limits (`RenderOptions.bounces`) have no
    effect.

    Parameters
    ----------
    tables
        Tables of the scene.
    threads
        Threads for ray queries; 0: one per core. Results do not depend on it.
    """

    narrow = True

    def __init__(self, tables: Tables, threads: int) -> None:
        self.decided: Decisions = ()
        self._threads = threads if threads > 0 else (os.cpu_count() or 1)
        self._topology: Edges | None = None
        if tables.fields:
            raise ValueError("the reference engine does not trace distance fields; leave scene.fields empty, or use "
                             "the native engine")
        self.update(tables)

    def update_values(self, tables: Tables) -> None:
        """Update materials, lights and environment."""
        self.update(tables)

    def move_vertices(self, mesh: int, vertices: Floats, tables: Tables) -> None:
        """Update the vertices of one mesh, given in world space."""
        first = tables.mesh_first_vertex[mesh]
        tables.vertices[first : first + len(vertices)] = vertices - tables.origin
        self.update(tables)

    def set_edges(self, edges: Edges) -> None:
        """Set the edges of the scene (`Tables.edges`), which derivatives need."""
        self._topology = edges
        self._edges = EdgeTable.of(edges, self._surfaces)

    def update(self, tables: Tables) -> None:
        """Update all values of a scene with the same topology."""
        self._surfaces = Surfaces.of(tables)
        self._lighting = Lighting(self._surfaces, Rays(tables, self._threads))
        if self._topology is not None:
            self._edges = EdgeTable.of(self._topology, self._surfaces)

    def render(
        self, tables: Tables, options: RenderOptions, *, progress: Progress | None = None
    ) -> NDArray[np.float32]:
        """Render the (height, width, 3) picture of the camera in `tables`, with the scene of the last `update`."""
        _check(options)
        if options.caustics_alone:  # diffuse surfaces cause no caustics
            return np.zeros((tables.height, tables.width, 3), np.float32)
        return render(Film.of(tables), self._lighting, **_numbers(options), progress=progress).astype(np.float32)

    def add_samples(
        self,
        tables: Tables,
        options: RenderOptions,
        first: int,
        sums: Floats,
        *,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Return the picture of the first samples and the new ones, all of which are rendered again."""
        return self.render(tables, replace(options, spp=first + options.spp), progress=progress)

    def forward(
        self,
        tables: Tables,
        tangent: TableDerivative,
        requested: Requested,
        options: RenderOptions,
        *,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Return the (height, width, 3) derivative image along `tangent`."""
        return self.forward_exact(tables, tangent, requested, options, progress=progress).astype(np.float32)

    def forward_exact(
        self,
        tables: Tables,
        tangent: TableDerivative,
        requested: Requested,
        options: RenderOptions,
        *,
        progress: Progress | None = None,
    ) -> NDArray[np.float64]:
        """Return the image of `forward` without rounding to float32."""
        options = self._restricted(tables, requested, options)
        asked = narrow.asked(tables, requested)
        sink = Forward(tables, self._surfaces, asked, narrow.narrowed(tables, tangent))
        self._run(tables, sink, options, progress)
        return sink.image.reshape(tables.height, tables.width, 3)

    def backward(
        self,
        tables: Tables,
        adjoint: NDArray[np.float32],
        requested: Requested,
        options: RenderOptions,
        *,
        progress: Progress | None = None,
    ) -> TableDerivative:
        """Return the gradient of sum(adjoint * image) with respect to the `requested` tables."""
        options = self._restricted(tables, requested, options)
        asked = narrow.asked(tables, requested)
        sink = Reverse(tables, self._surfaces, asked, np.asarray(adjoint, np.float64).reshape(-1, 3))
        self._run(tables, sink, options, progress)
        return narrow.widened(tables, sink.gradient, requested)

    def picture_facts(self, tables: Tables) -> PictureFacts:
        """Return the facts of a scene that this engine renders: flat-shaded, opaque Lambertian surfaces."""
        faces = int(tables.mesh_first_face[len(tables.mesh_names)])
        emissive = tables.emission[tables.face_material[:faces]].any(axis=1)
        lit = tables.lights.params[:, RADIANCE].any(axis=1)
        return PictureFacts(
            faces, 0, False, True, False, False, True, tuple(map(int, np.unique(tables.face_material[:faces]))),
            int(np.count_nonzero(emissive)), tuple(map(int, np.flatnonzero(lit))), bool(np.any(tables.environment)),
            False,
        )

    def decide(
        self, tables: Tables, requested: Requested, options: RenderOptions, parameters: ParameterRows | None = None
    ) -> Decisions:
        """Decide what a derivative with respect to the `requested` tables consists of."""
        moves = "vertices" in requested
        edges = EdgeCounts() if self._topology is None else EdgeCounts(*2 * (len(self._topology.vertices),))
        still = "needed" if moves else "still"
        reasons = {
            "interior": ("shading", "needed"),
            "primary": ("edges", still),
            "shadow": ("light shadows", still if options.max_depth > 1 else "not rendered"),
            "indirect": ("edges between surfaces", "not rendered"),
        }
        counts = [] if parameters is None else np.diff(parameters.last, prepend=0).tolist()
        effects = Effects((("needed", False), ("unread", True)), bytes(count == 0 for count in counts))
        return tuple(
            Decision(part, term, "computed" if reason == "needed" else "zero", reason, edges,
                     by_parameter=effects if term == "interior" else Effects())
            for term, (part, reason) in reasons.items() if term in options.terms
        )

    def _restricted(self, tables: Tables, requested: Requested, options: RenderOptions) -> RenderOptions:
        """The options with the terms that can be non-zero, after a check of all."""
        _check(options)
        self.decided = self.decide(tables, requested, options)
        return replace(options, terms=tuple(d.term for d in self.decided if d.computed))

    def _run(self, tables: Tables, sink: Sink, options: RenderOptions, progress: Progress | None) -> None:
        """Send the blocks of the terms to the sink."""
        film = Film.of(tables)
        position = tables.vertices.astype(np.float64)
        numbers = _numbers(options)
        fraction = 1.0 / max(len(options.terms), 1)
        for k, term in enumerate(options.terms):
            report = None if progress is None else _part(progress, k * fraction, fraction)
            if term == "interior":
                lighting = self._lighting.with_possible(sink.asked.emitting)
                interior(film, lighting, sink, **numbers, progress=report)
            elif term == "primary":
                # The camera is fixed, so only edges with a moving vertex move on the screen.
                moving = sink.moving_vertex[self._edges.vertices].any(axis=1)
                edges = seen_edges(self._edges, self._surfaces, position, film, moving)
                primary(film, self._lighting, edges, sink, **numbers, progress=report)
            else:
                shadow(film, self._lighting, self._edges, position, sink, **numbers, progress=report)


def _part(progress: Progress, start: float, fraction: float) -> Progress:
    """Map the progress of one term to the progress of the whole call."""
    return lambda done: progress(start + fraction * done)


def _numbers(options: RenderOptions) -> dict[str, int]:
    """The options that the estimators take."""
    return {"spp": options.spp, "seed": options.seed, "max_depth": options.max_depth}


def _check(options: RenderOptions) -> None:
    """Raise ``ValueError`` for options that the reference engine does not support."""
    if options.spp < 1:
        raise ValueError(f"spp must be at least 1, not {options.spp}")
    if options.max_depth not in (1, 2):
        raise ValueError(f"max_depth must be 1 or 2 in this version, not {options.max_depth}")
    for term in options.terms:
        if term not in (*TERMS, "indirect"):
            raise ValueError(f"unknown term '{term}'; terms are {', '.join(TERMS)}")

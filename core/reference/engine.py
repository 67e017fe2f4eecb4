"""The reference engine: the interface of the native engine over the reference estimators."""

from __future__ import annotations

import os
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from ..derivatives.decisions import Decision, Decisions, EdgeCounts
from ..derivatives.table_derivatives import Requested, TableDerivative
from ..geometry.topology import Edges
from ..scene.bounces import UNLIMITED, Bounces
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

TERMS = ("interior", "primary", "shadow")


class Engine:
    """Renders and differentiates the scene of some tables with numpy and embreex.

    Paths have two segments at most and no surface is transparent, so that limits of bounces (`bounces`) change nothing.

    Parameters
    ----------
    tables
        The scene.
    threads
        Threads for ray queries; 0: one per core. Results don't depend on it.
    """

    narrow = True

    def __init__(self, tables: Tables, threads: int) -> None:
        self.decided: Decisions = ()
        self._threads = threads if threads > 0 else (os.cpu_count() or 1)
        self._topology: Edges | None = None
        self.update(tables)

    def update_values(self, tables: Tables) -> None:
        """Take over other materials, lights and environment."""
        self.update(tables)

    def move_vertices(self, mesh: int, vertices: Floats, tables: Tables) -> None:
        """Take over other vertices of one mesh, in world space."""
        first = tables.mesh_first_vertex[mesh]
        tables.vertices[first : first + len(vertices)] = vertices - tables.origin
        self.update(tables)

    def set_edges(self, edges: Edges) -> None:
        """The scene's edges (`Tables.edges`), which derivatives need."""
        self._topology = edges
        self._edges = EdgeTable.of(edges, self._surfaces)

    def update(self, tables: Tables) -> None:
        """Take over other values of the same topology."""
        self._surfaces = Surfaces.of(tables)
        self._lighting = Lighting(self._surfaces, Rays(tables, self._threads))
        if self._topology is not None:
            self._edges = EdgeTable.of(self._topology, self._surfaces)

    def render(
        self,
        tables: Tables,
        *,
        spp: int,
        seed: int,
        max_depth: int,
        bounces: Bounces = UNLIMITED,
        caustics_alone: bool = False,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """(height, width, 3) picture seen by the camera of `tables`; scene values are those of the last `update`."""
        _check(spp, max_depth, ())
        if caustics_alone:  # diffuse surfaces throw none
            return np.zeros((tables.height, tables.width, 3), np.float32)
        image = render(Film.of(tables), self._lighting, spp=spp, seed=seed, max_depth=max_depth, progress=progress)
        return image.astype(np.float32)

    def forward(
        self,
        tables: Tables,
        tangent: TableDerivative,
        wanted: Requested,
        *,
        spp: int,
        seed: int,
        max_depth: int,
        bounces: Bounces = UNLIMITED,
        terms: Collection[str] = TERMS,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """(height, width, 3) derivative image along `tangent`."""
        image = self.forward_exact(
            tables, tangent, wanted, spp=spp, seed=seed, max_depth=max_depth, terms=terms, progress=progress
        )
        return image.astype(np.float32)

    def forward_exact(
        self,
        tables: Tables,
        tangent: TableDerivative,
        wanted: Requested,
        *,
        spp: int,
        seed: int,
        max_depth: int,
        terms: Collection[str] = TERMS,
        progress: Progress | None = None,
    ) -> NDArray[np.float64]:
        """As `forward`, not rounded to float32."""
        self.decided = self.decide(tables, wanted, max_depth=max_depth, terms=terms)
        terms = [decision.term for decision in self.decided if decision.computed]
        asked = narrow.asked(tables, wanted)
        sink = Forward(tables, self._surfaces, asked, narrow.narrowed(tables, tangent))
        self._run(tables, sink, spp, seed, max_depth, terms, progress)
        return sink.image.reshape(tables.height, tables.width, 3)

    def decide(
        self,
        tables: Tables,
        wanted: Requested,
        *,
        max_depth: int,
        bounces: Bounces = UNLIMITED,
        terms: Collection[str] = TERMS,
    ) -> Decisions:
        """What a derivative with respect to the tables that `wanted` names consists of."""
        moves = "vertices" in wanted or "camera" in wanted
        edges = EdgeCounts() if self._topology is None else EdgeCounts(*2 * (len(self._topology.vertices),))
        shadows = "needed" if moves and max_depth >= 2 else "still" if max_depth >= 2 else "not rendered"
        reasons = {"interior": ("shading", "needed"), "primary": ("edges", "needed" if moves else "still"),
                   "shadow": ("light shadows", shadows), "indirect": ("edges between surfaces", "not rendered")}
        return tuple(
            Decision(part, term, "computed" if reason == "needed" else "zero", reason, edges)
            for term, (part, reason) in reasons.items() if term in terms
        )

    def backward(
        self,
        tables: Tables,
        adjoint: NDArray[np.float32],
        wanted: Requested,
        *,
        spp: int,
        seed: int,
        max_depth: int,
        bounces: Bounces = UNLIMITED,
        terms: Collection[str] = TERMS,
        progress: Progress | None = None,
    ) -> TableDerivative:
        """Gradient of sum(adjoint * image) with respect to the tables that `wanted` names."""
        self.decided = self.decide(tables, wanted, max_depth=max_depth, terms=terms)
        terms = [decision.term for decision in self.decided if decision.computed]
        asked = narrow.asked(tables, wanted)
        sink = Reverse(tables, self._surfaces, asked, np.asarray(adjoint, np.float64).reshape(-1, 3))
        self._run(tables, sink, spp, seed, max_depth, terms, progress)
        return narrow.widened(tables, sink.gradient, wanted)

    def _run(
        self,
        tables: Tables,
        sink: Sink,
        spp: int,
        seed: int,
        max_depth: int,
        terms: Collection[str],
        progress: Progress | None,
    ) -> None:
        """Send the blocks of the terms asked for to the sink."""
        _check(spp, max_depth, terms)
        film = Film.of(tables)
        position = tables.vertices.astype(np.float64)
        options: dict[str, int] = {"spp": spp, "seed": seed, "max_depth": max_depth}
        share = 1.0 / max(len(terms), 1)
        for k, term in enumerate(terms):
            report = None if progress is None else _part(progress, k * share, share)
            if term == "interior":
                lighting = self._lighting.with_possible(sink.asked.emitting)
                interior(film, lighting, sink, **options, progress=report)
            elif term == "primary":
                # The camera stands still: only edges that move themselves sweep over pixels.
                wanted = sink.moving_vertex[self._edges.vertices].any(axis=1)
                edges = seen_edges(self._edges, self._surfaces, position, film, wanted)
                primary(film, self._lighting, edges, sink, **options, progress=report)
            else:
                shadow(film, self._lighting, self._edges, position, sink, **options, progress=report)


def _part(progress: Progress, start: float, share: float) -> Progress:
    """The progress of one of several terms."""
    return lambda fraction: progress(start + share * fraction)


def _check(spp: int, max_depth: int, terms: Collection[str]) -> None:
    """Raise ``ValueError`` for what the reference engine doesn't do."""
    if spp < 1:
        raise ValueError(f"spp must be at least 1, not {spp}")
    if max_depth not in (1, 2):
        raise ValueError(f"max_depth must be 1 or 2 in this version, not {max_depth}")
    for term in terms:
        if term not in TERMS:
            raise ValueError(f"unknown term '{term}'; terms are {', '.join(TERMS)}")

"""The native engine: finds Embree in the `embreex` wheel and hands the tables to `edgegrad._native`."""

from __future__ import annotations

import atexit
import importlib.util
import math
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import _native
from ..derivatives.decisions import Decision, Decisions, EdgeCounts, Effects
from ..derivatives.table_derivatives import ParameterRows, Requested, TableDerivative, shapes
from ..geometry.topology import Edges
from ..tables.picture_facts import PictureFacts
from ..tables.tables import Tables
from .call_lock import Turns
from .non_finite import warn_of_light, warn_of_samples
from .options import Progress, RenderOptions

# The wheel's own copy of Embree, relative to the folder that holds the package.
_LIBRARY_PATTERNS = {
    "linux": ("embreex.libs/libembree4-*.so*", "embreex.libs/libembree4*.so*"),
    "darwin": ("embreex/.dylibs/libembree4*.dylib", "embreex.dylibs/libembree4*.dylib"),
    "win32": ("embreex.libs/embree4*.dll", "embreex/embree4*.dll"),
}


# Held while a BVH is built or refitted, and during a fork. A forked process lacks Embree's workers, so these must not
# hold a lock at that time. The kernels' threads are no problem, since each call starts its own.
_builds = threading.RLock()
_last_build = -math.inf  # when it ended
# Seconds after a build until its workers sleep; they take a lock to fall asleep.
SETTLED = 0.1


@contextmanager
def _building() -> Iterator[None]:
    global _last_build
    with _builds:
        try:
            yield
        finally:
            _last_build = time.monotonic()


def _before_fork() -> None:
    _builds.acquire()
    time.sleep(max(_last_build + SETTLED - time.monotonic(), 0.0))


def _after_fork_in_child() -> None:
    _native.forget_calls()
    _builds.release()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_before_fork, after_in_parent=_builds.release, after_in_child=_after_fork_in_child
    )
# Python ends a daemon thread by unwinding its stack, which would crash native code.
atexit.register(_native.end_calls)


def embree_library() -> Path:
    """Path of Embree's shared library inside the installed `embreex` wheel.

    Raises
    ------
    ImportError
        If the wheel, or the library in it, is missing.
    """
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        raise ImportError("the package 'embreex', which brings the Embree library, is not installed")
    site = Path(spec.origin).parent.parent
    for pattern in _LIBRARY_PATTERNS.get(sys.platform, ()):
        found = sorted(site.glob(pattern))
        if found:
            return found[0]
    raise ImportError(f"the installed 'embreex' in {site} has no Embree library for {sys.platform}")


def instruction_sets() -> list[str]:
    """Instruction sets this build has and this processor can run, the fastest first."""
    return list(_native.instruction_sets())


def embree_version() -> str:
    """Version of the wheel's Embree, such as "4.4.0"."""
    return str(_native.embree_version(str(embree_library())))


def learned_sampling() -> _native.LearnedSampling:
    """Make an empty record of the sample weights that gradients of one view learn."""
    return _native.LearnedSampling()


class Engine:
    """Renders and differentiates the scene of some tables with the native kernels.

    The native scene holds one camera and one set of values: calls from several threads wait for each other, and each
    uses all the threads.

    Parameters
    ----------
    tables
        The scene.
    threads
        Threads to use; 0: one per core. Results don't depend on it.
    instruction_set
        One of `instruction_sets`; empty: the fastest.
    """

    narrow = False

    def __init__(self, tables: Tables, threads: int, instruction_set: str = "") -> None:
        library = str(embree_library())
        with _building():
            self._scene = _native.Scene(tables, threads, instruction_set, library)
        self._turns = Turns("renderer")
        self.decided: Decisions = ()  # on the last derivative
        # The tables whose materials, textures and environment the native scene has; None: unknown, an update failed.
        self._held: Tables | None = tables

    def set_edges(self, edges: Edges) -> None:
        """Set the edges of the scene (`Tables.edges`), which derivatives need."""
        with self._turns.lock():
            self._scene.set_edges(edges)

    @property
    def instruction_set(self) -> str:
        """The name of the instruction set in use."""
        return str(self._scene.instruction_set)

    def update(self, tables: Tables) -> None:
        """Update all values of a scene with the same topology; the BVHs of moved meshes are refitted."""
        with self._turns.lock():
            self._update(tables)

    def update_values(self, tables: Tables) -> None:
        """Update materials, lights, environment and camera; the geometry stays the same."""
        with self._turns.lock():
            self._update_values(tables)

    def move_vertices(self, mesh: int, vertices: NDArray[np.float64], tables: Tables) -> None:
        """Update the vertices (n, 3) of one mesh, given in world space."""
        with self._turns.lock(), _building():
            self._scene.move_vertices(mesh, vertices, tables.origin)

    def render(
        self, tables: Tables, options: RenderOptions, *, progress: Progress | None = None
    ) -> NDArray[np.float32]:
        """Render the (H, W, 3) picture of the camera in `tables`, or its caustics only."""
        with self._turns.lock():
            self._hold_to_trace(tables)
            image, dropped, pixel = self._scene.render(options, progress)
        if dropped:
            warn_of_light(dropped, *divmod(pixel, tables.width))
        return np.asarray(image)

    def add_samples(
        self,
        tables: Tables,
        options: RenderOptions,
        first: int,
        sums: NDArray[np.float64],
        *,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Add samples, from number `first` on, to `sums` (H, W, 3), and return the picture of all samples."""
        with self._turns.lock():
            self._hold_to_trace(tables)
            image, dropped, pixel = self._scene.add_samples(options, first, sums, progress)
        if dropped:
            warn_of_light(dropped, *divmod(pixel, tables.width))
        return np.asarray(image)

    def forward(
        self,
        tables: Tables,
        tangent: TableDerivative,
        requested: Requested,
        options: RenderOptions,
        *,
        learned: _native.LearnedSampling | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Return the (H, W, 3) derivative of the picture along `tangent`."""
        floats = {name: np.ascontiguousarray(values, np.float64).ravel() for name, values in tangent.items()}
        spans = _float_spans(tables, requested)
        with self._turns.lock():
            self._hold_to_trace(tables)
            image, dropped, decided = self._scene.forward(floats, spans, options, learned, progress)
            self.decided = _decisions(decided)
        warn_of_samples(tables, dropped)
        return np.asarray(image)

    def backward(
        self,
        tables: Tables,
        adjoint: NDArray[np.float32],
        requested: Requested,
        options: RenderOptions,
        *,
        learned: _native.LearnedSampling | None = None,
        progress: Progress | None = None,
    ) -> TableDerivative:
        """Return the gradient of sum(adjoint * picture) with respect to the `requested` tables."""
        spans = _float_spans(tables, requested)
        with self._turns.lock():
            self._hold_to_trace(tables)
            found, dropped, decided = self._scene.backward(adjoint, spans, options, learned, progress)
            self.decided = _decisions(decided)
        warn_of_samples(tables, dropped)
        shape = shapes(tables)
        return {name: np.asarray(found[name]).reshape(shape[name]) for name in requested}

    def picture_facts(self, tables: Tables) -> PictureFacts:
        """Return the facts by which pictures of the tables skip work."""
        with self._turns.lock():
            self._hold(tables)
            return PictureFacts(**self._scene.picture_facts())

    def decide(
        self, tables: Tables, requested: Requested, options: RenderOptions, parameters: ParameterRows
    ) -> Decisions:
        """Decide what a derivative with respect to the `requested` tables consists of, without computing it."""
        spans = _float_spans(tables, requested)
        widths = _widths(tables)
        width = np.array([widths[name] for name in parameters.tables], np.int64)
        each = parameters._replace(spans=parameters.spans * width[parameters.table][:, None])
        with self._turns.lock():
            self._hold(tables)
            return _decisions(self._scene.decide(spans, options, each))

    def _hold(self, tables: Tables) -> None:
        """Update the native scene to the tables, which may have the materials and textures of a derivative."""
        held = self._held
        if held is None or not (
            tables.textures is held.textures and tables.environment_pixels is held.environment_pixels
        ):
            self._update(tables)
        elif tables.materials is not held.materials:
            self._update_values(tables)
        self._scene.set_camera(tables)

    def _hold_to_trace(self, tables: Tables) -> None:
        """Update the native scene as `_hold` does, and build its BVH, which decisions do not need."""
        self._hold(tables)
        if not self._scene.has_bvh:
            with _building():
                self._scene.build_bvh()

    def _update(self, tables: Tables) -> None:
        self._held = None
        with _building():
            self._scene.update(tables)
        self._held = tables

    def _update_values(self, tables: Tables) -> None:
        self._held = None
        self._scene.update_values(tables)
        self._held = tables


def _decisions(rows: list[_native.DecisionRow]) -> Decisions:
    return tuple(Decision(part, term, outcome, reason, EdgeCounts(*edges), meshes, lights, materials, pairs, pierced,
                          limit, samples, seconds, Effects(*effects))
                 for (part, term, outcome, reason, edges, meshes, lights, materials, pairs, pierced,
                      limit, samples, seconds, effects) in rows)


def _widths(tables: Tables) -> dict[str, int]:
    """Return the numbers of floats in a row of each table."""
    return {name: math.prod(shape[1:]) for name, shape in shapes(tables).items()}


def _float_spans(tables: Tables, requested: Requested) -> dict[str, NDArray[np.int64]]:
    """Convert spans of rows to spans of floats."""
    width = _widths(tables)
    return {name: np.ascontiguousarray(spans * width[name], np.int64) for name, spans in requested.items()}

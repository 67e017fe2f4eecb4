"""One-shot functions: a picture, its derivative along a tangent, gradients of parameters.

The last renderer (BVH, edges) is kept, and used again for scenes whose geometry has the same bits. Keep a `Renderer` to
update moving vertices by refitting.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import whole
from ..scene.bounces import Bounces
from ..scene.scene import Scene
from .engine import engine_name
from .options import FIELD_EDGES, MOST_THREADS, TERMS, Progress
from .renderer import Renderer

# Samples per pixel for the fraction of a picture that is caustics, which is a mean over all pixels.
CAUSTIC_SAMPLES = 4

_last: dict[tuple[str, int], Renderer] = {}  # at most one, by engine and threads
_lock = threading.Lock()
_holder = 0  # the thread that holds the lock


def _after_fork() -> None:
    """Forget a renderer and a lock that belong to a thread of the parent process."""
    global _lock
    if _lock.locked() and _holder != threading.get_ident():
        _last.clear()
        _lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


@contextmanager
def prepared(scene: Scene, engine: str = "auto", threads: int = 0) -> Iterator[Renderer]:
    """Yield a renderer of the scene: the last one if its geometry is the same."""
    global _holder
    engine, threads = engine_name(engine), whole("render", "threads", threads, 0, MOST_THREADS)
    # Another thread, or a progress callback of the running call, gets its own renderer.
    lock = _lock
    if not lock.acquire(blocking=False):
        yield _unwatched(scene, engine, threads)
        return
    try:
        _holder = threading.get_ident()
        kept = _last.get((engine, threads))
        if kept is None or not kept.adopt(scene):
            _last.clear()  # free the memory of the old renderer first
            kept = _last[engine, threads] = _unwatched(scene, engine, threads)
        yield kept
    finally:
        lock.release()


def _unwatched(scene: Scene, engine: str, threads: int) -> Renderer:
    """Make a renderer that does not look for changes of the scene."""
    return Renderer(scene, threads=threads, engine=engine, watched=False)


def render(
    scene: Scene,
    spp: int = 64,
    *,
    max_depth: int = 2,
    seed: int = 0,
    bounces: Bounces | None = None,
    threads: int = 0,
    engine: str = "auto",
    progress: Progress | None = None,
) -> NDArray[np.float32]:
    """Render the scene.

    Parameters
    ----------
    scene
        The scene.
    spp
        Samples per pixel, 1 … 2^24.
    max_depth
        Path segments: 1 = light seen directly, 2 = and direct illumination.
    seed
        0 … 2^32 - 1. The same seed gives the same bits, for any number of threads.
    bounces
        Most scatterings of each kind along a path; None: as many as `max_depth` allows.
    threads
        Threads to use; 0: one per core.
    engine
        "auto", "native" or "reference".
    progress
        Called with the fraction done (0 … 1) now and then; an exception it raises cancels and
        propagates (raise `Cancelled`).

    Returns
    -------
    (height, width, 3) float32, linear Rec.709 radiance, row 0 on top: the mean of the radiance
    over each pixel's square.

    Raises
    ------
    ValueError
        For a wrong scene or argument, naming it.
    """
    with prepared(scene, engine, threads) as renderer:
        return renderer.render(spp=spp, max_depth=max_depth, seed=seed, bounces=bounces, progress=progress)


def render_forward(
    scene: Scene,
    tangent: Mapping[str, ArrayLike],
    spp: int = 64,
    *,
    max_depth: int = 2,
    seed: int = 0,
    bounces: Bounces | None = None,
    terms: Sequence[str] = TERMS,
    field_edges: str = FIELD_EDGES[0],
    threads: int = 0,
    engine: str = "auto",
    progress: Progress | None = None,
) -> NDArray[np.float32]:
    """Derivative of the picture along a tangent of the scene's parameters (forward mode).

    Parameters that are not listed, and errors, are those of `render`.

    Parameters
    ----------
    tangent
        Parameter path (``"meshes.cube.vertices"``) to an array of the parameter's shape.
    spp
        Quality: the samples of all terms are in proportion to it. A term whose noise is far below the others'
        takes fewer than by itself: the interior one half or a quarter of `spp` per pixel.
    terms
        Which of the terms "interior", "primary" (edges seen by the camera), "shadow" (edges between light and
        lit surface) and "indirect" (edges between two surfaces) to compute; their sum is the derivative.
    field_edges
        What estimates how the outlines of distance fields change the picture: "outlines" (samples of the outlines),
        "reparameterised" (a warp of the picture, which also sees outlines through a lens), or "relaxed" (bands about
        the outlines, cheap but biased); see :doc:`/how_to/distance_fields`.

    Returns
    -------
    (height, width, 3) float32 derivative of the picture that `render` estimates.
    """
    with prepared(scene, engine, threads) as renderer:
        return renderer.render_forward(
            tangent, spp=spp, max_depth=max_depth, seed=seed, bounces=bounces, terms=terms,
            field_edges=field_edges, progress=progress,
        )


def render_backward(
    scene: Scene,
    adjoint: ArrayLike,
    wrt: Sequence[str],
    spp: int = 64,
    *,
    max_depth: int = 2,
    seed: int = 0,
    bounces: Bounces | None = None,
    terms: Sequence[str] = TERMS,
    field_edges: str = FIELD_EDGES[0],
    threads: int = 0,
    engine: str = "auto",
    progress: Progress | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Gradients of ``sum(adjoint * render(scene))`` with respect to parameters (reverse mode).

    Parameters that are not listed, and errors, are those of `render_forward`.

    Parameters
    ----------
    adjoint
        (height, width, 3): derivative of a loss with respect to the picture. Derivatives have random numbers
        of their own, so that it may come from a picture of the same seed.
    wrt
        Parameter paths.

    Returns
    -------
    Parameter path to a float64 array of the parameter's shape.
    """
    with prepared(scene, engine, threads) as renderer:
        return renderer.render_backward(
            adjoint, wrt, spp=spp, max_depth=max_depth, seed=seed, bounces=bounces, terms=terms,
            field_edges=field_edges, progress=progress,
        )


def caustic_share(
    scene: Scene, *, spp: int = CAUSTIC_SAMPLES, max_depth: int, seed: int = 0, bounces: Bounces | None = None,
    threads: int = 0,
) -> float:  # fmt: skip
    """Measure the fraction of the picture's light that is caustics; see `Renderer.render_caustics`.

    Returns
    -------
    0 … 1: the sum of the caustics' radiance over pixels and colours by that of the picture; 0 for a black picture.
    """
    renderer = Renderer(scene, threads=threads)  # not kept, since a caller of `plan` may not render
    options: dict[str, Any] = {"spp": spp, "max_depth": max_depth, "seed": seed, "bounces": bounces}
    whole = renderer.render(**options).sum(dtype=np.float64)
    part = renderer.render_caustics(**options).sum(dtype=np.float64)
    return float(part / whole) if whole > 0.0 else 0.0

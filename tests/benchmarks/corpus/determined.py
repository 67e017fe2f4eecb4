"""How well a picture by Cycles determines a parameter: the error that the picture's noise alone leaves in a fit.

A fit cannot find what the picture hardly shows: the colour of a dark object, or the place of a plane that slides in
itself. The estimate uses differences of pictures, not the derivatives that the fits test.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene import parameters
from edgegrad.scene.bounces import Bounces

F64 = NDArray[np.float64]

SAMPLES = 32


def expected_error(
    scene: edgegrad.Scene, theirs: NDArray[np.float32], path: str, moves: Sequence[tuple[Any, Any]], *,
    max_depth: int, bounces: Bounces | None = None, by_channel: bool = False,
) -> float:  # fmt: skip
    """Return the standard deviation of the least squares estimate, in its worst direction, as a part of a move.

    Let a row of J be the change of the picture by one move, and S the variance of the target's pixels. The estimate has
    the covariance A^-1 B A^-1, with A = J J^T and B = J S J^T. Two seeds give two independent J, whose product has no
    bias by the noise of either.

    Parameters
    ----------
    theirs
        (seeds, H, W, 3) pictures whose mean is the target.
    moves
        For each direction the values of the parameter half a move before and after the truth.
    by_channel
        Whether the three channels are moved at once and each changes its own channel of the picture alone.
    """
    truth = parameters.get(scene, path)
    first, second = (np.stack([_change(scene, path, move, seed, max_depth, bounces) for move in moves])
                     for seed in (1, 2))  # fmt: skip
    parameters.put(scene, path, truth)
    variance = np.asarray(theirs.var(axis=0, ddof=1, dtype=np.float64) / len(theirs))
    if by_channel:
        first, second = (change * np.eye(3)[:, None, None, :] for change in (first, second))
    first, second = (change.reshape(len(change), -1) for change in (first, second))
    seen = 0.5 * (first @ second.T + second @ first.T)
    noise = 0.5 * sum(change * variance.ravel() @ change.T for change in (first, second))
    if np.linalg.eigvalsh(seen)[0] <= 0.0:
        return float("inf")
    inverse = np.linalg.inv(seen)
    return float(np.sqrt(np.linalg.eigvalsh(inverse @ noise @ inverse)[-1]))


def _change(
    scene: edgegrad.Scene, path: str, move: tuple[Any, Any], seed: int, max_depth: int, bounces: Bounces | None
) -> F64:
    """(H, W, 3) change of the picture by a move."""
    pictures = []
    for value in move:
        parameters.put(scene, path, value)
        pictures.append(edgegrad.render(scene, spp=SAMPLES, seed=seed, max_depth=max_depth,
                                        bounces=bounces).astype(np.float64))  # fmt: skip
    return np.asarray(pictures[1] - pictures[0])

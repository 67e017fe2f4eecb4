"""A search for starts that needs no derivatives: many coarse pictures of random poses, the best of them improved.

A derivative tells how a picture changes nearby. It is silent about an object that overlaps nowhere with where it should
be, or is out of view, and about a camera that looks elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene.camera import Camera
from .moves import Moves

F64 = NDArray[np.float64]

# How far the first look around the start goes, in first steps, and what part of the loss it has to save: a gradient
# can follow that.
NEAR, SPEAKS = (3.0, 12.0), 0.02
# Distances of random starts, in first steps, and pictures of all of them and for each number of them.
FAR = (15.0, 45.0, 120.0)
PICTURES, PER_NUMBER, MOST_NUMBERS = 80, 20, 9
# Part of the pictures that improves the best starts, how many of these, and by what their moves grow and shrink.
IMPROVING, IMPROVED, GROW, SHRINK = 0.5, 4, 1.6, 0.8
# What part of the start's loss another start may have to be taken instead.
BETTER = 0.9
# How much of its loss a start may lose for moves that are taken back.
PLAIN = 1.25
# Starts that are closer to each other are one, in first steps.
DISTINCT = 5.0


@dataclass(frozen=True)
class Found:
    """A start.

    Attributes
    ----------
    vector
        How far it is from where the fit began (`Moves`).
    loss
        Of its coarse pictures.
    """

    vector: F64
    loss: float


def pictures_for(count: int) -> int:
    """Return how many coarse pictures a search over this many numbers renders if nothing else is asked for."""
    return PICTURES + PER_NUMBER * min(count, MOST_NUMBERS)


def gradient_speaks(loss: Callable[[F64], float], count: int, at_start: float) -> bool:
    """Whether a small move of one number lowers the loss enough for a gradient to follow."""
    for size in NEAR:
        for step in np.concatenate([np.eye(count), -np.eye(count)]):
            if loss(size * step) < (1.0 - SPEAKS) * at_start:
                return True
    return False


def find_starts(
    loss: Callable[[F64], float], moves: Moves, cameras: Sequence[Camera], at_start: float, pictures: int,
    generator: np.random.Generator, tell: Callable[[float], None],
) -> list[Found]:
    """Return starts, the best first; the fit's own is the vector 0.

    Parameters
    ----------
    loss
        Loss of the coarse pictures at a vector.
    at_start
        Its value at 0.
    pictures
        How many losses may be evaluated.
    tell
        Called with the completed part after each.
    """
    found = [Found(np.zeros(moves.count), at_start)]

    def tried(vector: F64) -> Found:
        one = Found(vector, loss(vector))
        found.append(one)
        tell((len(found) - 1) / pictures)
        return one

    wide = max(1, pictures - int(IMPROVING * pictures))
    for k, cell in enumerate(_spread(wide, moves.count, generator)):
        vector = FAR[k % len(FAR)] * (2.0 * cell - 1.0)
        if k % 4 >= 2:  # one variable, or one number, by itself
            alone = list(moves.parts.values())[generator.integers(len(moves.parts))]
            if k % 4 == 2:
                number = int(generator.integers(alone.start, alone.stop))
                alone = slice(number, number + 1)
            kept = vector[alone].copy()
            vector[:] = 0.0
            vector[alone] = kept
        tried(moves.aimed(vector, cameras, generator) if k % 2 else vector)
    best = distinct(found)[:IMPROVED]
    sizes = [FAR[0]] * len(best)
    # Turns go to all of the best at first, and to the very best in the end.
    for k in range(pictures - wide):
        among = max(1, round(len(best) * (1.0 - k / (pictures - wide))))
        n = k % among if k % 2 else min(range(among), key=lambda i: best[i].loss)
        step = generator.standard_normal(moves.count)
        if generator.random() < 0.5 and len(moves.parts) > 1:
            alone = list(moves.parts.values())[generator.integers(len(moves.parts))]
            outside = np.ones(moves.count, bool)
            outside[alone] = False
            step[outside] = 0.0
        one = tried(best[n].vector + sizes[n] * step / np.sqrt(max(np.count_nonzero(step), 1)))
        better = one.loss < best[n].loss
        best[n] = one if better else best[n]
        sizes[n] *= GROW if better else SHRINK
    return distinct(found)


def plainest(loss: Callable[[F64], float], one: Found, moves: Moves) -> Found:
    """Take back those moves of a start that its coarse pictures do not need: of whole variables, turns, single numbers.

    They may be wrong: small pictures hardly tell how an object is turned.
    """
    most = PLAIN * one.loss
    numbers = [slice(k, k + 1) for k in range(moves.count)]
    turns = [slice(part.start, part.start + 3) for part in moves.parts.values() if part.stop - part.start == 6]
    for part in (*moves.parts.values(), *turns, *numbers):
        vector = one.vector.copy()
        vector[part] = 0.0
        if vector.any() and one.vector[part].any() and (found := loss(vector)) <= most:
            one = Found(vector, found)
    return one


def distinct(found: Sequence[Found]) -> list[Found]:
    """Return the starts in the order of their losses, without those that lie close to a better one."""
    out: list[Found] = []
    for one in sorted(found, key=lambda each: each.loss):
        if np.isfinite(one.loss) and all(np.abs(one.vector - other.vector).max() > DISTINCT for other in out):
            out.append(one)
    return out


def _spread(count: int, numbers: int, generator: np.random.Generator) -> F64:
    """(count, numbers) points in the unit cube, one in each of `count` layers along every axis (Latin hypercube)."""
    layers = np.stack([generator.permutation(count) for _ in range(numbers)], axis=1)
    return np.asarray((layers + generator.random((count, numbers))) / count)

"""How a loss curves about the end of a fit, and how the noise of pictures tilts it.

Let J be the derivative of all pictures by the coordinates, r the residual (picture minus target), a(r) the adjoint of
the loss, and C = da/dr J. Near the end, the gradient of the loss is J^T a(r), and its derivative is H = J^T C. Noise e
of the pixels tilts the loss by C^T e, so the minimum moves by -H^-1 C^T e, which has the covariance

    H^-1 B H^-1,   B = E[(C^T e)(C^T e)^T].

Nothing in this needs a noise model: e is the residual itself. Its pixels are summed over small blocks first, within
which noise may be correlated, as by a denoiser (White 1980; "cluster robust"). Losses that are not quadratic have no
constant C; the sign of each block's residual is random, and B is the mean over such signs ("wild bootstrap").

A fit that has not arrived still has a gradient g = J^T a(r), and -H^-1 g is about what is ahead of it. At the end of
a fit only the noise of the two renders is left in g.

J is noisy, and J^T C of one estimate would contain its variance. Hence two independent ones are used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..losses import Loss
from ..targets import View

F64 = NDArray[np.float64]
Adjoint = Callable[[F64], F64]

# Largest side of a block, pixels, and least number of blocks along the shorter side of a picture.
BLOCK, LEAST_BLOCKS = 4, 12
# Groups of blocks, whose curvatures are independent estimates, and by how many of its standard errors a curvature has
# to exceed 0.
GROUPS, CERTAIN = 8, 2.0
# Draws of signs, for losses that are not quadratic.
DRAWS = 64
# Change of a picture along a coordinate from which C is found, in parts of the residual's deviation; any does for a
# quadratic loss, whose adjoint doubles with the residual within this error.
CHANGE, QUADRATIC = 0.5, 1e-4


@dataclass
class Equations:
    """Sums over pictures.

    Attributes
    ----------
    curvature
        H.
    tilt
        B, of the mean of two pictures of the end.
    rendered
        The part of `tilt` that is the noise of these two renders.
    gradient
        g.
    parts
        Sums like `curvature` over groups of blocks, whose spread tells how noisy it is.
    blocks
        Number of blocks that some coordinate changes.
    """

    curvature: F64
    tilt: F64
    rendered: F64
    gradient: F64
    parts: F64
    blocks: int = 0

    @staticmethod
    def empty(count: int) -> Equations:
        """Return the sums over no picture."""
        square = (count, count)
        return Equations(np.zeros(square), np.zeros(square), np.zeros(square), np.zeros(count),
                         np.zeros((GROUPS, *square)))  # fmt: skip

    def add(self, view: View, loss: Loss, pictures: tuple[F64, F64], columns: tuple[F64, F64],
            generator: np.random.Generator) -> None:  # fmt: skip
        """Add a picture.

        Parameters
        ----------
        view, loss
            Its target, and how it is compared.
        pictures
            Two independent renders of the end, as the loss sees them.
        columns
            Two independent estimates (coordinates, H, W, 3) of J.
        generator
            Of random signs.
        """
        target = view.image.astype(np.float64)
        residual = 0.5 * (pictures[0] + pictures[1]) - target

        def adjoint(difference: F64) -> F64:
            return view.weight * np.asarray(loss(target + difference, target, view.mask)[1], np.float64)

        noise = float(np.sqrt(np.mean(residual**2))) or 1.0
        curved = [np.stack([_slope(adjoint, residual, column, noise) for column in half]) for half in columns]
        side = max(1, min(BLOCK, min(target.shape[:2]) // LEAST_BLOCKS))
        row, column = (np.arange(size) // side for size in target.shape[:2])
        group = (column[None, :] + 3 * row[:, None]) % GROUPS
        for n in range(GROUPS):
            for j, c in ((columns[0], curved[1]), (columns[1], curved[0])):
                product = j[:, group == n].reshape(len(j), -1) @ c[:, group == n].reshape(len(c), -1).T
                self.parts[n] += 0.25 * (product + product.T)
        self.curvature = self.parts.sum(axis=0)
        mean = 0.5 * (curved[0] + curved[1])
        self.rendered += _squares(_in_blocks(mean * (0.5 * (pictures[0] - pictures[1])), side))
        own = _in_blocks(mean * residual, side)
        self.blocks += int((own != 0.0).any(axis=0).sum())
        at_end = adjoint(residual)
        self.gradient += np.einsum("khwc,hwc->k", 0.5 * (columns[0] + columns[1]), at_end)
        scale = float(np.abs(at_end).max())
        if np.abs(adjoint(2.0 * residual) - 2.0 * at_end).max() <= QUADRATIC * scale:
            self.tilt += _squares(own)
            return
        both = 0.5 * (columns[0] + columns[1])
        for _ in range(DRAWS):
            signs = generator.choice((-1.0, 1.0), -(-np.array(target.shape[:2]) // side))
            spread = np.repeat(np.repeat(signs, side, axis=0), side, axis=1)[: target.shape[0], : target.shape[1], None]
            pull = np.einsum("khwc,hwc->k", both, adjoint(residual * spread))
            self.tilt += np.outer(pull, pull) / DRAWS


def _slope(adjoint: Adjoint, residual: F64, column: F64, noise: float) -> F64:
    """Derivative of the adjoint along a column of J."""
    moved = column[np.abs(column) > 1e-3 * np.abs(column).max()] if column.any() else column
    size = float(np.sqrt(np.mean(moved**2)))
    if size == 0.0:
        return np.zeros_like(column)
    h = CHANGE * noise / size
    return (adjoint(residual + h * column) - adjoint(residual - h * column)) / (2.0 * h)


def _in_blocks(values: F64, side: int) -> F64:
    """(k, H, W, 3) summed over channels and blocks of pixels; (k, blocks)."""
    flat = values.sum(axis=-1)
    for axis in (1, 2):
        flat = np.add.reduceat(flat, np.arange(0, flat.shape[axis], side), axis=axis)
    return np.asarray(flat.reshape(len(flat), -1))


def _squares(sums: F64) -> F64:
    return np.asarray(sums @ sums.T)


@dataclass(frozen=True)
class Solution:
    """What the equations say about the coordinates.

    Attributes
    ----------
    covariance
        Of the coordinates, in their units; directions that are open have no part in it.
    open
        (n, k) directions along which the pictures do not change measurably: by how much each coordinate would
        change them by itself.
    lost
        (k,) whether this may be due to the noise of the derivatives.
    ahead, ahead_error
        (n,) what is about to change yet, in the coordinates' units, and the standard error of that.
    gain, chance
        By how much the loss falls along `ahead`, and by how much it would fall on average at the end of a fit that has
        arrived.
    """

    covariance: F64
    open: F64
    lost: NDArray[np.bool_]
    ahead: F64
    ahead_error: F64
    gain: float
    chance: float


# A direction whose curvature is this part of that of single coordinates, or below its noise, is open. If the noise
# exceeds the larger number, the curvature itself may well do so too.
SINGULAR, NOISY = 1e-5, 0.01


def solve(equations: Equations, steps: Sequence[float], left: float) -> Solution:
    """Solve the equations.

    Parameters
    ----------
    steps
        First step of each coordinate, the unit in which all are measured.
    left
        The part of the renders' noise, `rendered`, that the end of the fit has (its square, as of a variance).
    """
    unit = np.asarray(steps)
    h = equations.curvature * np.outer(unit, unit)
    spare = equations.blocks / max(equations.blocks - len(unit), 1) if len(unit) else 1.0
    total = spare * equations.tilt * np.outer(unit, unit)
    rendered = equations.rendered * np.outer(unit, unit)
    size = np.sqrt(np.clip(np.diag(h), 0.0, None))
    seen = size > 0.0
    by = np.where(seen, size, 1.0)
    curved, axes = np.linalg.eigh(np.where(np.outer(seen, seen), h, 0.0) / np.outer(by, by))
    along = np.einsum("ik,nij,jk->nk", axes, equations.parts * np.outer(unit / by, unit / by), axes)
    noise = CERTAIN * np.sqrt(GROUPS) * along.std(axis=0, ddof=1)
    known = curved > np.maximum(SINGULAR, noise)
    inverse = (axes * np.where(known, 1.0 / np.where(known, curved, 1.0), 0.0)) @ axes.T
    # The noise of the targets is what remains without that of the two renders, whose mean `tilt` holds.
    tilt = _positive((total - rendered) / np.outer(by, by)) + left * rendered / np.outer(by, by)
    covariance = inverse @ tilt @ inverse * np.outer(unit / by, unit / by)
    scaled = equations.gradient * unit / by
    ahead = -(inverse @ scaled) * unit / by
    by_renders = inverse @ (rendered / np.outer(by, by)) @ inverse * np.outer(unit / by, unit / by)
    return Solution(covariance, axes[:, ~known], (np.abs(curved) + noise)[~known] > NOISY, ahead,
                    np.sqrt(np.clip(np.diag(by_renders), 0.0, None)), 0.5 * float(scaled @ inverse @ scaled),
                    0.5 * float(np.sum(inverse * (tilt + rendered / np.outer(by, by)))))  # fmt: skip


def _positive(matrix: F64) -> F64:
    """The nearest matrix without negative eigenvalues."""
    size, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((axes * np.clip(size, 0.0, None)) @ axes.T)

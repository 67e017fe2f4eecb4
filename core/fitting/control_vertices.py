"""Control vertices, whose linear map to the rendered ones is known: steps are measured on the rendered vertices.

With the map S, a move d of the control vertices moves the rendered ones by S d. Subdivision averages, so moves of
neighbours against each other hardly show: the gradient by them is small twice over, as it passes S^T, and as the error
that remains passes S. A step of (S^T S + eps)^-1 times the gradient is that of a fit of the rendered vertices
themselves. `smoothness` adds lambda L to the matrix, with the Laplacian L of the control mesh. A step is shortened
where it would fold the rendered mesh (`Cage`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from cholespy import CholeskySolverD, MatrixType
from numpy.typing import NDArray

from ..geometry.labels import summed
from .checkpoints.resumable import Resumable
from .optimisers import AdamUniform
from .rigid_variables import BETA2
from .vertices.cage import Cage
from .vertices.rules import Constraint, VertexRules

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# eps, relative to the mean of the diagonal of S^T S. A smaller value moves vertices farther that show little.
LEAST = 0.01
# Default first step, as a fraction of the diagonal of the bounding box.
STEP = 0.02


class ControlVertices(Resumable):
    """A driven variable: control vertices with their map to the rendered ones.

    Parameters
    ----------
    path
        Name of the variable.
    vertices
        (n, 3) control vertices.
    rows, columns, weights
        Entries of the map: rendered vertex `row` moves by about `weight` times the move of the control vertex
        `column`.
    faces
        (m, 3) triangles of the control mesh.
    step
        Largest move of a rendered vertex in the first step, as a fraction of the extent; None: the default.
    smoothness
        lambda; None: 0, since the map smooths already.
    free
        (n, 3) coordinates that may change; None: all.
    rules
        What the vertices may do; None: all.
    cage
        The rendered mesh, which steps must not fold; None: it is not tested.

    Attributes
    ----------
    symmetric
        Whether the shape is mirrored.
    independent
        Whether each free coordinate may change by itself: no rules tie it to others.
    free
        (n, 3) coordinates that may change.
    starts
        Shapes with which the fit may start; the one that fits the pictures best shall be given to `begin`.
    """

    changing = ("value", "_optimiser", "_length")

    def __init__(self, path: str, vertices: F64, rows: I64, columns: I64, weights: F64, faces: NDArray[np.int32],
                 step: float | None = None, smoothness: float | None = None,
                 free: NDArray[np.bool_] | None = None, rules: VertexRules | None = None,
                 cage: Cage | None = None) -> None:  # fmt: skip
        self._constraint = None if rules is None else Constraint(path, rules, vertices)
        self.path, self._cage = path, cage
        self.symmetric = self._constraint is not None and self._constraint.partner is not None
        self.starts = [vertices] if self._constraint is None else self._constraint.starts()
        self.value = self.starts[0]
        self.step = (STEP if step is None else step) * (float(np.linalg.norm(np.ptp(vertices, axis=0))) or 1.0)
        self.independent = self._constraint is None
        self.free = np.ones(vertices.shape, bool) if free is None else free
        self._map = rows, columns, weights
        self._solver = _factored(len(vertices), *self._map, faces, smoothness or 0.0)
        self._optimiser = AdamUniform(1.0, beta2=BETA2)
        self._length: float | None = None

    def begin(self, start: F64) -> None:
        """Start at one of `starts`."""
        self.value = start

    def take_step(self, gradient: F64, factor: float) -> Any:
        """Make one step, and return the next vertices."""
        if self._constraint is not None:
            gradient = self._constraint.pull(gradient)
        filtered = np.zeros_like(gradient)
        self._solver.solve(np.ascontiguousarray(gradient), filtered)
        if self._constraint is not None:
            filtered = self._constraint.push(filtered)
        change = self._optimiser.update(np.zeros_like(filtered), filtered * self.free, factor)
        if self._length is None and change.any():
            rows, columns, weights = self._map
            moved = summed(rows, weights[:, None] * change[columns])
            longest = float(np.linalg.norm(moved, axis=1).max())
            self._length = factor * self.step / longest if longest > 0.0 else None
        if self._length is None:
            return self.value
        self.value = self.value + self.without_folds(self.value, self._length * change)
        return self.value

    def without_folds(self, before: F64, change: F64) -> F64:
        """Return moves from the vertices `before`, shortened where they would fold the rendered mesh."""
        if self._cage is None:
            return change
        kept = self._cage.shortened(before, change)
        if self._constraint is not None and self._constraint.partner is not None:
            kept = np.minimum(kept, kept[self._constraint.partner])
        return np.asarray(kept[:, None] * change)


def _factored(count: int, rows: I64, columns: I64, weights: F64, faces: NDArray[np.int32],
              smoothness: float) -> CholeskySolverD:  # fmt: skip
    """Factorise S^T S + eps + lambda L."""
    order = np.argsort(rows, kind="stable")
    row, column, weight = rows[order], columns[order], weights[order]
    keys, values = [], []
    offset = 0
    while offset < len(row):
        # Pairs of entries of one row, `offset` places from each other
        same = np.flatnonzero(row[offset:] == row[: len(row) - offset])
        if not len(same):
            break
        a, b, product = column[same], column[same + offset], weight[same] * weight[same + offset]
        keys.append(a * count + b)
        values.append(product)
        if offset:
            keys.append(b * count + a)
            values.append(product)
        offset += 1
    every = np.arange(count, dtype=np.int64) * (count + 1)
    diagonal = np.bincount(column, weight**2, minlength=count)
    keys.append(every)
    values.append(np.full(count, LEAST * float(diagonal.mean() or 1.0)))
    if smoothness > 0.0:
        a = faces[:, [0, 1, 2]].ravel().astype(np.int64)
        b = faces[:, [1, 2, 0]].ravel().astype(np.int64)
        scale = smoothness * float(diagonal.mean() or 1.0)
        for i, j in ((a, b), (b, a)):
            keys += [i * count + i, i * count + j]
            values += [np.full(len(i), 0.5 * scale), np.full(len(i), -0.5 * scale)]
    key, inverse = np.unique(np.concatenate(keys), return_inverse=True)
    total = np.bincount(inverse.ravel(), np.concatenate(values))
    return CholeskySolverD(count, (key // count).astype(np.int32), (key % count).astype(np.int32), total,
                           MatrixType.COO)  # fmt: skip

"""The variable of the vertices of a mesh: preconditioned steps within rules, from coarse to fine, without folds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...geometry import topology
from ...geometry.labels import summed
from ..checkpoints.resumable import Resumable
from ..large_steps import LargeSteps
from ..optimisers import AdamUniform
from ..rigid_variables import BETA2
from .fold_guard import FoldGuard
from .rules import Constraint, VertexRules

F64 = NDArray[np.float64]

# Default first step of vertices, as a fraction of the diagonal of the mesh's bounding box.
VERTEX_STEP = 0.02
# Default factor for the tangential motion of vertices of closed meshes; that of an open border changes the shape. A
# smaller value keeps vertices evenly spaced, but material borders and UV maps cannot move along the surface.
SLIDE = 0.5
# Without a given smoothness, it falls from its automatic value to this one, within this part of the fit, on this many
# levels. Large moves first drag whole regions along; fine detail comes last. An earlier release crumples hollows before
# large moves have reached them.
LAST_SMOOTHNESS, RELEASED, LEVELS = 2.0, 1.0, 12
# Where faces have become longer than at the start by more than this factor, vertices go up to this part of the way to
# the middle of their neighbours in each step, along the surface. A smaller factor keeps sides equal, but UV maps move.
DISTORTED, EVENED = 1.3, 0.5


class Vertices(Resumable):
    """The vertices of a mesh: AdamUniform on steps that are filtered over the welded mesh (`LargeSteps`).

    To first order, only the normal motion of a smooth surface changes its picture. The preconditioner turns such a
    gradient into a step that also has tangential parts: a growing bump drags the vertices around it along. Tangential
    motion does not change the shape, but it makes the vertices drift. Therefore it is scaled by `slide`. With
    T = n n^T + slide (1 - n n^T) and the rules C (`Constraint`), a step is C T (I + lambda L)^-2 T C^T times the
    gradient. This matrix is symmetric and positive, so the step is a descent direction. `FoldGuard` shortens it where
    faces would fold.

    Gradients push a crease that has begun deeper, so its vertices would be held until the end of the fit, and nothing
    would open it. Therefore a vertex that was held goes towards the middle of its neighbours in the next step, until it
    is as far from there as at the start. So detail that the start has stays.

    Attributes
    ----------
    symmetric
        Whether the shape is mirrored.
    starts
        Shapes with which the fit may start; the one that fits the pictures best shall be given to `begin`.
    """

    changing = ("value", "_optimiser", "_length", "_count", "_held")

    def __init__(
        self, path: str, vertices: F64, faces: NDArray[np.int32], step: float | None, smoothness: float | None,
        slide: float | None, iterations: int = 1, rules: VertexRules | None = None,
    ) -> None:
        self.path = path
        extent = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        if not extent > 0.0:
            raise ValueError(f"parameter '{path}': all vertices are at one place, so the mesh has no extent that sets "
                             "the length of a step; separate its vertices")
        self.step = (VERTEX_STEP if step is None else step) * extent
        self._constraint = None if rules is None else Constraint(path, rules, vertices)
        self.symmetric = self._constraint is not None and self._constraint.partner is not None
        self.starts = [vertices] if self._constraint is None else self._constraint.starts()
        self.value = self.starts[0]
        self._faces = faces
        self._steps = LargeSteps(self.value, faces, smoothness)
        self._release = smoothness is None
        self._coarse = self._steps.smoothness
        self._iterations, self._count = iterations, 0
        self._slide = slide if slide is not None else SLIDE if topology.is_closed(faces, self._steps.label) else 1.0
        self._guard, self._bent = FoldGuard(self.value, faces, self._steps.label), self._bends(self.value)
        self._held = np.zeros(len(vertices))  # part of each vertex's last move that the guard has taken away
        self._optimiser = AdamUniform(1.0, beta2=BETA2)
        self._length: float | None = None

    def begin(self, start: F64) -> None:
        """Start at one of `starts`."""
        self.value = start
        self._guard, self._bent = FoldGuard(start, self._faces, self._steps.label), self._bends(start)

    def take_step(self, gradient: F64, factor: float) -> Any:
        if self._constraint is not None:
            gradient = self._constraint.pull(gradient)
        self._refine()
        self._count += 1
        steps = self._steps
        filtered = self._restrained(steps.vertices(steps.gradient(self._restrained(gradient))))
        if self._constraint is not None:
            filtered = self._constraint.push(filtered)
        change = self._optimiser.update(np.zeros_like(filtered), filtered, factor)
        if not change.any():
            return self.value
        if self._length is None:
            # `step` is the length of the longest move of the first step
            self._length = factor * self.step / float(np.linalg.norm(change, axis=1).max())
        change = self._eased(self._length * change)
        change = change + self._evened(change)
        kept = self._guard.shortened(self.value, change)
        if self._constraint is not None and self._constraint.partner is not None:
            kept = np.minimum(kept, kept[self._constraint.partner])
        self._held = 1.0 - kept
        # All copies of a welded vertex get the same change, so a seam cannot tear.
        self.value = self.value + kept[:, None] * change
        return self.value

    def _bends(self, vertices: F64) -> F64:
        """(n,) distance of each vertex from the middle of its neighbours."""
        return np.asarray(np.linalg.norm(self._steps.middle_of_neighbours(vertices) - vertices, axis=1))

    def _eased(self, change: F64) -> F64:
        """Moves whose part that was held in the last step goes towards the neighbours instead, against creases."""
        if not self._held.any():
            return change
        follow = self._steps.middle_of_neighbours(self.value) - self.value
        length = np.linalg.norm(follow, axis=1)
        follow *= (np.maximum(length - self._bent, 0.0) / np.where(length > 0.0, length, 1.0))[:, None]
        if self._constraint is not None:
            follow = self._constraint.push(follow)
        return change + self._held[:, None] * (follow - change)

    def _evened(self, change: F64) -> F64:
        """Moves along the surface that bring distorted faces back towards equal sides."""
        points = self.value + change
        amount = np.clip(EVENED * (self._guard.distortion(points) - DISTORTED), 0.0, EVENED)[:, None]
        away = self._steps.middle_of_neighbours(points) - points
        normal = vertex_normals(points, self._faces, self._steps.label)
        along = amount * (away - np.einsum("ij,ij->i", away, normal)[:, None] * normal)
        return along if self._constraint is None else self._constraint.push(along)

    def _refine(self) -> None:
        """Lower the smoothness, if it is time for it."""
        if not self._release or self._coarse <= LAST_SMOOTHNESS:
            return
        level = min(int(LEVELS * self._count / max(RELEASED * self._iterations, 1.0)), LEVELS)
        wanted = self._coarse * (LAST_SMOOTHNESS / self._coarse) ** (level / LEVELS)
        if wanted != self._steps.smoothness:
            self._steps = self._steps.with_smoothness(wanted)

    def _restrained(self, vectors: F64) -> F64:
        """Multiply vectors at the vertices by T: scale their tangential part by `slide`."""
        if self._slide == 1.0:
            return vectors
        normal = vertex_normals(self.value, self._faces, self._steps.label)
        normal_part = np.einsum("ij,ij->i", vectors, normal)[:, None] * normal
        free = ~normal.any(axis=1)  # vertices without a normal move freely
        return np.where(free[:, None], vectors, self._slide * vectors + (1.0 - self._slide) * normal_part)


def vertex_normals(vertices: F64, faces: NDArray[np.integer], label: NDArray[np.int64]) -> F64:
    """(n, 3) unit vertex normals: area-weighted mean over the faces at each welded vertex; 0 if the mean is 0."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice_area = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    total = summed(label[faces.ravel()], twice_area, int(label.max()) + 1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray((total / np.where(length > 0.0, length, 1.0))[label])

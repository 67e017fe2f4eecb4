"""Optimised variables for the coefficients of distance fields."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...distance_fields import spline
from ...distance_fields.linear import mapped
from ...distance_fields.redistancing import coefficients_without, distance_coefficients
from ...distance_fields.regularisers import eikonal_of, laplacian_of
from ...scene import parameters
from ...scene.field import Field
from ...scene.scene import Scene
from ..checkpoints.resumable import Resumable, State
from ..optimisers import AdamUniform
from ..rigid_variables import BETA2
from .filters import filters
from .schedule import MOST_COARSER, FieldSteps, refinements

F64 = NDArray[np.float64]

# Default and largest change of the field in a step, in cells. Where the field's gradient has at least half the length
# of a distance's, the surface moves by less than a cell.
STEP = 0.25
MOST_STEP = 0.5
# Fewest cells along an axis of a coarser grid.
LEAST_CELLS = 8
# A fit begins with coarser grids by itself if they have at least this number of cells along each axis, and the start
# within this part of a cell.
HARMLESS_CELLS, HARMLESS = 16, 0.1
# Least value, in cells, of the outermost coefficients of a field that is positive there: the surface stays in the box.
_BORDER = 0.5
# Bytes per coefficient: the scene's array, gradients, means of the optimiser, and what a step and a redistancing need.
_BYTES = 250


class Coefficients(Resumable):
    """Coefficients of a field: AdamUniform on filtered gradients, from coarse grids to the field's own.

    The unknowns of a coarse grid are its coefficients. Subdivision gives those of the scene's field, and its transpose
    gives the gradient. A step changes no coefficient by more than a part of a cell, so that the surface, as long as the
    field is about a distance, moves by less than a cell.
    """

    changing = ("_values", "_level", "_turns", "_spacing", "_count", "_optimiser")

    def __init__(
        self, scene: Scene, path: str, step: float | None, iterations: int, options: FieldSteps | None
    ) -> None:
        self.path = path
        self.step = STEP if step is None else step
        if self.step > MOST_STEP:
            raise ValueError(f"fit: the step size of '{path}' must not be above {MOST_STEP:g} cells, but is "
                             f"{self.step:g}; the surface could move by more than a cell")
        self.options = FieldSteps() if options is None else options
        field: Field = parameters.owner(scene, path)[0]
        if (needed := _BYTES * field.values.size) > self.options.most_memory:
            raise ValueError(f"fit: the variables of '{path}' need about {needed / 1e9:.2g} GB, more than "
                             f"most_memory of FieldSteps ({self.options.most_memory / 1e9:.2g} GB); use a coarser "
                             "grid, or raise most_memory")
        if not _has_surface(field.values.astype(np.float64)):
            raise ValueError(f"fit: the field of '{path}' has no surface from which the fit could begin: its sign is "
                             "the same at all nodes; start with a shape")
        levels = _levels(field, self.options.coarser, path)
        self._level = levels
        self._turns = refinements(levels, iterations)
        self._spacing = field.spacing * 2.0**levels
        self._values = np.asarray(field.values, np.float64)
        if levels:
            places = [np.arange(0, n + 1, 2**levels, dtype=np.float64) for n in field.cells]
            self._values = spline.coefficients(spline.at_nodes_of(self._values, places))
        # The length of a step is one of the surface if the field is a distance.
        self._values = distance_coefficients(self._values, self._spacing)
        self._enclosed = bool((self._values[_shell(self._values)] > 0.0).all())
        self._count = 0
        self._optimiser = AdamUniform(1.0, beta2=BETA2)
        self._filters = filters(self._values.shape, self.options.smoothness)

    def take_step(self, gradient: F64, factor: float) -> Any:
        while self._turns and self._count >= self._turns[0]:
            self._turns.pop(0)
            self._refine()
        for _ in range(self._level):
            gradient = spline.coarsened_gradient(gradient)
        smooth = mapped(gradient + self._regulariser(), self._filters)
        move = self._optimiser.update(np.zeros_like(smooth), smooth, factor)
        most = factor * self.step
        largest = float(np.abs(move).max(initial=0.0))
        # Without momentum the largest entry is at most `factor`; it is never more than the step.
        change = move * (most / max(largest, factor)) if largest > 0.0 else move
        self._count += 1
        self._accept(self._values + change * float(self._spacing.min()))
        return self.scene_values(self._values)

    def scene_values(self, values: F64) -> F64:
        """Coefficients of the scene's field for those of the present grid."""
        for _ in range(self._level):
            values = spline.refined(values)
        return values

    def nodes(self) -> F64:
        """Values at the nodes of the present grid."""
        return np.asarray(spline.node_values(self._values))

    def node_places(self, field: Field) -> F64:
        """(n, 3) places in the world of the nodes of the present grid."""
        at = np.indices([n - 2 for n in self._values.shape]).reshape(3, -1).T * 2.0**self._level
        to_world = field.grid_to_world()
        return np.asarray(at @ to_world[:, :3].T + to_world[:, 3])

    def coefficients_of(self, nodes: F64) -> F64 | None:
        """Coefficients, on the present grid, of the distance from the surface with other values at the nodes.

        None if there is no surface.
        """
        values = self._within(spline.coefficients(nodes))
        return distance_coefficients(values, self._spacing) if _has_surface(values) else None

    def opened(self, cells: float) -> F64 | None:
        """Coefficients without whatever is thinner than twice a number of cells (a morphological opening)."""
        by = cells * float(self._spacing.max())
        if not _has_surface(self._values + by):
            return None
        inner = distance_coefficients(self._values + by, self._spacing)
        return self._within(distance_coefficients(inner - by, self._spacing))

    def coefficients_without(self, removed: NDArray[np.bool_]) -> F64:
        """Coefficients, on the present grid, of the distance from the surface without some of the nodes inside.

        The removed nodes are a whole connected part, and not all nodes inside.
        """
        return self._within(coefficients_without(self._values, removed, self._spacing))

    def coefficients_filled(self, filled: NDArray[np.bool_]) -> F64:
        """Likewise with matter at some of the nodes outside, which are whole cavities."""
        return self._within(-coefficients_without(-self._values, filled, self._spacing))

    def adopt(self, values: F64) -> None:
        """Go on from other coefficients of the present grid. Means of gradients of the former shape are forgotten."""
        self._values = values
        self._optimiser = AdamUniform(1.0, beta2=BETA2)

    def adopt_scene_values(self, values: NDArray[np.float32]) -> bool:
        """Go on from other coefficients of the scene's field, unless the present grid is coarser."""
        if self._level == 0:
            self.adopt(np.asarray(values, np.float64))
        return self._level == 0

    def restore(self, state: State) -> None:
        super().restore(state)
        self._filters = filters(self._values.shape, self.options.smoothness)

    def _accept(self, values: F64) -> None:
        """Take the new coefficients over. A step by which the surface would vanish is not made."""
        values = self._within(values)
        if not _has_surface(values):
            return
        if self._count % self.options.redistance_every == 0:
            values = distance_coefficients(values, self._spacing)
        self._values = values

    def _within(self, values: F64) -> F64:
        """The coefficients, with a surface that stays in the box if it began there."""
        if not self._enclosed:
            return values
        return np.where(_shell(values), np.maximum(values, _BORDER * float(self._spacing.min())), values)

    def _regulariser(self) -> F64:
        total = np.zeros_like(self._values)
        for weight, function in ((self.options.laplacian, laplacian_of), (self.options.eikonal, eikonal_of)):
            if weight:
                total += weight * function(self._values, self._spacing)[1]
        return total

    def _refine(self) -> None:
        self._values = spline.refined(self._values)
        self._spacing = 0.5 * self._spacing
        self._level -= 1
        self._optimiser = AdamUniform(1.0, beta2=BETA2)
        self._filters = filters(self._values.shape, self.options.smoothness)


def _levels(field: Field, coarser: int | None, path: str) -> int:
    """Number of coarser grids, after a check that the field has them."""
    if coarser is None:
        return _harmless_levels(field)
    cells = field.cells
    if np.any(cells % 2**coarser) or (coarser and np.any(cells >> coarser < LEAST_CELLS)):
        raise ValueError(f"fit: the field of '{path}' has {cells[0]} x {cells[1]} x {cells[2]} cells, which cannot be "
                         f"made coarser {coarser} times with {LEAST_CELLS} cells left along each axis; lower coarser "
                         "of FieldSteps, or resample the field")
    return coarser


def _harmless_levels(field: Field) -> int:
    """Number of coarser grids that have the surface of the field almost as it is."""
    spacing = field.spacing
    values = distance_coefficients(np.asarray(field.values, np.float64), spacing)
    nodes = spline.node_values(values)
    near = np.abs(nodes) < 2.0 * float(spacing.max())
    for level in range(MOST_COARSER):
        if np.any(field.cells % 2 ** (level + 1)) or np.any(field.cells >> (level + 1) < HARMLESS_CELLS):
            return level
        coarse = spline.coefficients(nodes[tuple(slice(None, None, 2 ** (level + 1)) for _ in range(3))])
        for _ in range(level + 1):
            coarse = spline.refined(coarse)
        if np.abs(spline.node_values(coarse) - nodes)[near].max(initial=0.0) > HARMLESS * float(spacing.min()):
            return level
    return MOST_COARSER


def _has_surface(values: F64) -> bool:
    """Whether the spline has both signs at the nodes of its grid."""
    inside = spline.node_values(values) < 0.0
    return bool(inside.any() and not inside.all())


def _shell(values: F64) -> NDArray[np.bool_]:
    """Select the outermost three coefficients on all sides, which decide about the values on the box."""
    shell = np.ones(values.shape, bool)
    shell[3:-3, 3:-3, 3:-3] = False
    return shell

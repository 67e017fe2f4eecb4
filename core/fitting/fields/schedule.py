"""How a fit changes distance fields: the options, and when it goes on to finer grids."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from ..._check import number, whole
from ..._fields import Check, CheckedAtOnce, by, optional

# The coarser grids of a fit together take this fraction of its iterations.
COARSE_PART = 0.5
# Most coarser grids with which a fit begins by itself.
MOST_COARSER = 2


@dataclass
class FieldSteps(CheckedAtOnce):
    """How a fit changes the coefficients and the attributes of distance fields.

    Attributes
    ----------
    coarser
        Number of coarser grids with which the fit begins, each with cells twice as large as the next. The field keeps
        its own grid, on which every spline of a coarser grid is represented exactly. The coarser grids together take
        the first half of the iterations. Coarser grids find large changes in fewer iterations, without pits and crumbs;
        details of the start that they do not represent are lost. Grids of attributes are made coarser as often.
        None: up to 2, as long as the grid has the start within a tenth of a cell, and at least 16 cells along each
        axis; of attributes as long as it has their start, and at least 8 cells.
    redistance_every
        After how many steps the field is made a distance again (`distance_fields.redistanced`).
    smoothness
        lambda of the filter (1 + lambda L)^-2 of gradients along each axis, L the second difference: a change at the
        surface spreads over about sqrt(lambda) cells, of attributes as well. 0: no filter.
    topology_every
        After how many turns through all pictures a fit tries to carve holes and to add parts (`proposals`); 0:
        never. A change is kept only if it lowers the loss. A try renders each picture at least four times.
    laplacian, eikonal
        Weights of `distance_fields.laplacian` and `distance_fields.eikonal`, in units of the loss. The gradient of a
        step includes them; the reported losses do not.
    most_memory
        Bytes that the variables of one field may need.
    """

    coarser: int | None = None
    redistance_every: int = 5
    smoothness: float = 1.0
    topology_every: int = 5
    laplacian: float = 0.0
    eikonal: float = 0.0
    most_memory: float = 4e9

    checks: ClassVar[Mapping[str, Check]] = {
        "coarser": optional(by(whole, 0, 8)),
        "redistance_every": by(whole, 1, 1_000_000),
        "smoothness": by(number, least=0.0, greatest=1e6),
        "topology_every": by(whole, 0, 1_000_000),
        "laplacian": by(number, least=0.0),
        "eikonal": by(number, least=0.0),
        "most_memory": by(number, above=0.0),
    }


def refinements(coarser: int, iterations: int) -> list[int]:
    """Numbers of steps after which a variable that begins on coarser grids goes on to the next grid."""
    return [round(iterations * COARSE_PART * (k + 1) / coarser) for k in range(coarser)]

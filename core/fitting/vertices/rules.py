"""What the vertices of a mesh may do in a fit: weights, locked axes, symmetry.

The rules are one linear map C of moves: it weights each vertex, removes locked coordinates, and averages each move with
the mirrored move of its partner. If d is a step without rules, then C d is one with them. A gradient g is replaced by
C^T g first, so that a step C A C^T g goes downhill for every positive definite A.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..._check import array, choice, flag, instance, mapping
from ..._fields import Check, Checked, by, optional
from ...geometry import topology
from .mirror import partners

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
AXES = ("x", "y", "z")


def _locked(where: str, name: str, value: Any) -> tuple[bool, ...]:
    if not isinstance(value, (tuple, list)) or len(value) != 3:
        raise ValueError(f"{where}: {name} must be three truth values, of x, y and z")
    out = tuple(flag(where, name, one) for one in value)
    if all(out):
        raise ValueError(f"{where}: x, y and z are locked, so no vertex may move; unlock one")
    return out


@dataclass(frozen=True)
class VertexRules(Checked):
    """Rules for the vertices of one mesh.

    Attributes
    ----------
    weights
        (n,) factors in [0, 1] of the moves of the vertices: 0 keeps a vertex. None: all are 1.
    locked
        Whether the coordinates x, y and z keep their values.
    symmetry
        "x", "y" or "z": the shape is mirrored across the plane through the origin that this axis is normal to. A start
        that is not is replaced by one of its sides and the mirror image of this side, or by the mean of both sides:
        whichever has the smallest loss. None: sides are independent.
    frame
        (4, 4) affine transform from the space of these axes to that of the vertices.
    partners
        (n,) vertex on the other side of each; the vertex itself on the plane. None: they are found by their places.
    """

    weights: F64 | None = None
    locked: tuple[bool, bool, bool] = (False, False, False)
    symmetry: str | None = None
    frame: F64 = field(default_factory=lambda: np.eye(4))
    partners: I64 | None = None

    checks: ClassVar[Mapping[str, Check]] = {
        "weights": optional(by(array, (None,), np.float64)),
        "locked": _locked,
        "symmetry": optional(by(choice, AXES)),
        "frame": by(array, (4, 4), np.float64),
        "partners": optional(by(array, (None,), np.int64)),
    }


def checked_rules(paths: Sequence[str], rules: Mapping[str, VertexRules] | None) -> Mapping[str, VertexRules]:
    """Return the rules of a fit by parameter; each must belong to vertices among `paths`."""
    for path, one in mapping("fit", "vertex_rules", {} if rules is None else rules).items():
        if path not in paths or not path.endswith(".vertices"):
            raise ValueError(f"fit: vertex_rules names '{path}', which is not among the vertices in wrt")
        instance("fit", f"rules of '{path}'", one, VertexRules)
    return {} if rules is None else rules


class Constraint:
    """The rules of one mesh as a linear map of its vertices' moves.

    Parameters
    ----------
    path
        Of the parameter, for messages.
    rules, vertices
        The rules, and (n, 3) positions.

    Attributes
    ----------
    partner
        (n,) partners; None: there is no symmetry.

    Raises
    ------
    ValueError
        For rules that do not fit the mesh; names the parameter.
    """

    def __init__(self, path: str, rules: VertexRules, vertices: F64) -> None:
        where, count = f"rules of '{path}'", len(vertices)
        label = topology.weld(vertices)
        rules.check_fields(where)
        frame = rules.frame
        if abs(np.linalg.det(frame[:3, :3])) < 1e-30:
            raise ValueError(f"{where}: frame has no inverse; its axes must not be scaled to zero")
        self._frame, self._inverse = frame, np.linalg.inv(frame)
        self._vertices = vertices
        self._axes = self._of_locked(rules.locked)
        self.partner: I64 | None = None
        if rules.symmetry is not None:
            axis = AXES.index(rules.symmetry)
            self.partner = self._partners(where, vertices, label, axis, rules.partners)
            self._mirror = self._in_frame(np.where(np.arange(3) == axis, -1.0, 1.0))
            self._offset = frame[:3, 3] - self._mirror @ frame[:3, 3]
            self._axis = axis
        self._weights: F64 | None = None
        if rules.weights is not None:
            weights = array(where, "weights", rules.weights, (count,), np.float64)
            if (weights < 0.0).any() or (weights > 1.0).any():
                raise ValueError(f"{where}: weights must be in [0, 1]")
            if not weights.any():
                raise ValueError(f"{where}: all weights are 0, so no vertex may move; leave the parameter out")
            # Copies of a welded vertex move together, and so do partners
            mean = np.bincount(label, weights) / np.bincount(label)
            weights = mean[label]
            self._weights = weights if self.partner is None else 0.5 * (weights + weights[self.partner])

    def _of_locked(self, locked: tuple[bool, bool, bool]) -> F64 | None:
        """The matrix that removes the locked coordinates of a move; None: none is locked."""
        return self._in_frame(np.where(locked, 0.0, 1.0)) if any(locked) else None

    def _in_frame(self, factors: F64) -> F64:
        """The matrix that scales the coordinates of the frame."""
        return np.asarray(self._frame[:3, :3] @ (factors[:, None] * self._inverse[:3, :3]))

    def _partners(self, where: str, vertices: F64, label: I64, axis: int, given: I64 | None) -> I64:
        first = topology.first_of_labels(label)
        if given is None:
            points = vertices[first] @ self._inverse[:3, :3].T + self._inverse[:3, 3]
            welded = partners(points, axis)
        else:
            one = array(where, "partners", given, (len(vertices),), np.int64)
            if (one >= len(vertices)).any():
                raise ValueError(f"{where}: partners names a vertex that is not there")
            one = one[first]
            welded = np.where(one >= 0, label[one], -1)
            welded = np.where((welded >= 0) & (welded[welded] == np.arange(len(first))), welded, -1)
        alone = np.flatnonzero(welded[label] < 0)
        if len(alone):
            raise ValueError(f"{where}: {len(alone)} of {len(vertices)} vertices, such as {alone[0]}, have no partner "
                             f"across {AXES[axis]}; make the mesh symmetric, or switch its symmetry off")
        return np.asarray(first[welded[label]])

    def push(self, moves: F64) -> F64:
        """Return the (n, 3) moves C d that the rules allow of moves d."""
        if self._axes is not None:
            moves = moves @ self._axes.T
        if self.partner is not None:
            moves = 0.5 * (moves + moves[self.partner] @ self._mirror.T)
        return moves if self._weights is None else self._weights[:, None] * moves

    def pull(self, gradient: F64) -> F64:
        """Return C^T g of the (n, 3) gradient g by the moves."""
        if self._weights is not None:
            gradient = self._weights[:, None] * gradient
        if self.partner is not None:
            gradient = 0.5 * (gradient + (gradient @ self._mirror)[self.partner])
        return gradient if self._axes is None else gradient @ self._axes

    def starts(self) -> list[F64]:
        """Return the shapes with which a fit may start.

        Without symmetry, or if the vertices obey it, these alone; otherwise the mean of the vertices and their mirror
        image, then each side with its own mirror image.
        """
        vertices = self._vertices
        if self.partner is None:
            return [vertices]
        image = vertices[self.partner] @ self._mirror.T + self._offset
        mean = 0.5 * (vertices + image)
        extent = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        if np.abs(mean - vertices).max() <= 1e-9 * extent:
            return [vertices]
        along = vertices @ self._inverse[self._axis, :3]
        side = np.sign(along - along[self.partner])[:, None]  # 0 on the plane
        return [mean, *(np.where(side == 0.0, mean, np.where(side == kept, vertices, image)) for kept in (1.0, -1.0))]

"""Topological steps of a fit: holes are opened and parts are added where the pictures ask for it.

Every few turns through the pictures, `proposals` proposes another field. The scene with this field is rendered
from all views. The proposal is taken over only if the loss falls, in two renders with independent random numbers that
are the same before and after.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ...scene import parameters
from ...scene.field import Field
from ...scene.scene import Scene
from ..losses import Loss
from ..targets import View
from .proposals import Evidence, added, carved, evidence, parts
from .variables import Coefficients

F64 = NDArray[np.float64]
Pictures = list[list[NDArray[np.float32]]]  # two of each view
# Render a view with one of the two sets of random numbers; the last argument says whether cameras do not see the field.
Render = Callable[[int, int, bool], NDArray[np.float32]]
# Take over the scene's parameters with these paths; None: all changes of the scene.
Update = Callable[[list[str] | None], None]

# A proposal must lower the loss by at least this part of it.
LEAST_FALL = 0.01
# Carved matter has thin remains, which no view sees past. After a change, everything is removed that is thinner than
# twice one of these numbers of cells: the first that costs at most a part of the fall of the loss.
OPENINGS, SIMPLER = (1.5, 1.25, 1.0, 0.75), 0.1
# Part of a fit after which the topology stays, so that the last steps of the surface can settle.
LAST_PART = 0.75


def topology_is_due(turns: int, k: int, full_turn: int, iterations: int) -> bool:
    """Whether a topological step follows the iteration k, counted from 0."""
    every = turns * full_turn
    return bool(every and (k + 1) % every == 0 and k + 1 <= LAST_PART * iterations)


class TopologicalStep:
    """A try to change the topology of one variable. The scene and the renderer always have the kept field."""

    def __init__(
        self, item: Coefficients, scene: Scene, update: Update, views: Sequence[View], loss: Loss, render: Render
    ) -> None:
        self.item, self.scene, self.update = item, scene, update
        self.views, self.loss, self.render = views, loss, render
        self.field: Field = parameters.owner(scene, item.path)[0]
        self.losses = np.zeros(2)

    def take(self) -> bool:
        """Change holes and parts, where that lowers the loss; return whether anything has changed."""
        if "camera" not in self.field.visible_to:
            return False
        shown = self._pictures()
        self.losses = self._losses(shown)
        before = self.losses
        hidden = self._pictures_without()
        found = [evidence(v.camera, v.image, v.mask, a, b) for v, a, b in zip(self.views, shown, hidden, strict=True)]
        changed = any(self._is_kept(values, LEAST_FALL) for values in _proposals(self.item, self.field, found))
        if changed:
            allowed = SIMPLER * (before - self.losses) / self.losses
            for cells in OPENINGS:
                opened = self.item.opened(cells)
                if opened is not None and self._is_kept(opened, -float(allowed.min())):
                    break
        return self.simplify() or changed

    def simplify(self) -> bool:
        """Remove parts and fill cavities that the pictures do not need; return whether anything has changed."""
        if not self.losses.any():
            self.losses = self._losses(self._pictures())
        changed = False
        for change, sign in ((self.item.coefficients_without, 1.0), (self.item.coefficients_filled, -1.0)):
            label = parts(sign * self.item.nodes() < 0.0)
            # From small to large; the largest part stays, and so does what surrounds everything.
            changed |= self._simpler(change, label, np.argsort(np.bincount(label[label >= 0]), kind="stable")[:-1])
        return changed

    def _simpler(
        self, change: Callable[[NDArray[np.bool_]], F64], label: NDArray[np.int64], numbers: NDArray[np.int64]
    ) -> bool:
        """Change these parts together or, if the pictures need them, those of each half of them."""
        if not len(numbers):
            return False
        if self._is_kept(change(np.isin(label, numbers)), -LEAST_FALL):
            return True
        middle = len(numbers) // 2
        changed = False
        for half in [numbers[:middle], numbers[middle:]] if middle else []:
            changed |= self._simpler(change, label, half)
        return changed

    def _is_kept(self, values: F64, fall: float) -> bool:
        """Render a proposal, and keep it if both losses fall by more than a part of them."""
        before = parameters.get(self.scene, self.item.path)
        parameters.put(self.scene, self.item.path, self.item.scene_values(values))
        self.update([self.item.path])
        losses = self._losses(self._pictures())
        if np.all(losses < (1.0 - fall) * self.losses):
            self.losses = losses
            self.item.adopt(values)
            return True
        parameters.put(self.scene, self.item.path, before)
        self.update([self.item.path])
        return False

    def _pictures(self, without: bool = False) -> Pictures:
        return [[self.render(j, twin, without) for twin in range(2)] for j in range(len(self.views))]

    def _pictures_without(self) -> Pictures:
        """Pictures in which cameras do not see the field. It still throws shadows and is seen in mirrors."""
        kinds = self.field.visible_to
        try:
            self.field.visible_to = kinds - {"camera"}
            self.update(None)
            return self._pictures(without=True)
        finally:
            self.field.visible_to = kinds
            self.update(None)

    def _losses(self, pictures: Pictures) -> F64:
        """(2,) losses of the two sets of pictures."""
        return np.array([
            sum(view.weight * self.loss(picture[twin], view.image, view.mask)[0]
                for view, picture in zip(self.views, pictures, strict=True))
            for twin in range(2)
        ])  # fmt: skip


def _proposals(item: Coefficients, field: Field, views: Sequence[Evidence]) -> Iterator[F64]:
    """Coefficients of other fields: with all changes, with one kind of them, and carved as each view asks for alone."""
    nodes = item.nodes()
    points = item.node_places(field)
    scale = float(np.cbrt(np.abs(np.linalg.det(field.transform[:3, :3]))))
    values = nodes.ravel()
    carving = carved(values, points, scale, views)
    proposed = [added(carving, points, scale, views), carving, added(values, points, scale, views)]
    proposed += [carved(values, points, scale, [view]) for view in views]
    tried = {(values < 0.0).tobytes()}
    for one in proposed:
        signs = (one < 0.0).tobytes()
        if signs not in tried:
            tried.add(signs)
            changed = item.coefficients_of(one.reshape(nodes.shape))
            if changed is not None:
                yield changed

"""Adaptive sampling over successive gradients of a renderer.

The gradients of a fit change little from one iteration to the next, so each can improve the sampling of the next ones.
The native engine records the contribution of samples along edges (native/boundary/curves/learned_weights.h) and uses it
as the sampling density of the next gradient. `Budget` distributes the samples to the terms. Each view keeps its own
state, since other cameras see other edges.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..derivatives.table_derivatives import shapes
from ..scene.camera import Camera
from ..tables.tables import Tables, camera_fields
from .budget import Budget
from .options import RenderOptions

Gradient = dict[str, NDArray[np.float64]]
# estimate(terms, seed, part, parts) -> the sum of some terms of the gradient.
Estimate = Callable[..., Gradient]


class LearnedView:
    """Adaptive sampling of the gradients of one view.

    Attributes
    ----------
    sampling
        The native engine's state.
    """

    def __init__(self, sampling: Any) -> None:
        self.sampling = sampling
        self._budget = Budget()
        self._gradients = 0
        self._empty: set[str] = set()  # terms that took no samples

    def gradient(self, estimate: Estimate, terms: Collection[str], seed: int) -> Gradient:
        """Compute one more gradient, and adapt the sampling of the next ones.

        Parameters
        ----------
        estimate
            ``estimate(terms, seed, part, parts)`` returns the sum of some terms, sampled by `sampling`. The call is
            number `part` of `parts` calls, which the progress function needs.
        terms
            Terms to compute.
        seed
            Seed of the samples.
        """
        self._gradients += 1
        self.sampling.share = self._budget.shares()  # a cancelled measurement may have left other numbers
        if not self._budget.is_due(self._gradients) or len(terms) < 2:
            found = estimate(terms, seed, 0, 1)
            if self._gradients == 1:
                self._budget.begin(self.sampling.taken)
                self._empty = {term for term in terms if not self._budget.taken(term, self.sampling.taken)}
            return found
        terms = [term for term in terms if term not in self._empty]
        # Estimate each term as the mean of two estimates from half its samples. Their difference measures the noise.
        total: Gradient = {}
        for k, term in enumerate(terms):
            halves, taken = [], []
            for half in range(2):
                self.sampling.share = [0.5 * share for share in self._budget.shares()]
                halves.append(estimate((term,), (seed + half * 0x9E3779B9) & 0xFFFFFFFF, 2 * k + half, 2 * len(terms)))
                taken.append(self._budget.taken(term, self.sampling.taken))
            self._budget.note(term, halves, taken)
            for path, value in halves[0].items():
                total[path] = total.get(path, 0.0) + 0.5 * (value + halves[1][path])
        self._budget.divide()
        self.sampling.share = self._budget.shares()
        return total

    def state(self) -> dict[str, Any]:
        """Return everything that was learned."""
        return {"sampling": self.sampling.state(), "budget": self._budget.state(), "gradients": self._gradients,
                "empty": sorted(self._empty)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `state` has returned."""
        self.sampling.restore(state["sampling"])
        self._budget.restore(state["budget"])
        self._gradients, self._empty = state["gradients"], set(state["empty"])


class Learning:
    """Adaptive sampling of all views of a renderer.

    Parameters
    ----------
    sampling
        Makes the native engine's state of a view.
    """

    def __init__(self, sampling: Callable[[], Any]) -> None:
        self._sampling = sampling
        self._views: dict[Any, LearnedView] = {}
        self._form: Any = None
        self._restored: dict[str, LearnedView] = {}  # views that were not asked for yet

    def state(self) -> dict[str, Any]:
        """Return the states of all views, by digests of what tells them apart."""
        known = {_digest(key): view for key, view in self._views.items()}
        return {name: view.state() for name, view in (self._restored | known).items()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `state` has returned, for the views of gradients to come."""
        self._views, self._restored = {}, {}
        for name, of_view in state.items():
            self._restored[name] = LearnedView(self._sampling())
            self._restored[name].restore(of_view)

    def view(
        self, tables: Tables, camera: Camera | None, wrt: Collection[str], options: RenderOptions
    ) -> LearnedView:
        """Return the state for the gradients of a view with respect to `wrt`, computed with `options`.

        All states are dropped if the number of vertices, faces, lights or pixels changes. `camera` None is the scene's
        own camera, whose pose may change without a loss of the state.
        """
        form = (shapes(tables), len(tables.faces))
        if form != self._form:
            self._form, self._views = form, {}
        pose = None
        if camera is not None:
            pose = tuple(np.asarray(value).tobytes() for value in camera_fields(camera, tables.origin).values())
        requested = replace(options, seed=0)
        key = (tables.width, tables.height, pose, tuple(wrt), requested)
        if key not in self._views:
            restored = self._restored.pop(_digest(key), None)
            self._views[key] = LearnedView(self._sampling()) if restored is None else restored
        return self._views[key]


def _digest(key: Any) -> str:
    return hashlib.sha256(repr(key).encode()).hexdigest()

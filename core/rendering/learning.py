"""What a renderer learns from gradients for the next ones: where samples are worth their while, and of which term.

The native engine keeps the contribution of samples along edges (native/boundary/curves/learned_weights.h) and
distributes the next gradient's samples by it. The split between the terms is `Budget`. Both are kept per view, since
other cameras see other edges.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..derivatives.table_derivatives import shapes
from ..scene.camera import Camera
from ..tables.tables import Tables, camera_fields
from .budget import Budget

Gradient = dict[str, NDArray[np.float64]]
# The gradient by some terms alone, with the given samples per pixel and seed.
Estimate = Callable[..., Gradient]


class LearnedView:
    """What gradients of one view have learned.

    Attributes
    ----------
    sampling
        The native engine's part.
    """

    def __init__(self, sampling: Any) -> None:
        self.sampling = sampling
        self._budget = Budget()
        self._gradients = 0
        self._empty: set[str] = set()  # terms that took no samples

    def gradient(self, estimate: Estimate, terms: Collection[str], seed: int) -> Gradient:
        """One more gradient.

        Parameters
        ----------
        estimate
            ``estimate(terms, seed, part, parts)`` computes the sum of some terms by `sampling`, as one part of
            several (for the progress).
        terms
            What to compute.
        seed
            Of the samples.
        """
        self._gradients += 1
        self.sampling.share = self._budget.shares()  # a cancelled measurement left others
        if not self._budget.is_due(self._gradients) or len(terms) < 2:
            found = estimate(terms, seed, 0, 1)
            if self._gradients == 1:
                self._budget.begin(self.sampling.taken)
                self._empty = {term for term in terms if not self._budget.taken(term, self.sampling.taken)}
            return found
        terms = [term for term in terms if term not in self._empty]
        # Each term as the mean of two estimates of half its samples, whose difference is its noise.
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


class Learning:
    """The views of a renderer that learns.

    Parameters
    ----------
    sampling
        Makes the native engine's part for one more view.
    """

    def __init__(self, sampling: Callable[[], Any]) -> None:
        self._sampling = sampling
        self._views: dict[Any, LearnedView] = {}
        self._form: Any = None

    def view(
        self, tables: Tables, camera: Camera | None, wrt: Collection[str], options: Mapping[str, Any]
    ) -> LearnedView:
        """What is known of a view's derivatives with respect to some parameters, as they are asked for.

        All is forgotten if the numbers of vertices, lights or pixels change. `camera`: None is the scene's own, which
        may move.
        """
        form = (shapes(tables), len(tables.faces))
        if form != self._form:
            self._form, self._views = form, {}
        pose = None
        if camera is not None:
            pose = tuple(np.asarray(value).tobytes() for value in camera_fields(camera, tables.origin).values())
        asked = tuple(options[name] for name in ("spp", "max_depth", "bounces", "terms"))
        key = (tables.width, tables.height, pose, tuple(wrt), asked)
        if key not in self._views:
            self._views[key] = LearnedView(self._sampling())
        return self._views[key]

"""Allocation of the time of a gradient to the terms of the derivative.

The terms (interior and boundary integrals) are independent estimates, and their sum is the gradient. If a fit computes
many similar gradients, some of them also measure the variance of each term. The next gradients draw more samples for
terms with a large variance. `Budget` has the formula.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .options import TERMS

# Relative cost of a sample of each term: the mean over the reference cases, in microseconds. Constants, since measured
# times would make results differ from call to call. A cost that is too high takes samples from its term.
COST = {"interior": 0.22, "primary": 0.4, "shadow": 0.2, "indirect": 0.5}
# Smallest and largest number of samples of a term, relative to its default number. A wide range adapts better to the
# measured variances; a narrow one is safer if the next iterations change them.
LEAST, MOST = 0.125, 4.0
# Weight of the older measurements of a variance relative to a new one, in [0, 1). A larger weight averages out noise,
# but follows changes of the scene more slowly.
KEPT = 0.5
# Numbers of the first gradients that measure variances, then the interval. Gradient 1 does not measure, since the
# importance of edges is not learned yet. Rare measurements cost less, but follow changes of the scene more slowly.
FIRST, EVERY = (2, 4, 8), 16


class Budget:
    """Numbers of samples of the terms of one view's gradients.

    Let term t have the cost c_t per sample and the variance v_t / n_t for n_t samples. For a fixed total time, the
    variance of the sum of all terms is smallest if n_t is proportional to sqrt(v_t / c_t) (Neyman 1934). The total time
    is that of the first gradient.
    """

    def __init__(self) -> None:
        self._share = dict.fromkeys(TERMS, 1.0)
        self._samples: dict[str, float] = {}  # default number of samples of each term
        self._time = 0.0  # of the first gradient, which uses the default numbers of samples
        self._new: dict[str, dict[str, float]] = {}  # by term and path: variance per sample, not yet used
        self._variance: dict[str, float] = {}  # by term: variance per sample relative to the variance of all terms

    def is_due(self, gradient: int) -> bool:
        """Whether a gradient, counted from 1, measures the variances of its terms."""
        return gradient in FIRST or gradient % EVERY == 0

    def shares(self) -> list[float]:
        """Number of samples of each of `TERMS`, relative to its default number."""
        return [self._share[term] for term in TERMS]

    def begin(self, samples: Sequence[float]) -> None:
        """Set the time of each gradient to the time that these samples of all terms take."""
        self._time = sum(COST[term] * self.taken(term, samples) for term in TERMS)

    def taken(self, term: str, samples: Sequence[float]) -> float:
        """Return the number of samples of one term, from the numbers of all terms."""
        return float(samples[TERMS.index(term)])

    def note(self, term: str, halves: Sequence[Mapping[str, NDArray[np.float64]]], taken: Sequence[float]) -> None:
        """Measure the variance of a term from two independent estimates.

        Parameters
        ----------
        halves
            Two gradients, each from half the samples.
        taken
            Number of samples of each.
        """
        if min(taken) <= 0.0:
            return
        self._samples[term] = taken[1] / (0.5 * self._share[term])
        inverse = 1.0 / taken[0] + 1.0 / taken[1]
        self._new[term] = {
            path: float(np.sum((value - halves[1][path]) ** 2)) / inverse for path, value in halves[0].items()
        }

    def divide(self) -> None:
        """Distribute the time to the terms by the noted variances."""
        paths = {path for variances in self._new.values() for path in variances}
        # Parameters have different units, so the variance of each is relative to its total over all terms.
        scale = {path: sum(v[path] / self._samples[t] for t, v in self._new.items()) for path in paths}
        for term, variances in self._new.items():
            new = sum(v / scale[path] for path, v in variances.items() if scale[path] > 0.0)
            self._variance[term] = KEPT * self._variance[term] + (1.0 - KEPT) * new if term in self._variance else new
        self._new = {}
        if not any(self._variance.values()):
            return
        terms = [term for term in TERMS if term in self._variance]
        share = self._divided(self._time, terms)
        if "interior" in terms:
            # The pixel sampler is well stratified for powers of two only. Of the powers below and above, choose the
            # one that leaves less variance in total. The nearer one may take too much time from the other terms.
            best = math.log2(share["interior"])
            share = min((self._with_interior(2.0**power, terms) for power in {math.floor(best), math.ceil(best)}),
                        key=self._left)
        self._share |= share

    def _with_interior(self, interior: float, terms: list[str]) -> dict[str, float]:
        """Return the best numbers of samples of all terms for a given number of the interior term."""
        left = self._time - COST["interior"] * self._samples["interior"] * interior
        return {"interior": interior} | self._divided(left, [term for term in terms if term != "interior"])

    def _left(self, share: Mapping[str, float]) -> float:
        """Return the variance of the sum of the terms for these numbers of samples."""
        return sum(self._variance[t] / (self._samples[t] * share[t]) for t in share)

    def _divided(self, time: float, terms: list[str]) -> dict[str, float]:
        """Return the best relative numbers of samples of some terms for a given time."""
        # Lists have an order, in which sums have the same bits in each process; sets have none.
        share: dict[str, float] = {}
        while terms:
            # Terms whose optimum lies outside [LEAST, MOST] get the bound; the others share the remaining time again.
            rate = {t: math.sqrt(self._variance[t] / COST[t]) for t in terms}
            whole = sum(COST[t] * rate[t] for t in terms)
            for t in terms:
                share[t] = max(time, 0.0) * rate[t] / (whole * self._samples[t]) if whole > 0.0 else LEAST
            beyond = [t for t in terms if share[t] < LEAST] or [t for t in terms if share[t] > MOST]
            for t in beyond:
                share[t] = min(max(share[t], LEAST), MOST)
                time -= COST[t] * self._samples[t] * share[t]
            if not beyond:
                break
            terms = [t for t in terms if t not in beyond]
        return share

    def state(self) -> dict[str, Any]:
        """Return what the measurements so far have changed."""
        return {"share": self._share, "samples": self._samples, "time": self._time, "variance": self._variance}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `state` has returned."""
        self._share, self._samples, self._time, self._variance = (
            state[name] for name in ("share", "samples", "time", "variance"))

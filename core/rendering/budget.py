"""How a gradient's time is divided among the terms of the derivative."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

TERMS = ("interior", "primary", "shadow", "indirect")
# Microseconds that a sample takes in the mean of the reference cases (path segments beyond the first cost as much
# again for what is seen). Clocks differ from call to call, and results must not.
COST = {"interior": 0.22, "primary": 0.4, "shadow": 0.2, "indirect": 0.5}
# A term's samples are this many times those of its fixed share, at least and at most: what looks worthless now may
# not be so in the next iteration.
LEAST, MOST = 0.125, 4.0
# What an older measurement of a term's variance counts for beside a new one.
KEPT = 0.5
# Gradients that measure (from 1 on; the first one's samples don't know yet where to be), then every so many.
FIRST, EVERY = (2, 4, 8), 16


class Budget:
    """Samples of the terms of one view's gradients.

    The variance of a sum of terms that cost c_t per sample and have the variance v_t / n_t is least, for the same
    time, if n_t is in proportion to sqrt(v_t / c_t) (Neyman 1934). The time is that of the first gradient.
    """

    def __init__(self) -> None:
        self._share = dict.fromkeys(TERMS, 1.0)
        self._samples: dict[str, float] = {}  # of the fixed share
        self._time = 0.0  # of the first gradient, whose shares are the fixed ones
        self._new: dict[str, dict[str, float]] = {}  # a term's variance per sample, by path
        self._variance: dict[str, float] = {}  # relative to that of all terms

    def is_due(self, gradient: int) -> bool:
        """Whether a gradient (from 1 on) measures its terms' variances."""
        return gradient in FIRST or gradient % EVERY == 0

    def shares(self) -> list[float]:
        """Samples of each of `TERMS`, in terms of those of its fixed share."""
        return [self._share[term] for term in TERMS]

    def begin(self, samples: Sequence[float]) -> None:
        """Take the time of these samples of all terms as that of every gradient."""
        self._time = sum(COST[term] * self.taken(term, samples) for term in TERMS)

    def taken(self, term: str, samples: Sequence[float]) -> float:
        """A term's number of samples out of those of all."""
        return float(samples[TERMS.index(term)])

    def note(self, term: str, halves: Sequence[Mapping[str, NDArray[np.float64]]], taken: Sequence[float]) -> None:
        """Measure a term by two estimates, each of half its samples, of which so many were `taken`."""
        if min(taken) <= 0.0:
            return
        self._samples[term] = taken[1] / (0.5 * self._share[term])
        inverse = 1.0 / taken[0] + 1.0 / taken[1]
        self._new[term] = {
            path: float(np.sum((value - halves[1][path]) ** 2)) / inverse for path, value in halves[0].items()
        }

    def divide(self) -> None:
        """Divide the time among the terms that were noted."""
        paths = {path for variances in self._new.values() for path in variances}
        # Parameters have different units: each counts relative to its own variance.
        scale = {path: sum(v[path] / self._samples[t] for t, v in self._new.items()) for path in paths}
        for term, variances in self._new.items():
            new = sum(v / scale[path] for path, v in variances.items() if scale[path] > 0.0)
            self._variance[term] = KEPT * self._variance[term] + (1.0 - KEPT) * new if term in self._variance else new
        self._new = {}
        if not any(self._variance.values()):
            return
        terms = set(self._variance)
        share = self._divided(self._time, terms)
        if "interior" in terms:
            # Samples of pixels are even for powers of two alone: the next below or above, whichever leaves less
            # variance with what the others then get. (The nearer one left the primary term of blob_flat an eighth.)
            best = math.log2(share["interior"])
            share = min((self._with_interior(2.0**power, terms) for power in {math.floor(best), math.ceil(best)}),
                        key=self._left)
        self._share |= share

    def _with_interior(self, interior: float, terms: set[str]) -> dict[str, float]:
        """The best shares of some terms for this one of the interior."""
        left = self._time - COST["interior"] * self._samples["interior"] * interior
        return {"interior": interior} | self._divided(left, terms - {"interior"})

    def _left(self, share: Mapping[str, float]) -> float:
        """The variance that these shares leave."""
        return sum(self._variance[t] / (self._samples[t] * share[t]) for t in share)

    def _divided(self, time: float, terms: set[str]) -> dict[str, float]:
        """The best shares of some terms."""
        share: dict[str, float] = {}
        terms = set(terms)
        while terms:
            # So many samples per time are left to all; those beyond their bounds stay there, and the others divide
            # what is left.
            rate = {t: math.sqrt(self._variance[t] / COST[t]) for t in terms}
            whole = sum(COST[t] * rate[t] for t in terms)
            for t in terms:
                share[t] = max(time, 0.0) * rate[t] / (whole * self._samples[t]) if whole > 0.0 else LEAST
            beyond = {t for t in terms if share[t] < LEAST} or {t for t in terms if share[t] > MOST}
            for t in beyond:
                share[t] = min(max(share[t], LEAST), MOST)
                time -= COST[t] * self._samples[t] * share[t]
            if not beyond:
                break
            terms -= beyond
        return share

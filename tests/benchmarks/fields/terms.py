"""Variance and seconds of a field's derivatives by term: ``python -m tests.benchmarks.fields.terms``.

The scenes are those of `tests.benchmarks.fields`. Printed are CPU seconds of the gradient by all coefficients, the
summed variance over seeds of that gradient and of the derivative picture of a shift, and the boundary terms' samples.
The best numbers of samples make the seconds of each term proportional to sqrt(variance x seconds).
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from edgegrad import TERMS, Renderer

from .__main__ import SIZE, SPP, scenes

SEEDS = 6


def variance(runs: list[NDArray[np.floating]]) -> float:
    """The variance over runs, summed over all entries."""
    return float(np.var(runs, axis=0, ddof=1, dtype=np.float64).sum())


def measure(light: str, depth: int, term: str) -> None:
    """Print the figures of one term."""
    renderer = Renderer(scenes(light, SIZE)["field"])
    shift = np.zeros((4, 4), np.float32)
    shift[0, 3] = 1.0
    values, adjoint = "fields.torus.values", np.ones((SIZE, SIZE, 3), np.float32)
    pictures = [renderer.render_forward({"fields.torus.transform": shift}, spp=SPP, max_depth=depth, seed=seed,
                                        terms=(term,)) for seed in range(SEEDS)]  # fmt: skip
    start = time.process_time()
    gradients = [renderer.render_backward(adjoint, [values], spp=SPP, max_depth=depth, seed=seed, terms=(term,))[values]
                 for seed in range(SEEDS)]  # fmt: skip
    seconds = (time.process_time() - start) / SEEDS
    samples = {decision.part: int(decision.samples) for decision in renderer.last_decisions if decision.samples}
    print(f"{light:12} depth {depth} {term:9}: {seconds:.3f} s, variance of the gradient {variance(gradients):9.3g}, "
          f"of the picture {variance(pictures):9.3g}; {samples}", flush=True)


if __name__ == "__main__":
    for light, depth in (("environment", 2), ("rectangle", 2), ("rectangle", 4)):
        for term in TERMS:
            measure(light, depth, term)

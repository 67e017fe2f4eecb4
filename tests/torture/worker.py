"""A process that examines many scenes: seeds come in, one a line, and a line of JSON goes out for each."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

from tests.torture.checks import examine
from tests.torture.compare import Outcome, compare
from tests.torture.drawing import feature_comparisons, field_comparisons, glossy_comparisons
from tests.torture.scenes import case
from tests.torture.tame import ABSENT, Comparison, comparison

# By the letter before the seed: what draws a comparison with differences, the parts that plans may name in it, and how
# many times the seeds it takes. Scenes of gloss render fast, and one surface of several must not hide in their noise.
COMPARISONS: dict[str, tuple[Callable[[int], Comparison], tuple[str, ...], int]] = {
    "d": (comparison, ABSENT, 1),
    "f": (field_comparisons.comparison, field_comparisons.ABSENT, 1),
    "g": (glossy_comparisons.comparison, glossy_comparisons.ABSENT, 4),
    "x": (feature_comparisons.comparison, feature_comparisons.ABSENT, 1),
}


def result(task: str) -> dict[str, Any]:
    """The findings of a task: a seed, of a scene to examine; after a letter of `COMPARISONS` of a comparison."""
    start, cpu = time.perf_counter(), time.process_time()
    if task[0] in COMPARISONS:
        make, absent, scale = COMPARISONS[task[0]]
        found = _compared(compare(made := make(int(task[1:])), int(task[1:]), scale, absent), made)
    else:
        found = _examined(int(task))
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    return {"task": task, "seconds": round(seconds, 4), "cpu": round(cpu, 4), **found}


def _examined(seed: int) -> dict[str, Any]:
    made = case(seed)
    found = examine(made)
    return {"kinds": made.kinds, "wrong": found.wrong, "told": found.told, "numbers": found.numbers}


def _compared(found: Outcome, made: Comparison) -> dict[str, Any]:
    words = (f"'{made.path}': derivative {found.derivative:.4g}, difference {found.difference:.4g} +- {found.error:.2g}"
             f", z of blocks {', '.join(f'{z:.1f}' for z in found.z)}")  # fmt: skip
    return {
        "shader": made.shader, "parameter": made.parameter, "path": made.path, "missing": found.missing, "z": found.z,
        "first": found.first, "rounds": found.rounds, "values": [found.derivative, found.difference, found.error],
        "wrong": {"difference": words} if found.wrong else {},
    }  # fmt: skip


def main() -> None:
    print(flush=True)  # ready: what comes before is the time that imports take
    for line in sys.stdin:
        print(json.dumps(result(line.strip())), flush=True)


if __name__ == "__main__":
    main()

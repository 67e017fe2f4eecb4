"""A process that examines many scenes: seeds come in, one a line, and a line of JSON goes out for each."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from tests.torture.checks import examine
from tests.torture.compare import compare
from tests.torture.drawing import field_comparisons
from tests.torture.scenes import case
from tests.torture.tame import ABSENT, Comparison, comparison


def result(task: str) -> dict[str, Any]:
    """The findings of a task: a seed, of a scene to examine; after "d" or "f" of a comparison with differences.

    "f" stands for scenes of fields among mirrors, glass, meshes and other fields.
    """
    start, cpu = time.perf_counter(), time.process_time()
    if task.startswith("d"):
        found = _compared(comparison(int(task[1:])), int(task[1:]))
    elif task.startswith("f"):
        found = _compared(field_comparisons.comparison(int(task[1:])), int(task[1:]), field_comparisons.ABSENT)
    else:
        found = _examined(int(task))
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    return {"task": task, "seconds": round(seconds, 4), "cpu": round(cpu, 4), **found}


def _examined(seed: int) -> dict[str, Any]:
    made = case(seed)
    found = examine(made)
    return {"kinds": made.kinds, "wrong": found.wrong, "told": found.told, "numbers": found.numbers}


def _compared(made: Comparison, seed: int, absent: tuple[str, ...] = ABSENT) -> dict[str, Any]:
    found = compare(made, seed, absent=absent)
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

"""A process that examines many scenes: seeds come in, one a line, and a line of JSON goes out for each."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from tests.torture.checks import examine
from tests.torture.compare import compare
from tests.torture.scenes import case
from tests.torture.tame import comparison


def result(task: str) -> dict[str, Any]:
    """The findings of a task: a seed, of a scene to examine; with a "d" before it, of a comparison with differences."""
    start, cpu = time.perf_counter(), time.process_time()
    found = _compared(int(task[1:])) if task.startswith("d") else _examined(int(task))
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    return {"task": task, "seconds": round(seconds, 4), "cpu": round(cpu, 4), **found}


def _examined(seed: int) -> dict[str, Any]:
    made = case(seed)
    found = examine(made)
    return {"kinds": made.kinds, "wrong": found.wrong, "told": found.told, "numbers": found.numbers}


def _compared(seed: int) -> dict[str, Any]:
    made = comparison(seed)
    found = compare(made, seed)
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

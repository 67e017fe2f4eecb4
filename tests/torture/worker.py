"""A process that examines many scenes: seeds come in, one a line, and a line of JSON goes out for each."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from tests.torture.checks import examine
from tests.torture.scenes import case


def result(task: str) -> dict[str, Any]:
    """The findings of a task, which is a seed."""
    start = time.perf_counter()
    made = case(int(task))
    found = examine(made)
    return {
        "task": task, "seconds": round(time.perf_counter() - start, 4), "kinds": made.kinds, "wrong": found.wrong,
        "told": found.told, "numbers": found.numbers,
    }  # fmt: skip


def main() -> None:
    print(flush=True)  # ready: what comes before is the time that imports take
    for line in sys.stdin:
        print(json.dumps(result(line.strip())), flush=True)


if __name__ == "__main__":
    main()

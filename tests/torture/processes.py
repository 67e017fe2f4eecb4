"""Workers as processes: one that crashes or hangs is a result, and is replaced."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import selectors
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from tests.torture.scenes import case
from tests.torture.worker import COMPARISONS

ROOT = Path(__file__).parents[2]
# Seconds that a worker may take to import what it needs.
START = 300.0
# A task hangs if it takes more than its processor time, or this many times as long by the clock: other work on the
# machine may slow it down.
WALL = 10.0


class Worker:
    """A process of `tests.torture.worker`, started when first needed and again after it has ended."""

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._process: subprocess.Popen[bytes] | None = None
        self._errors: Any = None
        self._left = b""
        self._report = ""  # what the last process has said of errors

    def ask(self, task: str) -> dict[str, Any]:
        """The result of a task; of a crash or a hang if that is what comes."""
        if self._process is None and not self._start():
            self.close()
            raise RuntimeError(f"torture: workers don't start: {self._report}")
        assert self._process is not None and self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(f"{task}\n".encode())
            self._process.stdin.flush()
        line = self._line(self._patience)
        if line:
            found: dict[str, Any] = json.loads(line)
            return found
        how = "crash" if line is not None else "hang"
        code = self.close()
        name = signal.Signals(-code).name if code < 0 else f"exit {code}"
        late = f"no result within {self._patience:g} s of processor time"
        words = f"{name}: {self._report}" if how == "crash" else late
        made: dict[str, Any]
        if task[0] in COMPARISONS:
            c = COMPARISONS[task[0]][0](int(task[1:]))
            made = {"shader": c.shader, "parameter": c.parameter, "path": c.path, "missing": [], "z": [], "first": [],
                    "rounds": 0, "values": [0.0, 0.0, 0.0]}  # fmt: skip
        else:
            made = {"kinds": case(int(task)).kinds, "told": [], "numbers": {}}
        return {"task": task, "seconds": 0.0, "cpu": 0.0, "wrong": {how: words}, **made}

    def close(self) -> int:
        """End the process, and return the code with which it has ended."""
        if self._process is None:
            return 0
        # A process that has closed its output is ending by itself: its own code says why.
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.stdin.close()  # type: ignore[union-attr]
            self._process.wait(5.0)
        self._process.kill()
        code = self._process.wait()
        self._process.stdout.close()  # type: ignore[union-attr]
        self._process = None
        self._report = self._said()
        self._errors.close()
        return code

    def _start(self) -> bool:
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115
        self._left = b""
        # A sanitizer reports faults itself, and better.
        faults = [] if "ASAN_OPTIONS" in os.environ else ["-X", "faulthandler"]
        self._process = subprocess.Popen(
            [sys.executable, *faults, "-m", "tests.torture.worker"], cwd=ROOT, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=self._errors,
        )  # fmt: skip
        return bool(self._line(START))

    def _line(self, patience: float) -> bytes | None:
        """The next line of output; empty if the process has ended, None if none comes in time."""
        assert self._process is not None and self._process.stdout is not None
        start, busy = time.monotonic(), self._seconds()
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while b"\n" not in self._left:
                if not selector.select(1.0):
                    late = time.monotonic() - start
                    if late > WALL * patience or (late > patience and self._seconds() - busy > patience):
                        return None
                    continue
                more = os.read(self._process.stdout.fileno(), 1 << 16)
                if not more:
                    return b""
                self._left += more
        line, _, self._left = self._left.partition(b"\n")
        return line + b"\n"

    def _seconds(self) -> float:
        """Processor time of the process so far; without such a count, the time since it could have begun."""
        assert self._process is not None
        try:
            words = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return time.monotonic()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def _said(self) -> str:
        """The part of the process's error output that tells most: a sanitizer's report, or where Python has been."""
        self._errors.seek(0)
        text = self._errors.read().decode(errors="replace")
        for word in ("ERROR: AddressSanitizer", "runtime error:", "most recent call first"):
            if word in text:
                return text[text.index(word) :][:3000]
        return text[-3000:]


def results(tasks: Iterable[str], workers: int, patience: float) -> Iterator[dict[str, Any]]:
    """Results of tasks as they come, in any order."""
    ahead = iter(tasks)
    lock, done, stop = threading.Lock(), queue.Queue[dict[str, Any] | BaseException | None](), threading.Event()

    def work() -> None:
        worker = Worker(patience)
        try:
            while not stop.is_set():
                with lock:
                    task = next(ahead, None)
                if task is None:
                    break
                done.put(worker.ask(task))
        except BaseException as error:
            done.put(error)
        finally:
            worker.close()
            done.put(None)

    threads = [threading.Thread(target=work, daemon=True) for _ in range(workers)]
    for thread in threads:
        thread.start()
    try:
        running = workers
        while running:
            found = done.get()
            if found is None:
                running -= 1
            elif isinstance(found, BaseException):
                raise found
            else:
                yield found
    finally:
        stop.set()
        for thread in threads:
            thread.join()

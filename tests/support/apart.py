"""Functions of tests run in a process of their own, so that a crash is a result."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any


def apart(function: Callable[..., Any], *values: Any, room: int | None = None) -> None:
    """Call a test module's function with literals; assert that it returns.

    Parameters
    ----------
    room
        Bytes of memory that the call may take beside what the process has before it (Linux); None: any.
    """
    call = f"{function.__name__}({', '.join(map(repr, values))})"
    code = f"from {function.__module__} import {function.__name__}\n"
    if room is not None:
        code += (
            "import resource\n"
            "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
            f"resource.setrlimit(resource.RLIMIT_AS, (used + {room}, resource.RLIM_INFINITY))\n"
        )
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", code + call], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{call}: exit code {done.returncode}\n{done.stderr[-2000:]}"

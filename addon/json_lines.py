"""Progress of a command as lines of JSON, for programs that start it."""

from __future__ import annotations

import contextlib
import json
import math
import sys
from typing import Any

import numpy as np


def write_line(event: str, **fields: Any) -> None:
    """Print one event to stdout; a closed pipe or a full disk must not stop the work.

    Numbers that are not finite, which JSON lacks, are null.
    """
    line = json.dumps({"event": event, **{name: _plain(value) for name, value in fields.items()}}, allow_nan=False)
    with contextlib.suppress(OSError, ValueError):
        print(line, file=sys.stdout, flush=True)


def _plain(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, (str, int, bool, type(None))) else str(value)

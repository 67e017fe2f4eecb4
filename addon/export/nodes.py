"""Walking through shader nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..problem import Report

PASSED_THROUGH = 64  # reroutes in a row, after which the walk gives up


def source(socket: Any) -> Any:
    """The socket that feeds `socket`, reroutes passed through; None if there is none."""
    for _ in range(PASSED_THROUGH):
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        if not links:
            return None
        found = links[0].from_socket
        if found.node.type != "REROUTE":
            return found
        socket = found.node.inputs[0]
    return None


def color(socket: Any, where: str, report: Report) -> NDArray[np.float64]:
    """(3,) the socket's own colour; a warning if a link feeds it."""
    _warn_if_linked(socket, where, report)
    return np.array(socket.default_value[:3], np.float64)


def number(socket: Any, where: str, report: Report) -> float:
    """The socket's own number; a warning if a link feeds it."""
    _warn_if_linked(socket, where, report)
    return float(socket.default_value)


def _warn_if_linked(socket: Any, where: str, report: Report) -> None:
    fed_by = source(socket)
    if fed_by is not None:
        report.warn(where, f"input '{socket.name}' is fed by node '{fed_by.node.name}', which can't be read; "
                           "the value of the socket itself is used")  # fmt: skip

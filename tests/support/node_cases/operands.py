"""The cases of nodes, and their operands."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from edgegrad import expression as e

if TYPE_CHECKING:
    from tests.support.node_cases.blender_nodes import Nodes

# Name to (what builds the node and returns its socket, the expression).
Cases = dict[str, tuple[Callable[["Nodes"], Any], e.Expression]]

P, Q = e.Attribute("P"), e.Attribute("Q")
PX, PY, PZ, QX, QY, QZ = (e.Channel(v, k) for v in (P, Q) for k in range(3))

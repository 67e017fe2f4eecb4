"""The start of vertices that shall be symmetric and are not: the one of several symmetric shapes that fits best.

Nobody but the pictures can say which side of such a shape is right. The mean of both sides is wrong on both if one of
them is right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


@runtime_checkable
class Starting(Protocol):
    """A variable that may start with one of several values."""

    starts: list[F64]

    def begin(self, start: F64) -> None:
        """Start at one of `starts`."""
        ...


def choose_starts(variables: Iterable[Any], put: Callable[[Any, F64], None], loss: Callable[[], float]) -> bool:
    """Begin each variable at the one of its starts with the smallest loss; return whether there was a choice.

    Parameters
    ----------
    variables
        Those without `starts` stay as they are.
    put
        Gives a variable a value, and makes the pictures show it.
    loss
        Returns the loss of all pictures as they are now, with the same random numbers at each call.
    """
    chosen = False
    for item in variables:
        if not isinstance(item, Starting) or len(item.starts) == 1:
            continue
        losses = []
        for start in item.starts:
            put(item, start)
            losses.append(loss())
        best = item.starts[int(np.argmin(losses))]
        item.begin(best)
        put(item, best)
        chosen = True
    return chosen

"""Cases, some of which run only with the slow tests (``pytest -m slow``)."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import pytest
from _pytest.mark import ParameterSet

Parameter = str | ParameterSet


def slow(names: Iterable[str], chosen: Collection[str]) -> list[Parameter]:
    """The names as parameters of a test, those that are `chosen` marked slow."""
    return [pytest.param(name, marks=pytest.mark.slow) if name in chosen else name for name in names]


def slow_but(names: Iterable[str], quick: Collection[str]) -> list[Parameter]:
    """The names as parameters of a test, all but the `quick` ones marked slow."""
    names = list(names)
    return slow(names, [name for name in names if name not in quick])

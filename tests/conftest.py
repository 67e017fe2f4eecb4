"""What all tests share: the slow and the windowed ones run only when ``-m`` names them."""

from __future__ import annotations

import pytest

ONLY_WHEN_NAMED = ("slow", "gui")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect tests whose marker was not asked for."""
    left_out = [marker for marker in ONLY_WHEN_NAMED if marker not in config.option.markexpr]
    deselected = [item for item in items if any(item.get_closest_marker(marker) for marker in left_out)]
    if deselected:
        config.hook.pytest_deselected(items=deselected)
        items[:] = [item for item in items if item not in set(deselected)]

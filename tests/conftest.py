"""What all tests share.

The slow and the windowed ones run only when ``-m`` names them. A run fails if it makes more statistical comparisons
than the level of their alarms assumes, or if a test changes a scene's parts that tests share.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import pytest

# NumPy's inverses of small matrices otherwise wait for a second thread, for milliseconds where all cores are busy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.support import block_statistics, shared_objects

ONLY_WHEN_NAMED = ("slow", "gui", "window")
# Comparisons made by the processes of a run that have ended.
_made = 0
# Checksums of what tests share, as the module before has left it.
_shared: dict[str, int] = {}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect tests whose marker `-m` does not name."""
    left_out = [marker for marker in ONLY_WHEN_NAMED if marker not in config.option.markexpr]
    deselected = [item for item in items if any(item.get_closest_marker(marker) for marker in left_out)]
    if deselected:
        config.hook.pytest_deselected(items=deselected)
        items[:] = [item for item in items if item not in set(deselected)]


@pytest.fixture(scope="module", autouse=True)
def _shared_objects_stay(request: pytest.FixtureRequest) -> Iterator[None]:
    """What modules of tests hold in common is after each module what it was before it."""
    global _shared
    before = _shared or shared_objects.fingerprints()
    yield
    _shared = shared_objects.fingerprints()
    changed = shared_objects.changes(before, _shared)
    assert not changed, f"{request.module.__name__} changes {', '.join(changed)}: copy it before"


@pytest.fixture
def lit_scene() -> None:
    """Blender's scene has a camera and a lamp, and nothing else."""
    from tests.support.scenes import blender_scenes  # needs bpy

    blender_scenes.empty()
    blender_scenes.camera()
    blender_scenes.light("POINT")


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Add the comparisons of a process of pytest-xdist that has ended."""
    global _made
    _made += getattr(node, "workeroutput", {}).get("comparisons", 0)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail a run of more comparisons than the level of an alarm assumes."""
    global _made
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["comparisons"] = block_statistics.Count.made
        return
    _made += block_statistics.Count.made
    if _made > block_statistics.MOST_COMPARISONS and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say how many comparisons there were."""
    most, alarm = block_statistics.MOST_COMPARISONS, block_statistics.SUITE_ALARM
    if _made > most:
        terminalreporter.write_line(
            f"{_made} statistical comparisons, but their level is that of at most {most}: raise MOST_COMPARISONS in "
            "tests/support/block_statistics.py", red=True
        )  # fmt: skip
    elif _made:
        terminalreporter.write_line(
            f"{_made} of at most {most} statistical comparisons, which raise a false alarm with a probability below "
            f"{alarm * _made / most:.1g}"
        )

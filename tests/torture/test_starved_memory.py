"""Calls that run out of memory raise MemoryError, and their objects stay usable."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from edgegrad.rendering.native_engine import embree_version
from tests.torture.starved import CHANGING, COMPUTING

ROOT = Path(__file__).parents[2]
# What a failed allocation may become: "done" where nothing needed it, and what Python and numpy themselves make of it.
FAIR = (
    "done", "MemoryError", "OSError: [Errno 12]", "RuntimeError: can't allocate lock",
    "SystemError: error return without exception set", "SystemError: <",
)

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or "asan" in os.environ.get("LD_PRELOAD", ""), reason="replaces glibc's malloc"
)


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library that lets chosen allocations fail."""
    out = tmp_path_factory.mktemp("shim") / "failing_malloc.so"
    source = Path(__file__).parent / "failing_malloc.cpp"
    compiler = os.environ.get("CXX", "c++")
    try:
        subprocess.run([compiler, "-O1", "-shared", "-fPIC", "-o", out, source], check=True, capture_output=True)
    except FileNotFoundError:
        pytest.skip("there is no C++ compiler")
    return out


def attempts(shim: Path, scene: str, call: str, first: int, stride: int) -> Iterator[dict[str, object]]:
    """What became of a call with each n-th allocation failing; a crash is an outcome, too."""
    embree_version()
    while True:
        # pymalloc's small objects come out of the interpreter's arenas; nothing of ours is among them.
        done = subprocess.run(
            [sys.executable, "-m", "tests.torture.starved", scene, call, str(first), str(stride)], cwd=ROOT,
            env={**os.environ, "LD_PRELOAD": str(shim)}, capture_output=True, text=True, timeout=600, check=False,
        )
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        yield from (line for line in lines if "outcome" in line)
        if lines and "end" in lines[-1]:
            return
        assert len(lines) > 1, done.stderr
        n = lines[-1]["n"]
        yield {"n": n, "outcome": f"ends the process ({done.returncode}) {done.stderr[-300:]}", "usable": False}
        first = n + stride


def check(shim: Path, scene: str, call: str, first: int, stride: int) -> None:
    found = list(attempts(shim, scene, call, first, stride))
    assert found
    bad = [line for line in found if not str(line["outcome"]).startswith(FAIR) or not line["usable"]]
    assert not bad, f"{len(bad)} of {len(found)} attempts: {bad[:5]}"
    assert any(str(line["outcome"]).startswith("MemoryError") for line in found)


@pytest.mark.parametrize("call", ["gradient", "construction", "update_named"])
def test_some_allocation_fails(shim: Path, call: str) -> None:
    check(shim, "box", call, 1, 1 if call == "update_named" else 23)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["box", "rich"])
@pytest.mark.parametrize("call", COMPUTING + CHANGING)
def test_any_allocation_fails(shim: Path, scene: str, call: str) -> None:
    check(shim, scene, call, 1, 1)


@pytest.mark.parametrize(
    "call",
    ["gradient", *(pytest.param(call, marks=pytest.mark.slow) for call in ("picture", "construction", "update"))],
)
def test_address_space_is_limited(call: str) -> None:
    """No more than a few megabytes: the whole call fails, or it doesn't."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.torture.limited", call], cwd=ROOT, capture_output=True, text=True, timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    # Pictures and updates find what they need in what earlier calls have given back.
    assert "MemoryError" in done.stdout or call in ("picture", "update")

"""First fits in Blender's window: the path of a newcomer from the zip on, and the examples that are ready to fit.

    make test-window EXTENSION=dist/edgegrad-0.1.0.zip [WINDOW_DIR=FOLDER] [SHOTS=FOLDER]
"""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad_addon
from blend_examples import ready_to_fit

pytestmark = pytest.mark.window


def test_a_newcomer_comes_to_a_finished_fit(run: Any) -> None:
    found, log = run("newcomer", installed=False)
    assert "Loss" in found["said"] and not found["failed"], found
    assert found["color"][2] > found["color"][0] and "Traceback" not in log  # the target is blue
    assert found["clicks"] == 8, "docs/how_to/fit_in_blender.md says how many"


def test_each_example_fits_and_is_undone(tmp_path: Path, run: Any) -> None:
    edgegrad_addon.register()
    try:
        for name in ready_to_fit.EXAMPLES:
            ready_to_fit.build(name, tmp_path / "ready", size=64, samples=16)
    finally:
        edgegrad_addon.unregister()
    found, log = run("ready", data=tmp_path / "ready")
    assert found.keys() == ready_to_fit.EXAMPLES.keys() and "Traceback" not in log
    for name, one in found.items():
        assert "Loss" in one["said"] and not one["failed"] and one["changed"] and one["undone"], name

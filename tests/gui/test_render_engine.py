"""Rendered views and F12 in Blender's window, of the demo scene.

    make test-window EXTENSION=dist/edgegrad-0.1.0.zip [WINDOW_DIR=FOLDER] [SHOTS=FOLDER]

The seconds that `scripts/views.py` finds are no test; they stand in its found.json.
"""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from blend_examples import build_sculpt

pytestmark = pytest.mark.window

# Growth of the memory over a thousand updates: no picture of the view is kept.
MOST_GROWTH = 64e6


def test_rendered_views_and_frames(tmp_path: Path, run: Any) -> None:
    blend = tmp_path / "demo.blend"
    build_sculpt.build_true_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    found, _ = run("views", blend)
    assert found["equal bits"], "F12 is not the picture of the export"
    assert found["memory"] < MOST_GROWTH

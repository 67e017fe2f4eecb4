"""Rendered views and F12 in a real Blender with a window.

    EDGEGRAD_GUI=/path/to/blender_gui.sh EXTENSION=dist/edgegrad-0.1.0.zip pytest -m gui tests/gui/test_render_engine.py

EDGEGRAD_GUI starts Blender with a window, installs the extension and runs a driver script in it (its options: --ext ZIP
--blend FILE --out FOLDER DRIVER). Screenshots are left in the folder.
"""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import os
import pathlib
import shlex
import subprocess

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from blend_examples import build_sculpt

pytestmark = pytest.mark.gui

DRIVER = pathlib.Path(__file__).with_name("render_engine_driver.py")
GUI, EXTENSION = os.environ.get("EDGEGRAD_GUI", ""), os.environ.get("EXTENSION", "")
# Growth of the memory over a thousand updates: no picture of the view is kept.
MOST_GROWTH = 64e6


def test_rendered_views_and_frames(tmp_path: pathlib.Path) -> None:
    if not GUI or not EXTENSION:
        pytest.skip("needs a command that starts Blender with a window (EDGEGRAD_GUI=…) and the extension's zip "
                    "(EXTENSION=…)")  # fmt: skip
    blend, out = tmp_path / "demo.blend", pathlib.Path(os.environ.get("EDGEGRAD_GUI_OUT", tmp_path / "shots"))
    build_sculpt.build_true_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    run = subprocess.run([*shlex.split(GUI), "--ext", EXTENSION, "--blend", str(blend), "--out", str(out),
                          "--timeout", "600", str(DRIVER)], capture_output=True, text=True, check=False)  # fmt: skip
    log = (out / "blender.log").read_text() if (out / "blender.log").exists() else run.stdout + run.stderr
    assert run.returncode == 0 and "ALL WELL" in log, log
    grown = next(line.split()[-1] for line in log.splitlines() if line.startswith("MEASURED memory"))
    assert float(grown) < MOST_GROWTH

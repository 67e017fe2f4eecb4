"""Runs scripts in a Blender with a window, in a Debian chroot that `blender_window.sh` makes in the folder WINDOW_DIR
(about 3 GB; it needs root). The screenshots of a script are kept in SHOTS.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
EXTENSION = os.environ.get("EXTENSION", "")
FOLDER, SHOTS = os.environ.get("WINDOW_DIR", ""), os.environ.get("SHOTS", "")
LIMIT = 5000  # seconds of the processor for one script


@pytest.fixture(scope="module")
def run(tmp_path_factory: Any) -> Any:
    """Run a script in Blender once, with a file and a folder if they are given.

    It returns what the script has found, and Blender's log.
    """
    if not EXTENSION or not FOLDER:
        pytest.skip("needs the extension's zip (EXTENSION=…) and a folder for a Blender with a window (WINDOW_DIR=…)")
    known: dict[str, tuple[dict[str, Any], str]] = {}
    failed: dict[str, str] = {}

    def once(name: str, blend: Path | None = None, data: Path | None = None,
             installed: bool = True) -> tuple[dict[str, Any], str]:  # fmt: skip
        assert name not in failed, failed[name]
        if name not in known:
            folder = tmp_path_factory.mktemp(name)
            # Blender sees no more of the tests than what its scripts need.
            tests = folder / "tests"
            shutil.copytree(HERE, tests / "gui", ignore=shutil.ignore_patterns("__pycache__"))
            (tests / "__init__.py").touch()
            out = Path(SHOTS) / name if SHOTS else folder / "out"
            # A script that installs the extension itself finds the zip among its data.
            command = ["bash", str(HERE / "blender_window.sh"), "--dir", FOLDER, "--ext" if installed else "--data",
                       EXTENSION, "--out", str(out), "--timeout", str(LIMIT), "--data", str(tests),
                       *(["--blend", str(blend)] if blend else []), *(["--data", str(data)] if data else []),
                       str(HERE / "start.py"), name]  # fmt: skip
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            log = (out / "blender.log").read_text() if (out / "blender.log").exists() else ""
            if done.returncode != 0:
                failed[name] = done.stderr + log
            assert done.returncode == 0, failed[name]
            known[name] = json.loads((out / "found.json").read_text()), log
        return known[name]

    return once

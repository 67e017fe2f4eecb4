"""Blender quits while a fit runs."""

from __future__ import annotations

from typing import Any

from tests.gui.scripts import stage
from tests.gui.scripts.stage import fitting
from tests.gui.window import Script, redraw

FOUND: dict[str, Any] = {}


def main() -> Script:
    """Start a fit and end the script, which quits Blender."""
    yield from redraw(1.0)
    stage.save()
    yield from fitting()
    FOUND["runs"] = stage.status().job is not None

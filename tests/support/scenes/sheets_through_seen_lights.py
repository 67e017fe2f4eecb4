"""Sheets that pass through lights that the camera sees."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import edgegrad
from edgegrad._check import RAYS
from tests.support.scenes.seen_lights import LIGHTS as OUTLINED
from tests.support.scenes.seen_lights import VIEWS
from tests.support.small_scenes import matte, rectangle

LIGHTS = {name: OUTLINED[name] for name in ("sphere", "disk", "spot", "rectangle", "ellipse")}


def sheet_through(light: str, view: str, alpha: float = 1.0) -> edgegrad.Scene:
    """A light that a black sheet passes through."""
    return edgegrad.Scene(
        deepcopy(VIEWS[view]), {"sheet": rectangle((0.25, 0.1, 0.45), (0.5, 0.1, 0.4), (0.0, 0.9, 0.3), "black")},
        {"black": replace(matte(0.0, 0.0, 0.0), alpha=alpha)},
        {"lamp": replace(LIGHTS[light], visible_to=frozenset(RAYS))},
    )

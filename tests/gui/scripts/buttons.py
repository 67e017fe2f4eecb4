"""The menu of buttons: Fit with Edgegrad on the inputs of the world's shader, as the properties editor shows them.

Those of a material are the same; its preview, which software OpenGL draws, takes a minute.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import bpy

from tests.gui.scripts import stage
from tests.gui.window import Script, area, point, redraw, shot, window

FOUND: dict[str, Any] = {}
STEP = 18  # pixels between two places of the pointer, less than a button is high


def shown(part: float) -> Generator[float, None, Any]:
    """Go down the properties editor until there is a button of a node, and return what it shows."""
    editor = area("PROPERTIES")
    region = next(one for one in editor.regions if one.type == "WINDOW")
    for y in range(region.y + region.height - STEP, region.y, -STEP):
        point(region.x + part * region.width, y)
        yield 0.05
        with bpy.context.temp_override(window=window(), area=editor, region=region):
            if bpy.context.property is not None and "inputs[" in bpy.context.property[1]:
                FOUND["added"] = sorted(bpy.ops.edgegrad.parameter_add("INVOKE_DEFAULT"))
                return bpy.context.property
    return None


def main() -> Script:
    """Add what the first button of the shader shows."""
    yield from redraw(1.0)
    stage.cube()
    area("PROPERTIES").spaces.active.context = "WORLD"
    yield from redraw(1.0)
    found = yield from shown(0.7)
    shot("buttons")
    FOUND["embedded"] = found is not None and found[0].is_embedded_data
    FOUND["rows"] = [row.name for row in bpy.context.scene.edgegrad.parameters]

"""What the operators share: messages and pictures in Blender."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..problem import Problem, Report
from ..status import STATUS

# What a person can put right; anything else is a defect and shows with its traceback.
EXPECTED = (Problem, ValueError, OSError, FloatingPointError, ImportError)


def tell(operator: Any, report: Report, notes: Sequence[str] = ()) -> None:
    """Pass an export's warnings, and notes on what derivatives leave out, to Blender's message area and the panel."""
    STATUS.say(report.lines, notes)
    for line in report.lines:
        operator.report({"WARNING"}, line)
    for note in notes:
        operator.report({"INFO"}, note)


def refuse(operator: Any, error: BaseException) -> set[str]:
    """Report an error; returns what the operator returns."""
    operator.report({"ERROR"}, str(error))
    return {"CANCELLED"}


def show(name: str, pixels: NDArray[Any]) -> Any:
    """Make the picture (H, W, 3), linear, row 0 on top, an image in Blender; replaces one of the same name."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.get(name)
    if image is not None and tuple(image.size) != (width, height):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=True, is_data=False)
    full = np.ones((height, width, 4), np.float32)
    full[..., :3] = pixels[::-1]
    image.pixels.foreach_set(full.ravel())
    image.update()
    _open(image)
    return image


def _open(image: Any) -> None:
    """Show the image in an Image Editor; where there is none, open one as the preferences say for renders."""
    if bpy.app.background:
        return
    editor = _image_editor()
    if editor is None:
        bpy.ops.render.view_show("INVOKE_DEFAULT")
        editor = _image_editor()
    if editor is not None:  # else the preferences keep the window as it is
        editor.spaces.active.image = image


def _image_editor() -> Any:
    areas = (area for window in bpy.context.window_manager.windows for area in window.screen.areas)
    return next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
